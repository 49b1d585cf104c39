"""A valve that is no further off its command than the other valves of its machine is none that fails."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR, SKIP
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.small_deviations import without_small_deviations
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
DT, SIZE = 0.01, 6000
WHEELS = ("FR", "FL", "RR", "RL")
COMMAND = 0.6 * np.sin(np.arange(SIZE) * DT * 0.7)
SPAN = (1000, 4000)


def valve(gain: float, opens: slice = slice(None), every: int = 1) -> IdentifiedPair:
    """A valve that opens by a share of what it is told, for a while; its position comes at `every` step."""
    gains = np.ones(SIZE)
    gains[opens] = gain
    y, status, quiet = gains * COMMAND, np.full(SIZE, SKIP, np.int8), np.zeros(SIZE, np.bool_)
    status[::every] = PAIR
    part = lambda a, b: (y[a:b], COMMAND[a:b], status[a:b])  # noqa: E731
    samples = SimpleNamespace(x=COMMAND, y=y, status=status, quiet=quiet, part=part)
    pair, model = SimpleNamespace(dt=DT, span=1.0), SimpleNamespace(dt=every * DT)
    return cast(IdentifiedPair, SimpleNamespace(samples=samples, pair=pair, model=model))


def told(
    gains: tuple[float, ...],
    mode: FaultMode = FaultMode.INEFFICIENT,
    opens: slice = slice(None),
    hypotheses: tuple[Hypothesis, ...] = (),
    every: int = 1,
) -> Assessment:
    states = np.full(SIZE, CODE[State.HEALTHY])
    states[slice(*SPAN)] = CODE[State(mode.value)]
    finding = Finding(*SPAN, Side.ACTUATOR, mode, 0.97, hypotheses, None, None, (), Tier.DIRECT)
    pairs = dict(zip(WHEELS, (valve(x, opens, every) for x in gains), strict=False))
    return without_small_deviations(pairs, {"FR": Assessment(states, findings=(finding,), tier=Tier.DIRECT)})["FR"]


@pytest.mark.parametrize("every", [1, 5])
def test_what_another_valve_is_off_by_as_well_is_left_open(every: int) -> None:
    after = told((0.9, 1.0, 0.93, 0.96), every=every)
    assert after.findings == ()
    assert (after.states[slice(*SPAN)] == CODE[State.NOT_ASSESSED]).all()


@pytest.mark.parametrize("gains", [(0.9, 1.0, 0.99, 1.0), (0.6, 0.93, 0.93, 0.93), (0.9, 0.93)])
def test_what_is_its_own_or_large_or_beside_too_few_stays(gains: tuple[float, ...]) -> None:
    assert told(gains).findings


def test_a_stuck_valve_stays() -> None:
    assert told((0.9, 0.93, 0.93, 0.93), FaultMode.STUCK).findings


@pytest.mark.parametrize(("gains", "stays"), [((0.9, 0.92, 0.92, 1.0), False), ((0.9, 0.98, 0.98, 0.98), True)])
def test_what_others_are_off_by_meanwhile_is_left_open_though_they_seldom_are(
    gains: tuple[float, ...], stays: bool
) -> None:
    assert bool(told(gains, opens=slice(1000, 1400)).findings) is stays


def test_a_constant_that_may_be_a_share_is_left_open_likewise() -> None:
    """Nothing moves, so that a stuck valve and one that opens a little less are alike."""
    either = (Hypothesis("actuator", "stuck", 0.5), Hypothesis("actuator", "inefficient", 0.5))
    assert told((0.9, 1.0, 0.93, 0.96), FaultMode.STUCK, hypotheses=either).findings == ()


@pytest.mark.parametrize(("gain", "state"), [(0.94, State.HEALTHY), (0.9, State.NOT_ASSESSED)])
def test_what_is_hardly_off_its_command_is_healthy(gain: float, state: State) -> None:
    after = told((gain, 1.0, 0.93, 0.96))
    assert after.findings == ()
    assert (after.states[slice(*SPAN)] == CODE[state]).all()


@pytest.mark.parametrize(("gains", "stays"), [((0.9, 0.93, 0.92, 0.93), False), ((0.9, 1.0, 0.99, 1.0), True)])
def test_a_constant_beside_others_that_are_off_as_well_is_left_open(gains: tuple[float, ...], stays: bool) -> None:
    assert bool(told(gains, FaultMode.OUTSIDE_TABLE).findings) is stays


@pytest.mark.parametrize(
    ("gain", "mode", "stays"),
    [
        (0.96, FaultMode.NOISY, False),
        (0.96, FaultMode.OUTSIDE_TABLE, False),
        (0.96, FaultMode.INEFFICIENT, True),
        (0.9, FaultMode.NOISY, True),
    ],
)
def test_what_is_within_what_a_healthy_valve_may_be_off_by_is_no_noise(
    gain: float, mode: FaultMode, *, stays: bool
) -> None:
    after = told((gain, 1.0, 1.0, 1.0), mode)
    assert bool(after.findings) is stays
    assert stays or (after.states[slice(*SPAN)] == CODE[State.HEALTHY]).all()
