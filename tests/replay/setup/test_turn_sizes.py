"""A gyro beside the turn that wheels make over the given track: told where it is none, against them, or far more; slip makes it less."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.machine.config import Machine
from replay.machine.geometry import Geometry, WheelGeometry
from replay.setup.turn_sizes import turn_size_doubt
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

DT, TRACK = 0.05, 0.6
PLACES = {"R": WheelGeometry(0.0, -TRACK / 2, 0.0, "fixed"), "L": WheelGeometry(0.0, TRACK / 2, 0.0, "fixed")}
MACHINE = Machine("m", "", ("R", "L"), Geometry(PLACES, 0.2), max_speed=1.0)


def doubt(factor: float, noise: float = 0.01) -> str:
    t, rng = np.arange(0.0, 90.0, DT), np.random.default_rng(3)
    yaw = 0.5 + 0.3 * np.sin(0.3 * t)  # always to the left
    signals = {f"wheel.{w}.v": 0.5 - p.y * yaw + rng.normal(0.0, noise, t.size) for w, p in PLACES.items()}
    signals["imu.yaw_rate"] = factor * yaw + (rng.normal(0.0, 0.005, t.size) if factor else 0.0)
    every = dict.fromkeys(signals, np.ones(t.size, np.bool_))
    return turn_size_doubt(
        Timeline(0, round(DT * 1e9), t.size, signals, every, dict.fromkeys(signals, "log"), {}), MACHINE
    )


@pytest.mark.parametrize("factor", [0.4, 0.7, 1.0, 1.3])
def test_slip_and_right_sizes_say_nothing(factor: float) -> None:
    assert doubt(factor) == ""
    assert doubt(factor, noise=0.1) == ""


def test_a_dead_gyro_one_against_the_wheels_and_another_track_are_told() -> None:
    assert "gives nothing" in doubt(0.0)
    assert "against the wheels" in doubt(-1.0)
    assert "track (it would be 0.033 m)" in doubt(18.0)
