"""Which way the speed of an odometry is."""

from __future__ import annotations

from pathlib import PurePath

import numpy as np
import pytest

from replay.log.raw_log import Channel
from replay.machine.config import Machine
from replay.setup.draft_notes import Draft
from replay.setup.given import ask_about_odometry, odometry
from replay.setup.odometry_frame import along_the_ground
from replay.setup.structure import ONE, Structure

T = np.arange(2000) * 0.02
STAMPS = (T * 1e9).astype(np.int64)


def odometry_of(topic: str, *, ground: bool, turn: float = 0.15) -> dict[str, Channel]:
    """A machine that drives at 0.3 to 0.5 m/s, and turns."""
    v = 0.4 + 0.1 * np.sin(0.7 * T)
    yaw = turn * T
    x, y = (np.cumsum(v * f(yaw)) * 0.02 for f in (np.cos, np.sin))
    rng = np.random.default_rng(1)
    fields = {
        "twist.twist.linear.x": (v * np.cos(yaw) if ground else v) + rng.normal(0.0, 0.01, v.size),
        "pose.pose.position.x": x,
        "pose.pose.position.y": y,
        "pose.pose.orientation.x": 0.0 * T,
        "pose.pose.orientation.y": 0.0 * T,
        "pose.pose.orientation.z": np.sin(yaw / 2),
        "pose.pose.orientation.w": np.cos(yaw / 2),
    }
    return {
        f"{topic}.{n}": Channel(f"{topic}.{n}", topic, n, STAMPS, x, None, "nav_msgs/Odometry")
        for n, x in fields.items()
    }


def speed(channels: dict[str, Channel], topic: str) -> Channel:
    return channels[f"{topic}.twist.twist.linear.x"]


@pytest.mark.parametrize("ground", [True, False])
def test_the_way_of_a_speed_is_seen_where_the_machine_turns(ground: bool) -> None:
    channels = odometry_of("/o", ground=ground)
    assert along_the_ground(speed(channels, "/o"), channels) is ground
    ahead = odometry_of("/o", ground=ground, turn=0.0)
    assert not along_the_ground(speed(ahead, "/o"), ahead)


def test_without_an_orientation_nothing_is_said() -> None:
    channels = {n: c for n, c in odometry_of("/o", ground=True).items() if "orientation" not in n}
    assert not along_the_ground(speed(channels, "/o"), channels)


def test_of_two_the_one_along_the_machine_is_the_drive() -> None:
    channels = odometry_of("/sim", ground=True) | odometry_of("/base_controller/odom", ground=False)
    found = odometry(channels)
    assert found is not None
    assert PurePath(found.topic).name == "odom"
    alike = odometry(odometry_of("/sim", ground=False) | odometry_of("/base_controller/odom", ground=False))
    assert alike is not None
    assert alike.topic == "/sim"


def test_an_only_one_along_the_ground_is_asked_about() -> None:
    structure = Structure(ONE, None, how="odometry")
    for ground, asked in ((True, 1), (False, 0)):
        draft = Draft(Machine("m", "", ONE, None))
        ask_about_odometry(structure, odometry_of("/sim", ground=ground), draft)
        assert len(draft.questions) == asked
