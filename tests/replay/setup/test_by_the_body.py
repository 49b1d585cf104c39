"""Wheel radius and track by odometry and by the yaw rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.log.source_options import SignalSource
from replay.machine.geometry import WheelGeometry
from replay.setup.by_the_body import base_by_yaw, radius_by_body, track_by_yaw
from replay.signals.signal import Signal, Signals

Array = NDArray[np.float64]

RADIUS, TRACK = 0.17, 0.6
PLACES = {"R": WheelGeometry(0.0, -0.25, 0.0, "fixed"), "L": WheelGeometry(0.0, 0.25, 0.0, "fixed")}
START_NS = 1_700_000_000 * 10**9


def signal(name: str, step_s: float, values: Array, late_s: float = 0.0) -> Signal:
    stamps = START_NS + np.round((np.arange(values.size) * step_s + late_s) * 1e9).astype(np.int64)
    return Signal(name, stamps, values, SignalSource(topic="/t", field=name, unit="rad/s"), "log", guessed=True)


def robot(rng: np.random.Generator, speed: str = "odom.v") -> Signals:
    """Two wheels at 50 Hz, the body's speed at 20 Hz and 0.2 s late, its yaw rate at 100 Hz; a wheel skids for a tenth of the time."""
    t = np.arange(0.0, 60.0, 0.01)
    v, yaw = 0.8 * np.sin(0.3 * t) + 0.2, 0.7 * np.sin(0.5 * t)
    left, right = (v - yaw * TRACK / 2) / RADIUS, (v + yaw * TRACK / 2) / RADIUS
    left[2000:2600] *= 1.6
    body = np.abs(v) if speed == "gnss.speed" else v
    items = [
        signal("wheel.L.v", 0.02, left[::2] + rng.normal(0.0, 0.05, t.size // 2)),
        signal("wheel.R.v", 0.02, right[::2] + rng.normal(0.0, 0.05, t.size // 2)),
        signal(speed, 0.05, body[::5] + rng.normal(0.0, 0.02, t.size // 5), 0.2),
        signal("imu.yaw_rate", 0.01, yaw + rng.normal(0.0, 0.01, t.size)),
    ]
    return Signals({s.name: s for s in items}, {}, ())


def test_a_speed_over_ground_may_have_a_sign() -> None:
    found = robot(np.random.default_rng(3))
    named = {"gnss.speed" if n == "odom.v" else n: s for n, s in found.items.items()}
    radar = Signals(named, {}, ())
    radius = radius_by_body(radar, ("R", "L"), ("R", "L"), {})
    assert radius is not None
    assert radius.length == pytest.approx(RADIUS, rel=0.02)


@pytest.mark.parametrize(("speed", "by"), [("odom.v", "odometry"), ("gnss.speed", "the speed over ground")])
def test_radius_and_track_are_measured(speed: str, by: str) -> None:
    found = robot(np.random.default_rng(3), speed)
    radius = radius_by_body(found, ("R", "L"), ("R", "L"), {})
    assert radius is not None
    assert (radius.by, radius.length) == (by, pytest.approx(RADIUS, rel=0.02))
    track = track_by_yaw(found, PLACES, RADIUS, {})
    assert track is not None
    assert track.length == pytest.approx(TRACK, rel=0.03)


@pytest.mark.parametrize(("noise", "told"), [(0.0, True), (0.1, False)])
def test_a_few_seconds_tell_the_radius_where_odometry_is_made_of_the_wheels(noise: float, told: bool) -> None:
    t = np.arange(0.0, 6.0, 0.1)
    turns = np.where(t > 1.0, 3.0 + np.sin(t), 0.0)
    body = RADIUS * turns + noise * np.random.default_rng(1).normal(size=t.size)
    items = [signal("wheel.L.v", 0.1, turns), signal("wheel.R.v", 0.1, turns), signal("odom.v", 0.1, body)]
    found = radius_by_body(Signals({s.name: s for s in items}, {}, ()), ("R", "L"), ("R", "L"), {})
    assert (found is not None) == told
    if found is not None:
        assert found.length == pytest.approx(RADIUS)


def test_wheels_that_count_backwards_are_turned_round() -> None:
    found = robot(np.random.default_rng(4))
    left = found.items["wheel.L.v"]
    back = Signals({**found.items, "wheel.L.v": signal("wheel.L.v", 0.02, -left.values)}, {}, ())
    origins = {"wheel.L.v": SignalSource(topic="/t", field="wheel.L.v", unit="rad/s", gain=-1.0)}
    radius = radius_by_body(back, ("R", "L"), ("R", "L"), origins)
    assert radius is not None
    assert radius.length == pytest.approx(RADIUS, rel=0.02)
    assert radius_by_body(back, ("R", "L"), ("R", "L"), {}) is None


def test_a_speed_that_is_no_share_of_the_wheels_tells_nothing() -> None:
    rng = np.random.default_rng(5)
    found = robot(rng)
    other = Signals({**found.items, "odom.v": signal("odom.v", 0.05, rng.normal(0.0, 1.0, 1200))}, {}, ())
    assert radius_by_body(other, ("R", "L"), ("R", "L"), {}) is None
    assert track_by_yaw(Signals({"wheel.L.v": found.items["wheel.L.v"]}, {}, ()), PLACES, RADIUS, {}) is None


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_steering_command_tells_the_wheelbase_by_the_yaw_rate(sign: float) -> None:
    """The command was made a yaw rate with a base that stands in; a negative length says that it is positive to the right."""
    found = robot(np.random.default_rng(6))
    yaw, base, stands_in = found.items["imu.yaw_rate"], 1.3, 0.5
    asked = signal("cmd.omega", 0.05, sign * yaw.values[::5] * base / stands_in)
    angle = replace(asked, origin=replace(asked.origin, unit="rad"))
    measured = base_by_yaw(Signals({**found.items, "cmd.omega": angle}, {}, ()), stands_in)
    assert measured is not None
    assert measured.length == pytest.approx(sign * base, rel=0.03)
    assert base_by_yaw(Signals({**found.items, "cmd.omega": asked}, {}, ()), stands_in) is None
