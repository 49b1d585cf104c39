"""Ends of a steering valve's fault where its position leaves its command."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.onset import refined_valve
from replay.faults import FaultMode, Side

LENGTH = 20
SIZE = 7000


def finding(start: int, stop: int) -> Finding:
    """A valve without signal, its ends on blocks."""
    row = (Side.ACTUATOR.value, FaultMode.NO_SIGNAL.value)
    return Finding(
        start, stop, Side.ACTUATOR, FaultMode.NO_SIGNAL, 0.96, (Hypothesis(*row, 0.96),), None, None, (), Tier.MODEL
    )


def deviation(*spans: tuple[int, int]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Of a position, as multiples of its noise: twenty within some samples."""
    out = np.random.default_rng(3).normal(0.0, 1.0, SIZE)
    for start, stop in spans:
        out[start:stop] += 20.0
    return out


def test_a_fault_of_a_valve_at_rest_begins_with_the_command_that_it_does_not_follow() -> None:
    """Told to rest from sample 1800 to 3030 it rested; nothing shows that it was dead by then."""
    refined = refined_valve(finding(1800, 6000), deviation((3030, 6007)), LENGTH)
    assert (refined.start, refined.stop) == (3030, 6007)


@pytest.mark.parametrize("spans", [((1790, 6000),), ((1000, 1400), (1790, 6000))])
def test_an_onset_that_its_block_has_stays_there(spans: tuple[tuple[int, int], ...]) -> None:
    """What an earlier fault left of its command is none of this one."""
    assert refined_valve(finding(1800, 6000), deviation(*spans), LENGTH).start == 1790


def test_without_a_deviation_or_a_position_the_blocks_ends_stay() -> None:
    one = finding(1800, 6000)
    assert refined_valve(one, deviation(), LENGTH) == one
    assert refined_valve(one, None, LENGTH) == one
