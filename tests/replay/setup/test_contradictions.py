"""Signals that contradict each other: turns against their command, speeds in another unit than the positions of their joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replay.machine.toml_file import load_machine
from replay.mission import read_signals
from replay.setup.draft import draft_machine
from replay.setup.draft_notes import Draft
from replay.setup.machine_text import machine_text
from replay.setup.read import read_everything
from tests.ros_robots import RADIUS, TRACK, WHEELS, Robot, urdf, write_robot

RPM = 60 / (2 * np.pi)


def drafted(tmp_path: Path, robot: Robot) -> Draft:
    write_robot(tmp_path / "run.mcap", robot, 30.0)
    return draft_machine(read_everything([tmp_path / "run.mcap"], every=False))


@pytest.mark.parametrize("imu", [True, False])
def test_a_command_that_turns_the_other_way_is_turned_round_and_asked(tmp_path: Path, imu: bool) -> None:
    draft = drafted(tmp_path, Robot(turns=-1.0, imu=imu))
    assert draft.machine.signals["cmd.omega"].gain == -1.0
    (asked,) = [q for q in draft.questions if "cmd.omega" in q]
    assert ("so does the measured yaw rate" in asked) is imu
    assert draft.machine.geometry is not None
    assert 2 * draft.machine.geometry.wheels["FL"].y == pytest.approx(TRACK, rel=0.05)


def test_wheels_that_turn_against_command_and_yaw_rate_may_be_exchanged(tmp_path: Path) -> None:
    exchanged = {name: (x, -y) for name, (x, y) in WHEELS.items()}
    draft = drafted(tmp_path, Robot(wheels=exchanged))
    assert draft.machine.signals["cmd.omega"].gain == 1.0
    assert any("are left and right exchanged?" in q for q in draft.questions)


def test_turns_as_they_should_be_are_not_asked(tmp_path: Path) -> None:
    assert not [q for q in drafted(tmp_path, Robot()).questions if "cmd.omega" in q or "exchanged" in q]


def test_speeds_in_turns_per_minute_are_told_by_the_positions_of_their_joints(tmp_path: Path) -> None:
    draft = drafted(tmp_path, Robot(scale=RPM, positions=True, description=urdf()))
    assert {s.unit for n, s in draft.machine.signals.items() if n.endswith(".v") and n.startswith("wheel")} == {"rpm"}
    assert draft.machine.max_speed < 3.0
    assert any("rpm is written" in q for q in draft.questions)


def test_a_scale_of_no_unit_is_asked_and_nothing_is_written(tmp_path: Path) -> None:
    draft = drafted(tmp_path, Robot(scale=3.0, positions=True, description=urdf()))
    assert {s.unit for n, s in draft.machine.signals.items() if n.endswith(".v") and n.startswith("wheel")} == {"rad/s"}
    assert any("read 3 × the slope" in q and "give the unit" in q for q in draft.questions)
    assert not [q for q in drafted(tmp_path, Robot(positions=True, description=urdf())).questions if "v_position" in q]


def test_speeds_that_no_machine_has_are_asked_and_the_check_of_the_file_stops_at_them(tmp_path: Path) -> None:
    draft = drafted(tmp_path, Robot(scale=60 * RPM, commands=False))
    assert any("in which unit are /joint_states" in q and "as none does" in q for q in draft.questions)
    file = tmp_path / "machine.toml"
    file.write_text(machine_text(draft, "run"), encoding="utf-8")
    machine = load_machine(file)
    assert machine.max_speed == 10.0
    assert RADIUS * 60 * RPM > 30.0
    _, signals = read_signals([tmp_path / "run.mcap"], machine)
    assert any("check its unit" in q for q in signals.questions)
