"""Commands of cars: a speed and a steering angle instead of a yaw rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from replay.log.raw_log import Channel, LogSummary, RawLog
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.geometry import Geometry, WheelGeometry, own_axle
from replay.signals.mapping import map_signals

KIND = "ackermann_msgs/msg/AckermannDriveStamped"


def car(front: str = "own") -> Machine:
    steer = {w: own_axle(w) if front == "own" else front for w in ("FR", "FL")}
    places = {w: WheelGeometry(0.6, y, 0.0, steer[w]) for w, y in (("FR", -0.3), ("FL", 0.3))}
    places |= {w: WheelGeometry(-0.6, y, 0.0, "fixed") for w, y in (("RR", -0.3), ("RL", 0.3))}
    return Machine("car", "", tuple(places), Geometry(places, 0.3))


def commands(speed: list[float], angle: list[float]) -> RawLog:
    stamps = np.arange(len(speed), dtype=np.int64) * 50_000_000
    channels = {
        f"/ackermann_cmd.{field}": Channel(
            f"/ackermann_cmd.{field}", "/ackermann_cmd", field, stamps, np.array(values), None, KIND
        )
        for field, values in (("drive.speed", speed), ("drive.steering_angle", angle))
    }
    return RawLog("run.mcap", "mcap", "header", channels, LogSummary("run.mcap", "mcap", 0, 0, ()))


def test_a_steering_angle_asks_for_a_yaw_rate_by_the_wheelbase() -> None:
    found = map_signals([commands([0.0, 1.0, -1.0], [0.4, 0.4, 0.4])], car()).items
    np.testing.assert_allclose(found["cmd.omega"].values, np.array([0.0, 1.0, -1.0]) * np.tan(0.4) / 1.2)


def test_a_steered_axle_has_its_angle_beside_it() -> None:
    found = map_signals([commands([1.0], [0.4])], car("front")).items
    assert found["steer.front.phi_ref"].values[0] == 0.4
    np.testing.assert_allclose(found["cmd.omega"].values, np.tan(0.4) / 1.2)


def test_the_machine_file_may_say_so_in_any_unit_of_angles() -> None:
    given = SignalSource(topic="/ackermann_cmd", field="drive.steering_angle", unit="deg", gain=-1.0)
    machine = replace(car(), signals={"cmd.omega": given})
    found = map_signals([commands([1.0], [20.0])], machine).items
    np.testing.assert_allclose(found["cmd.omega"].values, -np.tan(np.radians(20.0)) / 1.2)


def test_without_unsteered_wheels_it_says_what_is_missing() -> None:
    given = SignalSource(topic="/ackermann_cmd", field="drive.steering_angle", unit="rad")
    places = {w: WheelGeometry(0.0, y, 0.0, "fixed") for w, y in (("R", -0.3), ("L", 0.3))}
    machine = Machine("robot", "", ("R", "L"), Geometry(places, 0.3), signals={"cmd.omega": given})
    found = map_signals([commands([1.0], [0.4])], machine)
    assert "cmd.omega" not in found.items
    assert "is a steering angle" in found.missing["cmd.omega"]
