"""Pieces of one disturbance of a valve are one fault; what is over for longer, surely dead, or no valve's, stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.decision.passing_rows import with_disturbances_as_one
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

from .findings import assessed, finding

DT = 0.001
NOISY, LOSS, STUCK = FaultMode.NOISY, FaultMode.INEFFICIENT, FaultMode.STUCK


def piece(mode: FaultMode, start: int, stop: int, side: Side = Side.ACTUATOR, **rows: float) -> Finding:
    """A piece that may be of several rows [1]; of its own alone without any."""
    p = rows or {mode.value: 0.96, **{m.value: 0.01 for m in (NOISY, LOSS, STUCK) if m is not mode}}
    named = tuple(Hypothesis(side.value, row, x) for row, x in p.items())
    return replace(finding(side, mode, start, stop, epsilon=0.4), probability=p[mode.value], hypotheses=named)


def told(*findings: Finding, side: str = "actuator") -> Assessment:
    return with_disturbances_as_one({("FR", side): assessed(*findings)}, DT)["FR", side]


UNSURE = {"inefficient": 0.8, "stuck": 0.1, "noisy": 0.01}
PIECES = (piece(NOISY, 1000, 6000), piece(LOSS, 7500, 12_000, **UNSURE), piece(NOISY, 13_000, 20_000))


def test_what_looks_like_several_rows_in_turn_is_one_fault_with_its_course() -> None:
    after = told(*PIECES)
    (one,) = after.findings
    assert (one.start, one.stop, one.mode) == (1000, 20_000, NOISY)
    assert one.probability == pytest.approx(0.5, abs=0.02)  # or in no row, as probably
    assert sum(h.p for h in one.hypotheses) == pytest.approx(1.0, abs=0.03)
    assert "3 stretches (1.0–6.0 s, 7.5–12.0 s, 13.0–20.0 s), which look like 2 rows in turn" in one.course[-1]
    assert not np.any(after.states[1000:20_000] == CODE[State.HEALTHY])
    assert one.epsilon is not None
    assert one.epsilon.low < 0.4 < one.epsilon.high


def test_noise_with_a_quiet_moment_stays_as_sure_as_it_may_be() -> None:
    (one,) = told(piece(NOISY, 1000, 6000), piece(NOISY, 7000, 12_000)).findings
    assert one.mode is NOISY
    assert 0.94 < one.probability <= 0.98
    assert "rows in turn" not in one.course[-1]


def test_a_row_that_all_pieces_allow_is_the_row() -> None:
    unclear = piece(STUCK, 1000, 2000, stuck=0.25, inefficient=0.25, noisy=0.25, no_signal=0.25)
    (one,) = told(unclear, piece(NOISY, 2500, 9000)).findings
    assert one.mode is NOISY
    assert one.probability > 0.8


def test_a_moment_that_looks_stuck_is_of_the_noise_around_it() -> None:
    (one,) = told(piece(NOISY, 1000, 9000), piece(STUCK, 9500, 9900)).findings
    assert (one.mode, one.stop) == (NOISY, 9900)


def test_a_valve_that_is_stuck_for_a_while_stays_a_fault_of_its_own() -> None:
    pieces = (piece(NOISY, 1000, 4000), piece(STUCK, 4500, 8000), piece(NOISY, 8500, 12_000))
    assert list(told(*pieces).findings) == list(pieces)


def test_the_share_of_a_valve_that_may_be_stuck_is_not_lost() -> None:
    half = piece(STUCK, 5000, 9000, stuck=0.45, inefficient=0.45, noisy=0.1)
    (one,) = told(piece(NOISY, 1000, 4000), half).findings
    assert sum(h.p for h in one.hypotheses if h.mode == STUCK.value) > 0.25


@pytest.mark.parametrize(
    "pieces",
    [
        (piece(NOISY, 1000, 2500), piece(LOSS, 5000, 7000)),  # healthy for longer than the longest of them lasts
        (piece(NOISY, 1000, 4000), piece(LOSS, 4500, 9000)),  # both sure
        (piece(NOISY, 1000, 9000), piece(NOISY, 13_500, 22_000)),  # for longer than a disturbance is quiet
        (piece(LOSS, 1000, 4000), piece(LOSS, 5000, 9000)),  # a loss that is healthy in between comes and goes
        (piece(NOISY, 1000, 4000),),
    ],
)
def test_other_faults_stay(pieces: tuple[Finding, ...]) -> None:
    assert told(*pieces).findings == pieces


def test_sensors_and_models_stay() -> None:
    sensors = tuple(piece(m, a, a + 3000, Side.SENSOR) for m, a in ((NOISY, 1000), (LOSS, 4500)))
    assert told(*sensors, side="sensor").findings == sensors
    models = tuple(replace(p, tier=Tier.MODEL) for p in PIECES)
    assert told(*models).findings == models
