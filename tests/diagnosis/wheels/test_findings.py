"""What stays open where rounding hides the noise of a steady speed."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.wheels.findings import Surroundings, WheelFindings, WheelPath, findings_of
from diagnosis.wheels.models import HEALTHY, MODELS, S_STUCK, WheelFilterModel
from diagnosis.wheels.run_kernel import RunEvidence
from diagnosis.wheels.runs import Runs
from replay.faults import Side
from replay.machine.config import Limits

STEP = 0.004
MODEL = WheelFilterModel(
    K=2.4, tau=0.25, noise=0.001, constant_noise=0.001, rounding=0.001, load=0.014, span=0.8, valve_span=0.15
)
BLOCKS, WIDTH = 300, 10
Array = np.ndarray


def found(level: float, expected: float, *, flickers: bool, odd: Array | None = None) -> WheelFindings:
    """A wheel at a steady speed, which the path calls stuck in the second half."""
    y = np.full(BLOCKS * WIDTH, level)
    if flickers:
        y[::7] += STEP
    at = np.array([0, BLOCKS // 2])
    runs = Runs(at, np.array([BLOCKS // 2, BLOCKS]), np.array([HEALTHY, S_STUCK]), at)
    log_evidence = np.full((2, MODELS), -1e4)
    log_evidence[:, HEALTHY], log_evidence[1, S_STUCK] = 0.0, 500.0
    evidence = RunEvidence(
        log_evidence,
        np.zeros((2, MODELS, 4)),
        np.tile(np.eye(4), (2, MODELS, 1, 1)),
        np.full(BLOCKS, expected),
        np.full(BLOCKS, 1e-4),
    )
    none = np.zeros(BLOCKS, np.bool_)
    odd = none if odd is None else odd
    around = Surroundings(0.02, np.full(BLOCKS, 0.1), 0.1, np.zeros(BLOCKS), none, none)
    habit = np.zeros(BLOCKS, np.int8)
    path = WheelPath(y, ("v", "u"), MODEL, 0.002, WIDTH, runs, evidence, none, np.zeros(BLOCKS), habit, odd, around)
    return findings_of(path, Limits(), gains=True)


@pytest.mark.parametrize(
    ("level", "expected", "flickers", "sides"),
    [
        (0.3, 0.3, True, ()),  # a healthy wheel would do the same
        (0.3, 0.3, False, (Side.SENSOR,)),  # its noise may be hidden
        (0.5, 0.1, True, (Side.SENSOR, Side.ACTUATOR)),  # no stuck sensor: a valve that stands open would look like it
    ],
)
def test_sides_that_a_steady_speed_leaves_open(
    level: float, expected: float, flickers: bool, sides: tuple[Side, ...]
) -> None:
    out = found(level, expected, flickers=flickers)
    late = slice(BLOCKS * WIDTH // 2 + 50, None)
    assert not out.findings
    assert {s for s, at in out.opened.items() if at[late].all()} == set(sides)
    assert all(not at[: BLOCKS * WIDTH // 2 - 50].any() for at in out.opened.values())


def test_an_unusual_load_leaves_the_valve_open() -> None:
    """Half a second of it does; less is what a healthy wheel shows at a bump."""
    odd = np.zeros(BLOCKS, np.bool_)
    odd[10:20], odd[40:110] = True, True
    out = found(0.3, 0.3, flickers=True, odd=odd)
    at = np.zeros(BLOCKS * WIDTH, np.bool_)
    at[40 * WIDTH : 110 * WIDTH] = True
    np.testing.assert_array_equal(out.opened[Side.ACTUATOR], at)
    assert not out.opened[Side.SENSOR].any()
    assert not out.findings
    assert not any(x.any() for x in out.unexplained.values())
