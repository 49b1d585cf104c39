"""The path: logged, integrated, or why there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from diagnosis.report.driven_path import driven_path
from diagnosis.report.path_picture import path_picture

STEP = 0.01
N = 1000  # 10 s
ONE = np.ones(N)
GEOMETRY = {
    w: {"x": 1.0 if w[0] == "F" else -1.0, "y": 0.7 if w[1] == "L" else -0.7, "axle": a}
    for w, a in (("FL", "front"), ("FR", "front"), ("RL", "rear"), ("RR", "rear"))
}
MACHINE: dict[str, Any] = {"wheels": list(GEOMETRY), "axles": ["front", "rear"], "geometry": GEOMETRY}
SPEEDS = {f"wheel.{w}.v": 0.5 * ONE for w in GEOMETRY}


def report(**changes: Any) -> dict[str, Any]:
    return {"machine": MACHINE, "intervals": [], "log": {}, **changes}


def test_logged_positions_come_first() -> None:
    logged = {"path.x": ONE, "path.y": ONE, "gnss.lat": ONE, **SPEEDS}
    path = driven_path(report(), logged, STEP)
    assert path.x is logged["path.x"]
    assert path.words == "from GNSS, in metres"
    assert driven_path(report(), {**logged, "odom.x": ONE}, STEP).words == "from odometry, in metres"


def test_what_was_left_out_is_told() -> None:
    note = "Odometry stands still where GNSS shows 35 m of way, and is not used."
    columns = {"odom.x": 0.0 * ONE, "odom.y": 0.0 * ONE, **SPEEDS, "cmd.omega": 0.1 * ONE}
    left = report(log={"path_note": note})
    assert driven_path(left, columns, STEP).words.endswith(f"no position was used. {note}")
    assert note in driven_path(left, SPEEDS, STEP).words
    columns |= {"path.x": ONE, "path.y": ONE, "gnss.lat": ONE}
    assert driven_path(left, columns, STEP).words == f"from GNSS, in metres. {note}"


@pytest.mark.parametrize(
    ("turning", "words"),
    [
        ({"imu.yaw_rate": 0.1 * ONE}, "the measured yaw rate"),
        ({"steer.front.phi": np.arctan(0.2) * ONE, "steer.rear.phi": -np.arctan(0.2) * ONE}, "steering angles"),
        ({"cmd.omega": 0.1 * ONE}, "the commanded yaw rate"),
    ],
)
def test_integrated_circle(turning: dict[str, Any], words: str) -> None:
    path = driven_path(report(), {**SPEEDS, **turning}, STEP)
    assert words in path.words
    assert "drifts" in path.words
    assert path.x is not None
    assert path.y is not None
    # 0.5 m/s at 0.1 rad/s: a circle with a radius of 5 m, after 1 rad
    assert path.x[-1] == pytest.approx(5 * np.sin(1), abs=0.02)
    assert path.y[-1] == pytest.approx(5 * (1 - np.cos(1)), abs=0.02)


def test_a_stuck_sensor_does_not_move_the_machine() -> None:
    stuck = {"component": "FL", "side": "sensor", "mode": "stuck", "start_s": 0.0, "stop_s": 10.0}
    speeds = {"wheel.FL.v": 5.0 * ONE, "wheel.FR.v": 0.5 * ONE, "cmd.omega": 0.0 * ONE}
    path = driven_path(report(intervals=[stuck]), speeds, STEP)
    assert path.x is not None
    assert path.x[-1] == pytest.approx(5.0)


def test_what_cannot_be_drawn_says_why() -> None:
    for columns, words in (({}, "nor a wheel's speed"), (SPEEDS, "Neither a yaw rate nor steering angles")):
        path = driven_path(report(), columns, STEP)
        assert path.x is None
        assert words in path.words


def test_start_and_end_are_marked() -> None:
    t = np.linspace(0, 10, N)
    picture = str(path_picture(t, np.sin(t), 0.0, STEP, []))
    assert ">start<" in picture
    assert ">end<" in picture
    round_trip = str(path_picture(np.sin(0.628 * t), np.cos(0.628 * t), 0.0, STEP, []))
    assert ">start, end<" in round_trip


def test_speed_is_the_median_of_what_is_there() -> None:
    one, two, four = 1.0 * ONE, 2.0 * ONE, 4.0 * ONE
    two[500:] = np.nan
    four[800:] = np.nan
    one[900:] = np.nan
    columns = {"wheel.FL.v": one, "wheel.FR.v": two, "wheel.RL.v": four, "cmd.omega": 0.0 * ONE}
    path = driven_path(report(), columns, STEP)
    assert path.x is not None
    # 5 s at 2, 3 s at the mean of 1 and 4, 1 s at 1 m/s, then nothing is known
    assert path.x[-1] == pytest.approx(5 * 2 + 3 * 2.5 + 1)
