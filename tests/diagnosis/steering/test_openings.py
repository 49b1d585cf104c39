"""The measured opening of a steering valve beside its command."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.measured_twice import of_one_cause
from diagnosis.steering.openings import latest, opens_as_told
from diagnosis.steering.side_findings import SideFindings
from replay.faults import FaultMode, Side
from tests.diagnosis.steering.test_measured_twice import axle

Array = NDArray[np.float64]
DT, SIZE = 0.02, 3000
T = np.arange(SIZE) * DT
COMMAND = np.where((T % 10.0 > 3.0) & (T % 10.0 < 5.5), 0.7, np.where(T % 10.0 > 8.0, -0.5, 0.02))


def slewed(command: Array, rate: float) -> Array:
    """An opening that follows its command at a limited rate [1/s]."""
    out = np.zeros(command.size)
    for k in range(1, command.size):
        out[k] = out[k - 1] + np.clip(command[k] - out[k - 1], -rate * DT, rate * DT)
    return out


def as_told(opening: Array, command: Array = COMMAND, usual: float = 0.0) -> bool:
    return opens_as_told(opening, command, np.ones(command.size, np.bool_), latest(usual, DT), loss=0.1, least=0.02)


@pytest.mark.parametrize(
    ("opening", "healthy"),
    [
        (COMMAND, True),
        (slewed(COMMAND, 4.0), True),
        (0.93 * COMMAND, True),
        (0.5 * COMMAND, False),
        (COMMAND + 0.1, False),
        (0.0 * COMMAND, False),
        (slewed(COMMAND, 0.5), False),
    ],
    ids=["at once", "by ramps", "nearly", "half", "off", "dead", "far too slow"],
)
def test_an_opening_is_where_its_command_was_a_moment_ago_and_goes_as_far(opening: Array, healthy: bool) -> None:
    assert as_told(opening) is healthy


def test_what_is_usually_late_may_be_later() -> None:
    late = np.interp(T - 0.45, T, COMMAND)
    assert not as_told(late)
    assert as_told(late, usual=0.15)


def test_a_command_that_switches_to_and_fro_shows_nothing() -> None:
    flips = 0.14 * np.sign(np.sin(40.0 * T))
    assert not as_told(np.zeros(SIZE), flips)


def found(opening: Array, *findings: Finding) -> SideFindings:
    """What is said of a valve whose axle's model says `findings`."""
    values = {"u": COMMAND, "u_applied": opening + 0.002 * np.random.default_rng(1).standard_normal(SIZE)}
    return of_one_cause(Side.ACTUATOR, SideFindings(findings, ()), axle(values, DT), 0.02)


def test_an_opening_that_is_off_its_command_is_told_where_the_model_says_nothing() -> None:
    off = np.where(T > 30.0, COMMAND + 0.1, COMMAND)
    (finding,) = found(off).findings
    assert finding.mode is FaultMode.OUTSIDE_TABLE
    assert finding.start * DT == pytest.approx(30.0, abs=0.3)
    assert "an offset" in finding.evidence[0]
    assert found(COMMAND).findings == ()


def test_ramps_are_no_fault_whatever_the_model_says() -> None:
    row = (Hypothesis("actuator", "noisy", 1.0),)
    noisy = Finding(1100, 1400, Side.ACTUATOR, FaultMode.NOISY, 1.0, row, None, None, (), Tier.MODEL)
    left = found(slewed(COMMAND, 4.0), noisy)
    assert left.findings == ()
    assert left.unexplained == ((1100, 1400),)
