"""From the log of a robot to a verdict: every channel, a machine file, a check, a diagnosis."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from cli.main import run
from tests.ros_robots import WHEELS, Robot, urdf, write_robot

RIGHT = tuple(n for n in WHEELS if "right" in n)


@pytest.fixture(scope="module")
def robot_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """60 s of a robot whose right wheels are mirrored and whose rear left sensor is stuck from 30 to 36 s."""
    path = tmp_path_factory.mktemp("robot") / "drive.mcap"
    stuck = ("rear_left_wheel_joint", 30.0, 36.0)
    write_robot(path, Robot(mirrored=RIGHT, description=urdf(mirrored=RIGHT), stuck=stuck))
    return path


def test_a_new_user_reaches_a_verdict(robot_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, folder = tmp_path / "machine.toml", tmp_path / "report"
    assert run(["config", "init", "--log", str(robot_log), "-o", str(file)]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "4 wheels, 7 signals" in out
    assert "Mirrored, written with a negative gain: FR, RR" in out
    assert f"mfhca diagnose {robot_log} -m {file}" in out
    assert run(["config", "check", str(file), "--log", str(robot_log)]) == 0
    capsys.readouterr()
    assert run(["diagnose", str(robot_log), "-m", str(file), "-o", str(folder), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert [(f["component"], f["side"], f["mode"]) for f in report["intervals"]] == [("RL", "sensor", "stuck")]
    assert report["intervals"][0]["start_s"] == pytest.approx(30.0, abs=1.0)
    assert report["machine"]["assumed"] == []


def test_the_file_goes_to_standard_output_alone(robot_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["config", "init", "--log", str(robot_log), "-o", "-"]) == 0
    seen = capsys.readouterr()
    assert tomllib.loads(seen.out)["machine"]["wheels"] == ["FR", "FL", "RR", "RL"]
    assert "Mirrored" in seen.err


def test_a_file_that_is_there_stays(robot_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "machine.toml"
    file.write_text("mine")
    assert run(["config", "init", "--log", str(robot_log), "-o", str(file)]) == 2
    assert file.read_text() == "mine"
    assert run(["config", "init", "--preset", "skid-4", "-o", str(file)]) == 2


def test_channels_of_a_robot_without_a_machine_file_are_those_of_its_own_wheels(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    two = {"left_wheel_joint": (0.0, 0.2), "right_wheel_joint": (0.0, -0.2)}
    write_robot(tmp_path / "two.mcap", Robot(wheels=two), 30.0)
    assert run(["channels", str(tmp_path / "two.mcap")]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "wheel.L.v" in out
    assert "steer" not in out
    assert "the wheels are those that the log names" in out
    assert run(["diagnose", str(tmp_path / "two.mcap"), "-o", str(tmp_path / "report")]) == 3
    assert "`mfhca config init --log LOG -o machine.toml` writes a machine file" in " ".join(
        capsys.readouterr().err.split()
    )


@pytest.mark.parametrize("width", ["80", "120"])
def test_all_channels_keep_their_names(
    width: str, robot_log: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", width)
    assert run(["channels", str(robot_log), "--all"]) == 0
    out = capsys.readouterr().out
    for name in WHEELS:
        assert f"velocity[{name}]" in out
    assert max(len(line) for line in out.splitlines()) <= int(width)
    assert "linear_acceleration_covariance[0…8]" in out
    assert "Could be: signals of a machine with the wheels FR, FL, RR, RL." in out


def test_all_channels_as_json(robot_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["channels", str(robot_log), "--all", "--json"]) == 0
    rows = {r["name"]: r for r in json.loads(capsys.readouterr().out)["channels"]}
    assert rows["/imu.angular_velocity.z"]["could_be"] == ["imu.yaw_rate"]
    assert rows["/imu.angular_velocity.z"]["unit"] == "rad/s"


def test_units_that_cannot_be_stop_with_the_line(
    robot_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "machine.toml"
    assert run(["config", "init", "--log", str(robot_log), "-o", str(file)]) == 0
    file.write_text(
        file.read_text()
        .replace('unit = "rad/s"', 'unit = "rev/s"')
        .replace('angular.z", unit = "rev/s"', 'angular.z", unit = "rad/s"')
    )
    capsys.readouterr()
    for words in (
        ["config", "check", str(file), "--log", str(robot_log)],
        ["diagnose", str(robot_log), "-m", str(file)],
    ):
        assert run(words) == 2
        said = " ".join(capsys.readouterr().err.split())
        assert "times max_speed" in said
        assert 'write: "wheel.FR.v" = {' in said
    assert run(["channels", str(robot_log), "-m", str(file)]) == 0
    assert "To be answered before anything is judged" in capsys.readouterr().out


def test_the_next_command_leaves_out_what_would_stop_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file of which nothing is used ends a diagnosis with code 3; the commands that were printed had it."""
    t = np.arange(1200) * 0.05
    v = np.sin(0.3 * t)
    drive, more = tmp_path / "drive.csv", tmp_path / "more.csv"
    pd.DataFrame({"time": t, "left_speed": v, "right_speed": v, "cmd_v": v}).to_csv(drive, index=False)
    pd.DataFrame({"time": t, "a": v}).to_csv(more, index=False)
    file = tmp_path / "machine.toml"
    assert run(["config", "init", "--log", str(drive), "--log", str(more), "-o", str(file)]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert f"none of its channels is used: {more}" in out
    assert f"mfhca diagnose {drive} -m {file}" in out
    assert f"mfhca config check {file} --log {drive} mfhca" in out
