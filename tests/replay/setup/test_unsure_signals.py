"""Drafts from names that leave open what they hold: taken, with a question for each kind."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from replay.setup.draft import draft_machine
from replay.setup.draft_notes import Draft
from replay.setup.machine_text import machine_text
from replay.setup.read import read_everything

N = 1200
_RNG = np.random.default_rng(1)
V, W = (np.convolve(np.repeat(_RNG.uniform(-1, 1, 30), 40), np.ones(20) / 20, "same") for _ in range(2))
RADIUS, TRACK = 0.1, 0.6
SIDES = {"left": V - TRACK / 2 * W, "right": V + TRACK / 2 * W}
COMMANDS = {"cmd_vel_x": V, "cmd_vel_yaw": W}


def turned(side: str) -> np.ndarray:
    return np.cumsum(SIDES[side]) * 0.05 / RADIUS


def drafted(tmp_path: Path, columns: Mapping[str, np.ndarray]) -> Draft:
    pd.DataFrame({"time": np.arange(N) * 0.05, **columns}).to_csv(tmp_path / "run.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "run.csv"], every=False))
    assert "QUESTION" in machine_text(draft, "run.csv")
    return draft


@pytest.mark.parametrize("names", ["target_{}/actual_{}", "v_{}_cmd/v_{}"])
def test_speeds_of_two_sides(tmp_path: Path, names: str) -> None:
    asked, measured = names.split("/")
    draft = drafted(tmp_path, {t.format(s): x for s, x in SIDES.items() for t in (asked, measured)})
    assert draft.machine.wheels == ("R", "L")
    assert draft.machine.signals["wheel.L.v_ref"].column == asked.format("left")
    assert draft.machine.signals["wheel.R.v"].column == measured.format("right")
    assert sum("are " + asked.format("left") in q and "speeds of the wheels?" in q for q in draft.questions) == 1


def test_positions_of_joints(tmp_path: Path) -> None:
    draft = drafted(tmp_path, {**COMMANDS, **{f"/joint_states/{s}_wheel/position": turned(s) for s in SIDES}})
    assert draft.machine.signals["wheel.L.v"].derivative
    assert draft.machine.wheel_radius == pytest.approx(RADIUS, rel=0.05)
    assert any("positions of the wheels in rad?" in q for q in draft.questions)


def test_motions_of_the_body_that_may_be_commands_are_asked_for_and_not_taken(tmp_path: Path) -> None:
    speeds = {f"{s}_wheel_vel": x / RADIUS for s, x in SIDES.items()}
    draft = drafted(tmp_path, {"linear_x": V, "angular_z": W, **speeds})
    assert "cmd.v" not in draft.machine.signals
    (question,) = (q for q in draft.questions if "where are the commands?" in q)
    assert '"cmd.omega" = { column = "angular_z", unit = "rad/s" }' in question


def test_steps_of_encoders_get_the_scale_that_fits_the_command(tmp_path: Path) -> None:
    steps = 500
    columns = {f"{s}_ticks": np.round(turned(s) * steps / (2 * np.pi)) for s in SIDES}
    draft = drafted(tmp_path, {**COMMANDS, **columns})
    source = draft.machine.signals["wheel.L.v"]
    assert (source.unit, source.derivative) == ("m", True)
    assert source.gain == pytest.approx(2 * np.pi * RADIUS / steps, rel=0.03)
    assert sum("in a step of its encoders" in q for q in draft.questions) == 1
    alone = drafted(tmp_path, columns)
    assert any("Nothing in the log tells it" in q and "step of its encoders" in q for q in alone.questions)


def test_second_sensors(tmp_path: Path) -> None:
    columns = {f"hub_{s}_speed{k}": x for s, x in SIDES.items() for k in ("Act", "Act2", "Ref")}
    draft = drafted(tmp_path, columns)
    assert draft.machine.signals["wheel.L.v_true"].column == "hub_left_speedAct2"
    assert any("second sensors of what" in q for q in draft.questions)


def test_commands_without_turns_tell_the_radius_by_the_mean_of_the_wheels(tmp_path: Path) -> None:
    draft = drafted(tmp_path, {"cmd_vel_x": V, **{f"{s}_wheel_speed [rad/s]": x / RADIUS for s, x in SIDES.items()}})
    assert draft.machine.wheel_radius == pytest.approx(RADIUS, rel=0.05)
    assert any("is the wheel radius 0.1 m?" in q for q in draft.questions)


@pytest.mark.parametrize("scale", [1.0, 1000.0])
def test_speeds_in_millimetres(tmp_path: Path, scale: float) -> None:
    draft = drafted(tmp_path, {"speed_cmd": scale * V, **{f"speed_{s}": 1000 * x for s, x in SIDES.items()}})
    signals = draft.machine.signals
    assert (signals["wheel.L.v"].unit, signals["cmd.v"].unit) == ("mm/s", "mm/s" if scale > 1 else "")
    assert any("in mm/s? None is stated" in q for q in draft.questions)


def test_a_command_in_turns_of_the_wheels_is_named(tmp_path: Path) -> None:
    turns = {s: x / RADIUS * 60 / (2 * np.pi) for s, x in SIDES.items()}
    draft = drafted(
        tmp_path, {"v_soll": V / RADIUS * 60 / (2 * np.pi), **{f"n_ist_{s} [1/min]": x for s, x in turns.items()}}
    )
    assert any("does v_soll command turns of the wheels (rpm)" in q for q in draft.questions)
    assert draft.machine.signals["cmd.v"].gain == pytest.approx(0.01047, rel=0.01)


def test_a_speed_that_no_machine_has_names_its_columns(tmp_path: Path) -> None:
    draft = drafted(tmp_path, {"cmd_vel_x": 50 * V, **{f"speed_{s} [m/s]": x for s, x in SIDES.items()}})
    assert any("in which unit is cmd_vel_x?" in q for q in draft.questions)


def test_encoders_with_fractions_are_distances(tmp_path: Path) -> None:
    columns = {f"{s}_enc": np.round(0.05 * turned(s), 4) for s in SIDES}
    draft = drafted(tmp_path, columns)
    assert {draft.machine.signals[f"wheel.{w}.v"].unit for w in ("R", "L")} == {"m"}
    assert any("positions of the wheels" in q for q in draft.questions)


def test_odometry_in_millimetres_has_the_unit_of_the_wheels_beside_it(tmp_path: Path) -> None:
    """It was offered mm/s in one line, and read in m/s beside wheels in mm/s."""
    speeds = {f"speed_{s}": 1000 * x for s, x in SIDES.items()} | {"odom_v": 1000 * V}
    for command in ({"speed_cmd": 1000 * V}, {"speed_cmd": V}, {}):
        signals = drafted(tmp_path, {**command, **speeds}).machine.signals
        assert {n: signals[n].unit for n in ("wheel.L.v", "wheel.R.v", "odom.v")} == dict.fromkeys(
            ("wheel.L.v", "wheel.R.v", "odom.v"), "mm/s"
        )
        assert "cmd.v" not in signals or signals["cmd.v"].unit == ("mm/s" if command["speed_cmd"].max() > 10 else "")


def test_odometry_that_states_no_unit_beside_wheels_in_millimetres(tmp_path: Path) -> None:
    speeds = {f"speed_{s} [mm/s]": 1000 * x for s, x in SIDES.items()}
    draft = drafted(tmp_path, {"speed_cmd": V, **speeds, "odom_v": 1000 * V})
    assert [draft.machine.signals[n].unit for n in ("odom.v", "cmd.v", "wheel.L.v")] == ["mm/s", "", "mm/s"]
    assert any("is odom_v in mm/s, as the wheels are?" in q for q in draft.questions)


def test_a_wheel_that_reads_a_share_has_the_unit_of_the_others(tmp_path: Path) -> None:
    speeds = {"speed_left": 1000 * SIDES["left"], "speed_right": 100 * SIDES["right"]}
    signals = drafted(tmp_path, {"speed_cmd": 1000 * V, **speeds}).machine.signals
    assert {signals[n].unit for n in ("cmd.v", "wheel.L.v", "wheel.R.v")} == {"mm/s"}


def test_odometry_in_metres_beside_wheels_in_millimetres_stays(tmp_path: Path) -> None:
    speeds = {f"speed_{s}": 1000 * x for s, x in SIDES.items()} | {"odom_v": V}
    signals = drafted(tmp_path, {"speed_cmd": V, **speeds}).machine.signals
    assert (signals["wheel.L.v"].unit, signals["odom.v"].unit) == ("mm/s", "")


def test_a_yaw_rate_in_degrees_leaves_a_command_in_radians_that_goes_with_it(tmp_path: Path) -> None:
    """Both had become deg/s: a command of .8 rad/s was read as .014."""
    turn = 0.8 * W
    wheels = {f"speed_{s}": x for s, x in SIDES.items()}
    columns = {"cmd_v": V, "cmd_omega": turn, "gyro_z": np.degrees(turn), **wheels}
    draft = drafted(tmp_path, columns)
    assert [draft.machine.signals[n].unit for n in ("cmd.omega", "imu.yaw_rate")] == ["", "deg/s"]
    assert any("is gyro_z in deg/s? None is stated" in q for q in draft.questions)
    both = drafted(tmp_path, columns | {"cmd_omega": np.degrees(turn)}).machine.signals
    assert [both[n].unit for n in ("cmd.omega", "imu.yaw_rate")] == ["deg/s", "deg/s"]
