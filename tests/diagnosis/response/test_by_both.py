"""Which side of one of two drives fails, by the acceleration and the yaw rate of the body."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.by_both import by_both_motions
from diagnosis.response.inputs import FollowerData
from diagnosis.response.vibration import Unit
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

DT, N, TRACK = 0.05, 3000, 0.5
PART = slice(1206, 1320)


def driven(seed: int) -> tuple[Array, Array]:
    """Speeds of the left and right side [m/s], steady about the time of the fault."""
    rng = np.random.default_rng(seed)
    asked = np.repeat(rng.choice([0.0, 0.6, 1.2], N // 100), 100)
    turn = np.repeat(rng.choice([0.0, 0.4, -0.4], N // 100), 100)
    asked[1150:1500], turn[1150:1500] = 1.0, 0.0
    out = []
    for goal in (asked - turn, asked + turn):
        v = np.zeros(N)
        for k in range(1, N):
            v[k] = v[k - 1] + np.clip(goal[k] - v[k - 1], -0.06, 0.06)
        out.append(v)
    return out[0], out[1]


def moved(left: Array, right: Array, seed: int, mount: float = 0.0, yaw_lives: bool = True) -> tuple[Array, Unit]:
    """Yaw rate [rad/s] and unit, `mount` to the left of the middle [m], of a body whose sides go so."""
    rng = np.random.default_rng(seed + 9)
    rate = (right - left) / TRACK
    at = 0.5 * (left + right) - mount * rate
    slope = np.repeat(rng.uniform(-0.05, 0.05, N // 150), 150)
    a = np.gradient(at, DT) + 9.81 * np.sin(slope) + rng.normal(0.0, 0.15, N)
    yaw = rate + rng.normal(0.0, 0.01, N)
    if not yaw_lives:
        yaw[PART.start - 60 : PART.stop + 60] = 0.0
    return yaw, Unit(np.asarray(a), np.ones(N, np.bool_))


def told(left: Array, right: Array, yaw: Array | None, unit: Unit | None) -> tuple[list[Side], list[Side], Array]:
    """Sides of the findings of sensor and drive of R, which before is open, and the drive's states."""
    nothing = np.full((N, 1), np.nan)
    fresh = np.ones(N, np.bool_)
    data = {
        w: FollowerData(
            y + np.random.default_rng(k).normal(0.0, 0.005, N) * (y != 0.0),
            fresh,
            nothing,
            nothing[:, 0],
            f"wheel.{w}.v",
        )
        for k, (w, y) in enumerate((("L", left), ("R", right)))
    }
    states = np.full(N, CODE[State.NOT_ASSESSED], np.int8)
    states[PART] = CODE[State.NO_SIGNAL]
    h = (Hypothesis("sensor_or_actuator", "no_signal", 0.96), Hypothesis("none", "healthy", 0.04))
    found = Finding(
        PART.start,
        PART.stop,
        Side.SENSOR_OR_ACTUATOR,
        FaultMode.NO_SIGNAL,
        0.96,
        h,
        None,
        None,
        ("It reads 0.",),
        Tier.RESPONSE,
    )
    healthy = Assessment(np.full(N, CODE[State.HEALTHY], np.int8))
    parts = {
        "L": (healthy, healthy),
        "R": (Assessment(states, findings=(found,)), Assessment(states.copy(), findings=(found,))),
    }
    out = by_both_motions(parts, data, yaw, unit, DT)
    assert out["L"] == parts["L"]
    sensor, drive = out["R"]
    return [f.side for f in sensor.findings], [f.side for f in drive.findings], drive.states


def dead(v: Array) -> Array:
    y = v.copy()
    y[PART] = 0.0
    return y


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("mount", [0.0, 0.2])
def test_a_wheel_that_reads_nothing_while_the_body_goes_on_has_a_dead_sensor(seed: int, mount: float) -> None:
    left, right = driven(seed)
    sensor, drive, states = told(left, dead(right), *moved(left, right, seed, mount))
    assert (sensor, drive) == ([Side.SENSOR], [])
    assert set(states[PART]) == {CODE[State.MASKED]}


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("mount", [0.0, 0.25])
def test_a_wheel_that_jams_stays_open(seed: int, mount: float) -> None:
    """A unit above the other wheel, half a track to the left, does not feel it: the yaw rate does."""
    left, right = driven(seed)
    jammed = dead(right)
    assert told(left, jammed, *moved(left, jammed, seed, mount))[0] == [Side.SENSOR_OR_ACTUATOR]


@pytest.mark.parametrize("seed", range(3))
def test_one_witness_alone_proves_nothing(seed: int) -> None:
    left, right = driven(seed)
    yaw, unit = moved(left, right, seed)
    still = [Side.SENSOR_OR_ACTUATOR]
    assert told(left, dead(right), yaw, None)[0] == still
    assert told(left, dead(right), None, unit)[0] == still
    assert told(left, dead(right), yaw, Unit(np.zeros(N), np.ones(N, np.bool_)))[0] == still
    assert told(left, dead(right), np.zeros(N), unit)[0] == still


@pytest.mark.parametrize("seed", range(3))
def test_a_yaw_rate_that_fails_while_a_wheel_jams_does_not_clear_its_drive(seed: int) -> None:
    left, right = driven(seed)
    jammed = dead(right)
    assert told(left, jammed, *moved(left, jammed, seed, yaw_lives=False))[0] == [Side.SENSOR_OR_ACTUATOR]
