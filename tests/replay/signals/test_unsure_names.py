"""Names that tell a wheel but leave open what they hold: named with the line to write, never taken by themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from replay.log.raw_log import Channel
from replay.machine.config import haulotte
from replay.machine.geometry import Geometry, WheelGeometry
from replay.mission import read_signals
from replay.readers.tables.columns import unit_of
from replay.signals.rules import candidates
from replay.signals.unsure_kinds import Open
from replay.signals.unsure_names import unsure

STAMPS = np.arange(3, dtype=np.int64)
TWO = replace(
    haulotte(),
    wheels=("R", "L"),
    geometry=Geometry({w: WheelGeometry(0.0, y, 0.0, "fixed") for w, y in (("R", -0.2), ("L", 0.2))}, 0.2),
)


def columns(*names: str) -> dict[str, Channel]:
    return {n: Channel(n, "", n, STAMPS, np.zeros(3), unit_of(n), "table") for n in names}


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (("vl_ref", "vl"), {"wheel.L.v_ref": "vl_ref", "wheel.L.v": "vl"}),
        (("wr_cmd", "wr"), {"wheel.R.v_ref": "wr_cmd", "wheel.R.v": "wr"}),
        (("v_left_cmd", "v_left"), {"wheel.L.v_ref": "v_left_cmd", "wheel.L.v": "v_left"}),
        (("target_left", "actual_left"), {"wheel.L.v_ref": "target_left", "wheel.L.v": "actual_left"}),
        (("left", "left_setpoint"), {"wheel.L.v": "left", "wheel.L.v_ref": "left_setpoint"}),
        (("setpoint.left", "feedback.left"), {"wheel.L.v_ref": "setpoint.left", "wheel.L.v": "feedback.left"}),
        (("right.actual", "right.target"), {"wheel.R.v": "right.actual", "wheel.R.v_ref": "right.target"}),
    ],
)
def test_pairs_and_letters_of_two_wheels(names: tuple[str, ...], found: dict[str, str]) -> None:
    some = unsure(columns(*names), TWO)
    assert {u.signal: u.origin.label for u in some} == found
    assert {u.kind for u in some} == {Open.SPEED}


@pytest.mark.parametrize(
    "names", [("linear_x", "angular_z"), ("twist.linear.x", "twist.angular.z"), ("lin_vel", "angular_vel"), ("linear [m/s]", "angular [deg/s]")]
)  # fmt: skip
def test_motions_of_the_body_that_may_be_commands_are_named(names: tuple[str, str]) -> None:
    some = unsure(columns(*names, "left_vel", "right_vel"), TWO)
    assert {u.signal: u.origin.label for u in some} == {"cmd.v": names[0], "cmd.omega": names[1]}
    assert {u.kind for u in some} == {Open.MOTION}
    beside = columns(*names, "cmd_linear_x", "cmd_angular_z")
    assert unsure(beside, TWO) == []
    assert unsure(columns("linear_acceleration_x", "angular_y", "linear_y", "x", "linear_x [m]"), TWO) == []


@pytest.mark.parametrize("pattern", ["{}_VL", "VL_{}", "Rad_VL.{}", "MAIN.fbRad_VL.{}"])
def test_pairs_of_four_wheels_in_any_order(pattern: str) -> None:
    names = [pattern.format(w) for w in ("soll", "ist")]
    assert {u.signal for u in unsure(columns(*names), haulotte())} == {"wheel.FL.v", "wheel.FL.v_ref"}


@pytest.mark.parametrize(
    "names",
    [
        ("left_actual",),
        ("left", "right"),
        ("LEFT SETPOINT",),
        ("left_arm_target", "left_arm_actual"),
        ("left_temperature_target", "left_temperature_actual"),
        ("fbDruckregler_VL.fSoll", "fbDruckregler_VL.fIst"),
        ("v_left [bar]",),
        ("left_target [V]", "left_actual [V]"),
        ("left_encoder_errors",),
        ("left_valve_position",),
        ("left_position",),
        ("count",),
    ],
)
def test_what_may_be_anything_is_not_guessed(names: tuple[str, ...]) -> None:
    assert not [u for u in unsure(columns(*names), TWO) if u.signal.endswith((".v", ".v_ref", ".v_position"))]


@pytest.mark.parametrize(
    ("name", "kind", "unit"),
    [
        ("left_wheel_position_rad", Open.POSITION, "rad"),
        ("left_wheel_position [deg]", Open.POSITION, "deg"),
        ("/joint_states/left_wheel_joint/position", Open.POSITION, "rad"),
        ("/joint_states.position[left_wheel_joint]", Open.POSITION, "rad"),
        ("position[left_wheel]", Open.POSITION, "rad"),
        ("left_ticks", Open.COUNTS, ""),
        ("EncoderLeft", Open.COUNTS, ""),
        ("enc_l", Open.COUNTS, ""),
        ("encL", Open.COUNTS, ""),
        ("left_wheel_encoder_position [counts]", Open.COUNTS, ""),
    ],
)
def test_positions_and_steps_of_encoders(name: str, kind: Open, unit: str) -> None:
    (found,) = unsure(columns(name), TWO)
    assert (found.signal, found.kind, found.origin.unit, found.origin.derivative) == ("wheel.L.v", kind, unit, True)


def test_a_position_beside_a_speed_is_a_second_view_of_it() -> None:
    names = ("/joint_states/left_wheel/position", "/joint_states/left_wheel/velocity")
    assert [u.signal for u in unsure(columns(*names), TWO)] == ["wheel.L.v_position"]


def test_a_second_sensor_is_called_like_the_first_one_but_for_a_number() -> None:
    channels = columns("FL_HubSpeedAct", "FL_HubSpeedAct2", "Front_AngleAct", "Front_AngleAct2", "w1_speed", "w2_speed")
    found = {u.signal: (u.origin.label, u.beside) for u in unsure(channels, haulotte())}
    assert found == {
        "wheel.FL.v_true": ("FL_HubSpeedAct2", "FL_HubSpeedAct"),
        "steer.front.phi_true": ("Front_AngleAct2", "Front_AngleAct"),
    }
    one = replace(haulotte(), wheels=("D",), geometry=None)
    assert [u.signal for u in unsure(columns("HubSpeedAct", "HubSpeedAct2"), one)] == ["wheel.D.v_true"]


def test_no_unsure_name_is_a_candidate() -> None:
    names = ("vl", "left_ticks", "fVentil_Soll_VL [mA]", "left_wheel_position_rad", "target_left", "actual_left")
    for machine in (TWO, haulotte()):
        assert not [*candidates(columns(*names), machine)]


def test_a_missing_signal_names_the_column_that_may_hold_it(tmp_path: Path) -> None:
    t = np.arange(0.0, 20.0, 0.05)
    table: dict[str, object] = {"time": t}
    for w in ("FR", "FL", "RR", "RL"):
        table |= {f"speed_{w} [m/s]": np.sin(t), f"fVentil_Soll_{w} [mA]": 600 * np.sin(t)}
    pd.DataFrame(table).to_csv(tmp_path / "run.csv", index=False)
    _, signals = read_signals([tmp_path / "run.csv"], haulotte())
    reason = signals.missing["wheel.FL.u"]
    assert "'fVentil_Soll_FL [mA]' is a valve's current or voltage" in reason
    assert any("leave open what they hold: fVentil_Soll_FR [mA] (wheel.FR.u)" in note for note in signals.notes)
    assert '"wheel.FL.u" = { column = "fVentil_Soll_FL [mA]", unit = "1" }' in reason
