"""Odometry and commands by columns: a drive as a whole, and tables that are called like their topic."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from replay.errors import LogError
from replay.setup.draft import draft_machine
from replay.setup.draft_notes import Draft
from replay.setup.read import read_everything
from tests.replay.setup.test_unsure_signals import N, V, W

T = np.arange(N) * 0.05
DELTA = 0.3 * W


def tables(tmp_path: Path, files: dict[str, dict[str, np.ndarray]]) -> Draft:
    paths = []
    for name, columns in files.items():
        paths.append(tmp_path / name)
        pd.DataFrame({"time": T, **columns}).to_csv(paths[-1], index=False)
    return draft_machine(read_everything(paths, every=False))


@pytest.mark.parametrize("name", ["odom_linear_x", "odometry_speed", "speed_odom", "odom_v [m/s]"])
def test_odometry_by_a_column_is_a_drive_as_a_whole(tmp_path: Path, name: str) -> None:
    """Such a table was refused: "there is no odometry"."""
    signals = tables(tmp_path, {"run.csv": {"cmd_vel_linear_x": V, name: V, "imu_wz": W}}).machine.signals
    assert signals["wheel.D.v"].column == name
    assert signals["wheel.D.v_ref"].column == "cmd_vel_linear_x"
    assert "odom.v" not in signals


@pytest.mark.parametrize("name", ["odom_x", "odom_angular_z", "odom_linear_y", "odom_v_error"])
def test_what_is_no_forward_speed_by_odometry_is_no_drive(tmp_path: Path, name: str) -> None:
    with pytest.raises(LogError, match="there is no odometry"):
        tables(tmp_path, {"run.csv": {"cmd_vel_linear_x": V, name: V}})


def test_a_car_of_one_table_a_topic(tmp_path: Path) -> None:
    """Speed, steering and odometry as short columns of files that say what they are."""
    place = {"x": np.cumsum(V) * 0.05, "y": np.cumsum(W) * 0.05}
    draft = tables(
        tmp_path,
        {
            "commandData.csv": {"V": V, "delta": DELTA},
            "coreData.csv": {"RPM": -8000 * V},
            "imuData.csv": {"wz": 60.0 * W},
            "odomData.csv": {"vx": V, "vy": 0.0 * V, **place},
        },
    )
    signals = draft.machine.signals
    assert (signals["steer.front.phi_ref"].column, signals["steer.front.phi_ref"].unit) == ("delta", "rad")
    assert [(signals[n].column, signals[n].source) for n in ("odom.v", "odom.x", "odom.y")] == [
        (c, "odomData.csv") for c in ("vx", "x", "y")
    ]
    assert signals["imu.yaw_rate"].unit == "deg/s"
    assert len([q for q in draft.questions if "wz" in q]) == 1
    assert not draft.idle


def test_an_odometry_file_without_a_second_axis_has_no_place(tmp_path: Path) -> None:
    signals = tables(
        tmp_path, {"wheels.csv": {"left_speed": V, "right_speed": V}, "odom.csv": {"x": V, "vy": W}}
    ).machine.signals
    assert not [n for n in signals if n.startswith("odom")]


def test_a_file_of_which_nothing_is_used_is_named(tmp_path: Path) -> None:
    draft = tables(tmp_path, {"wheels.csv": {"left_speed": V, "right_speed": V, "cmd_v": V}, "more.csv": {"a": V}})
    assert [Path(name).name for name in draft.idle] == ["more.csv"]
