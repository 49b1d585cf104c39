"""Noise of a valve that is how valves switch: spikes that several have, and a motion that comes late; true noise stays."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.switching import without_switching
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
DT, SIZE = 0.01, 2_000
RNG = np.random.default_rng(5)
COMMAND = 0.4 * np.sin(np.arange(SIZE) * DT * 4.0)
SPAN = (800, 1_000)


def valve(opening: Array) -> IdentifiedPair:
    status = np.full(SIZE, PAIR, np.int8)
    part = lambda a, b: (opening[a:b], COMMAND[a:b], status[a:b])  # noqa: E731
    return cast(
        IdentifiedPair, SimpleNamespace(samples=SimpleNamespace(part=part), pair=SimpleNamespace(dt=DT, span=1.0))
    )


def left(openings: dict[str, Array], mode: FaultMode = FaultMode.NOISY, span: tuple[int, int] = SPAN) -> dict[str, int]:
    """How many findings stay on each valve of those that had one each."""
    finding = Finding(*span, Side.ACTUATOR, mode, 0.96, (), None, None, (), Tier.DIRECT)
    states = np.full(SIZE, CODE[State.HEALTHY])
    states[slice(*span)] = CODE[State(mode.value)]
    before = {w: Assessment(states, findings=(finding,), tier=Tier.DIRECT) for w in openings}
    after = without_switching({w: valve(y) for w, y in openings.items()}, before)
    return {w: len(a.findings) for w, a in after.items()}


def spiky(size: float, first: int = 805) -> Array:
    out = COMMAND + 0.003 * RNG.standard_normal(SIZE)
    out[first : SPAN[1] : 25] += size
    return out


def shaken() -> Array:
    return np.asarray(COMMAND + 0.1 * RNG.standard_normal(SIZE))


def test_spikes_of_one_size_on_several_valves_are_left_open() -> None:
    assert left({"FR": spiky(0.5), "FL": spiky(0.4, 811), "RR": shaken()}) == {"FR": 0, "FL": 0, "RR": 1}
    assert left({"FR": spiky(0.5), "FL": spiky(0.1, 811)}) == {"FR": 1, "FL": 1}  # they have not one cause
    assert left({"FR": spiky(0.5)}) == {"FR": 1}


@pytest.mark.parametrize(
    ("mode", "span", "kept"),
    [(FaultMode.NOISY, SPAN, 0), (FaultMode.NOISY, (800, 1_200), 1), (FaultMode.STUCK, SPAN, 1)],
)
def test_a_brief_motion_that_comes_late_is_no_noise(mode: FaultMode, span: tuple[int, int], kept: int) -> None:
    late = np.roll(COMMAND, 8) + 0.01 * RNG.standard_normal(SIZE)
    assert left({"FR": late}, mode, span) == {"FR": kept}


def test_noise_stays_noise_however_brief() -> None:
    assert left({"FR": shaken(), "FL": shaken()}) == {"FR": 1, "FL": 1}


def at_level(level: float, size: float) -> Array:
    """An opening with a spike whenever its command passes a level."""
    out = COMMAND + 0.003 * RNG.standard_normal(SIZE)
    out[np.abs(COMMAND - level) < 0.008] += size
    return out


def test_spikes_that_come_at_one_opening_are_how_the_valves_of_a_bank_take_turns() -> None:
    assert left({"FR": at_level(0.25, 0.5)}) == {"FR": 0}
    anywhere = at_level(0.25, 0.5)
    anywhere[810:1_000:60] += 0.5
    assert left({"FR": anywhere}) == {"FR": 1}
    assert left({"FR": spiky(0.5)}) == {"FR": 1}
