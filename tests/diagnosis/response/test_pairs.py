"""Two wheels of one side that differ, without any command: which of them it is."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, TRACK, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)


def judged(measured: dict[str, Array], yaw: Array | None) -> Judgement:
    """Of speeds alone."""
    nothing = {w: np.full(y.size, np.nan) for w, y in measured.items()}
    body = np.full((next(iter(measured.values())).size, 2), np.nan)
    return assess_response(followers_of(measured, nothing, body), geometry(), yaw, LIMITS, DT)


def found(j: Judgement) -> dict[str, Finding]:
    return {w: f for w, sides in j.parts.items() for f in sides[0].findings}


def yaw_of(measured: dict[str, Array], seed: int) -> Array:
    """A gyro."""
    apart = 0.5 * (measured["FR"] + measured["RR"] - measured["FL"] - measured["RL"]) / TRACK
    return apart + np.random.default_rng(seed).normal(0.0, 0.02, apart.size)


def busy(v: Array, seconds: float) -> slice:
    """The stretch of that length in which a wheel moves most."""
    size = round(seconds / DT)
    moved = np.convolve(np.abs(v[200:-200]), np.ones(size), mode="valid")
    start = 200 + int(np.argmax(moved))
    return slice(start, start + size)


@pytest.mark.parametrize("gyro", [False, True])
@pytest.mark.parametrize(("wheel", "gain", "seed"), [("RR", 1.57, 3), ("FL", 1.57, 4), ("RL", 0.6, 5), ("FR", 1.9, 6)])
def test_a_speed_that_is_scaled_for_a_while(wheel: str, gain: float, seed: int, gyro: bool) -> None:
    measured, *_ = speeds(seed)
    yaw = yaw_of(measured, seed) if gyro else None
    part = busy(measured[wheel], 15.0)
    measured[wheel][part] *= gain
    told = found(judged(measured, yaw))
    assert list(told) == [wheel]
    f = told[wheel]
    assert f.mode is (FaultMode.INEFFICIENT if gain < 1.0 else FaultMode.OUTSIDE_TABLE)
    assert abs(f.start - part.start) * DT < 2.0
    assert f.epsilon is not None
    assert f.epsilon.value == pytest.approx(1.0 - gain, abs=0.1)
    assert Side.SENSOR in f.side.sides


def test_what_comes_slowly_is_as_likely_the_one_as_the_other() -> None:
    """Nothing leaps and there is no gyro."""
    measured, *_ = speeds(3)
    size = measured["RR"].size
    gain = np.interp(np.arange(size) * DT, [40.0, 50.0, 90.0, 100.0], [1.0, 1.6, 1.6, 1.0])
    measured["RR"] *= gain
    for f in found(judged(measured, None)).values():
        assert f.probability <= 0.7


@pytest.mark.parametrize("gyro", [False, True])
def test_healthy_speeds_alone(gyro: bool) -> None:
    for seed in range(20, 24):
        measured, *_ = speeds(seed)
        assert found(judged(measured, yaw_of(measured, seed) if gyro else None)) == {}
