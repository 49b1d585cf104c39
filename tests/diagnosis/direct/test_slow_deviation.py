"""What departs slowly is no noise of a sensor."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.direct.slow_deviation import not_noise, slow_share
from diagnosis.estimation.lag import low_passed
from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]
DT, SIZE = 0.01, 2000
X = 1.0 + 0.4 * np.sin(np.arange(SIZE) * DT)
WHITE = 0.1 * np.random.default_rng(7).standard_normal(SIZE)
WANDERING = low_passed(WHITE, 1.0, DT) * 14.0


def told(off: Array, side: Side = Side.SENSOR, mode: FaultMode = FaultMode.NOISY, hold: float = DT) -> Finding:
    """A finding over the whole log of a channel that is `off` its reference."""
    measured = Measured(
        X + off, X, np.ones(SIZE, dtype=bool), DT, ("wheel.FR.v", "wheel.FR.v_true"), "m/s", 0.01, 0.05, 0.05
    )
    finding = Finding(
        0, SIZE, side, mode, 0.96, (Hypothesis(side.value, mode.value, 0.96),), None, None, ("a",), Tier.DIRECT
    )
    return not_noise(finding, measured, hold)


def test_what_wanders_is_explained_by_no_row() -> None:
    f = told(WANDERING)
    assert f.mode is FaultMode.OUTSIDE_TABLE
    assert f.probability == pytest.approx(0.6)
    assert sum(h.p for h in f.hypotheses) == pytest.approx(1.0)
    assert "departs slowly" in f.evidence[0]
    assert f.evidence[1] == "a"


@pytest.mark.parametrize(
    ("off", "side", "mode"),
    [
        (WHITE, Side.SENSOR, FaultMode.NOISY),
        (WANDERING, Side.ACTUATOR, FaultMode.NOISY),
        (WANDERING, Side.SENSOR, FaultMode.INEFFICIENT),
    ],
)
def test_noise_and_disturbed_valves_and_other_rows_stay(off: Array, side: Side, mode: FaultMode) -> None:
    assert told(off, side, mode).mode is mode


def test_noise_of_a_slow_log_is_noise() -> None:
    held = np.repeat(WHITE[::20], 20)  # a new reading every 0.2 s
    assert told(held, hold=0.2).mode is FaultMode.NOISY


def test_a_short_finding_tells_nothing() -> None:
    assert slow_share(X[:100], X[:100], 25) is None
