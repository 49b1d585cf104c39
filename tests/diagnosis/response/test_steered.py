"""A tricycle: its only drive sits on the wheel that steers, and rolls along that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.body import BodySpeed, made_of, view_of
from diagnosis.response.inputs import cells
from diagnosis.response.kernel import follow
from diagnosis.response.models import BLOCK_S
from diagnosis.response.steered import stretched
from diagnosis.results.assessment import CODE
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, SECONDS, commands, followers_of

Array = NDArray[np.float64]

N, WIDTH, WHEEL = round(SECONDS / DT), round(BLOCK_S / DT), "D"
LIMITS = Limits(driving_speed=0.05)
PART = slice(round(60 / DT), round(80 / DT))


def tricycle(seed: int) -> tuple[Array, Array, Array]:
    """Measured speed of the wheel, the body's commanded speed [m/s], and how much faster than the body the wheel rolls."""
    asked, turn = commands(seed)
    rng = np.random.default_rng(seed)
    phi = follow(0.9 * turn / 0.5, 0.0, 0.15, 0.1)
    stretch = np.asarray(1.0 / np.cos(phi))
    late = np.r_[np.zeros(6), (asked * stretch)[:-6]]
    return follow(late, 0.0, 0.3, 0.15) + rng.normal(0.0, 0.004, N), asked, stretch


def judged(y: Array, asked: Array, stretch: Array | None, sensors: tuple[BodySpeed, ...] = ()) -> Judgement:
    told = stretched(y, asked, stretch, LIMITS.driving_speed, DT)
    data = followers_of({WHEEL: y}, {WHEEL: told}, told[:, None])
    return assess_response({WHEEL: replace(data[WHEEL], stretch=stretch)}, None, None, LIMITS, DT, sensors)


def odometry(v: Array, noise: float = 0.04) -> BodySpeed:
    read = v + np.random.default_rng(8).normal(0.0, noise, v.size)
    return BodySpeed("odometry", cells(read, WIDTH), True, 1)


def test_the_command_of_the_body_is_taken_along_the_wheel_where_the_wheel_rolls_so() -> None:
    y, asked, stretch = tricycle(3)
    assert stretched(y, asked, stretch, 0.05, DT) == pytest.approx(asked * stretch)
    straight = follow(np.r_[np.zeros(6), asked[:-6]], 0.0, 0.3, 0.15)
    assert stretched(straight, asked, stretch, 0.05, DT) is asked
    assert stretched(y, asked, None, 0.05, DT) is asked


def test_odometry_of_the_body_is_no_witness_against_a_wheel_that_steers() -> None:
    y, asked, stretch = tricycle(3)
    body = odometry(np.asarray(y / stretch))
    assert not [f for sides in judged(y, asked, stretch, (body,)).parts.values() for a in sides for f in a.findings]
    wide = cells(stretch, WIDTH)
    with_it, without = (
        view_of(cells(y, WIDTH), (body,), {WHEEL: cells(y, WIDTH)}, None, BLOCK_S, s) for s in (wide, None)
    )
    assert with_it is not None
    assert without is not None
    off = [float(np.nanmedian(np.abs(v.speed - cells(y, WIDTH)))) for v in (with_it, without)]
    assert off[0] < off[1]


def test_odometry_made_of_the_wheel_and_its_angle_is_made_of_it() -> None:
    y, _, stretch = tricycle(4)
    made = BodySpeed("odometry", cells(np.asarray(y / stretch), WIDTH), True, 1)
    assert made_of(made, [cells(y, WIDTH)], cells(stretch, WIDTH))
    assert not made_of(made, [cells(y, WIDTH)])


def test_a_drive_that_stands_for_a_time_is_the_machines_stop_before_it_is_a_fault() -> None:
    y, asked, stretch = tricycle(5)
    asked[PART] = 0.6
    y[PART] = follow(np.zeros(PART.stop - PART.start), float(y[PART.start - 1]), 0.3, 0.15)
    j = judged(y, asked, stretch)
    ((finding,),) = (sides[0].findings for sides in j.parts.values())
    assert (finding.mode, finding.side) == (FaultMode.NO_SIGNAL, Side.SENSOR_OR_ACTUATOR)
    assert finding.probability < 0.5
    assert any("only drive stood still" in e.text for e in j.events)
    y[PART.start :] = y[PART].tolist()[-1]
    asked[PART.start :] = 0.6
    ((finding,),) = (sides[0].findings for sides in judged(y, asked, stretch).parts.values())
    assert finding.probability > 0.55


def test_a_drive_that_keeps_to_its_command_is_not_called_healthy_where_the_body_goes_at_another_speed() -> None:
    """A loop around an encoder that reads too much: the reading is as asked, the machine is slower."""
    y, asked, stretch = tricycle(6)
    v = np.asarray(y / stretch)
    v[PART] *= 0.55
    states = judged(y, asked, stretch, (odometry(v),)).parts[WHEEL][0].states
    assert np.mean(states[PART] == CODE[State.HEALTHY]) < 0.2
    assert np.mean(states[: PART.start] == CODE[State.HEALTHY]) > 0.5
