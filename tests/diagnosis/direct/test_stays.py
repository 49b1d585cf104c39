"""Valves that open in steps: a brief stay is their habit, a longer or larger one is not, nor one of a valve that follows smoothly."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.stays import without_stays
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
DT, SIZE = 0.01, 6000
WHEELS = ("FR", "FL", "RR", "RL")
COMMAND = 0.6 * np.sin(np.arange(SIZE) * DT * 0.7)
STEP = 1 / 16


def valve(opening: Array) -> IdentifiedPair:
    y = opening + 0.0005 * np.random.default_rng(1).standard_normal(SIZE)
    status = np.full(SIZE, PAIR, np.int8)
    part = lambda a, b: (y[a:b], COMMAND[a:b], status[a:b])  # noqa: E731
    samples = SimpleNamespace(x=COMMAND, y=y, status=status, part=part)
    model = SimpleNamespace(noise=0.0005)
    return cast(IdentifiedPair, SimpleNamespace(samples=samples, model=model, pair=SimpleNamespace(dt=DT, span=1.0)))


def told(opening: Array, own: Array, start: int, stop: int, mode: FaultMode = FaultMode.STUCK) -> Assessment:
    """What is left of a finding on one valve, beside three others."""
    states = np.full(SIZE, CODE[State.HEALTHY])
    states[start:stop] = CODE[State(mode.value)]
    finding = Finding(start, stop, Side.ACTUATOR, mode, 0.96, (), None, None, (), Tier.DIRECT)
    pairs = {w: valve(own if w == "FR" else opening) for w in WHEELS}
    return without_stays(pairs, {"FR": Assessment(states, findings=(finding,), tier=Tier.DIRECT)})["FR"]


def steps() -> Array:
    return np.asarray(np.round(COMMAND / STEP) * STEP)


def held(opening: Array, start: int, stop: int) -> Array:
    """An opening that stays where it was for a while."""
    out = opening.copy()
    out[start:stop] = out[start]
    return out


def test_a_stay_as_brief_and_small_as_the_others_is_left_open() -> None:
    after = told(steps(), steps(), 1795, 1812)
    assert after.findings == ()
    assert (after.states[1795:1812] == CODE[State.NOT_ASSESSED]).all()


@pytest.mark.parametrize(
    ("opening", "own", "start", "stop"),
    [
        (steps(), held(steps(), 1600, 1850), 1600, 1850),  # it lasts
        (steps(), held(steps(), 1780, 1835), 1780, 1835),  # it comes further off
        (COMMAND, held(COMMAND, 1795, 1815), 1795, 1815),  # no valve of this machine opens in steps
    ],
)
def test_a_longer_or_larger_stay_is_a_fault_and_so_is_one_of_a_smooth_valve(
    opening: Array, own: Array, start: int, stop: int
) -> None:
    assert told(opening, own, start, stop).findings


def test_other_rows_are_left_alone() -> None:
    assert told(steps(), steps(), 1795, 1812, FaultMode.NOISY).findings
