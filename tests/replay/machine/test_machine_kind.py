"""What moves a machine, what moves, in which unit, and the operator's own advice, in machine files."""

from __future__ import annotations

from pathlib import Path

import pytest

from replay.errors import ConfigError
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, haulotte
from replay.machine.toml_file import load_machine
from replay.machine.toml_text import dump_machine
from replay.machine.units import si_factor
from replay.signals.to_si import factor_of

_ARM = """
[machine]
wheels = ["m1", "m2"]
part = "joint"
{more}
[control]
law = "none"
[signals]
"wheel.m1.v" = {{ column = "a", unit = "{unit}"{derivative} }}
"""


def load(tmp_path: Path, text: str) -> Machine:
    path = tmp_path / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return load_machine(path)


def arm(tmp_path: Path, unit: str, derivative: bool = False, more: str = "") -> Machine:
    return load(tmp_path, _ARM.format(unit=unit, more=more, derivative=", derivative = true" if derivative else ""))


@pytest.mark.parametrize(
    ("unit", "derivative", "speed_unit"),
    [
        ("rad/s", False, "rad/s"),
        ("rad", True, "rad/s"),
        ("deg", True, "deg/s"),
        ("rpm", False, "rad/s"),
        ("m", True, "m/s"),
    ],
)
def test_joints_are_kept_in_the_unit_of_their_signals(
    tmp_path: Path, unit: str, derivative: bool, speed_unit: str
) -> None:
    machine = arm(tmp_path, unit, derivative)
    assert (machine.part, machine.speed_unit, machine.drive) == ("joint", speed_unit, "auto")
    assert load(tmp_path, dump_machine(machine)) == machine


def test_a_unit_that_is_given_counts(tmp_path: Path) -> None:
    machine = arm(tmp_path, "rad/s", more='speed_unit = "deg/s"\ndrive = "motor"')
    assert (machine.speed_unit, machine.drive) == ("deg/s", "motor")
    assert factor_of("wheel.m1.v", machine.signals["wheel.m1.v"], machine) == pytest.approx(57.29578)
    assert factor_of("wheel.m2.v", SignalSource(column="b"), machine) == 1.0
    assert factor_of("wheel.m2.v", SignalSource(column="b", derivative=True), machine) == pytest.approx(1.0)
    assert load(tmp_path, dump_machine(machine)) == machine


def test_a_joint_is_no_length(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'m/s' is a speed, and the machine's speeds are in rad/s"):
        arm(tmp_path, "m/s", more='speed_unit = "rad/s"')


def test_motor_turns_of_a_joint_are_divided_by_its_gear() -> None:
    factor = si_factor("wheel.m1.v", "rpm", wheel_radius=None, gear_ratio=50.0, at="motor", speed_unit="deg/s")
    assert factor == pytest.approx(6.0 / 50.0)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('drive = "steam"', "machine.drive = 'steam' is not known; expected one of auto, valve, motor"),
        ('part = "leg"', "machine.part = 'leg' is not known; expected one of wheel, joint"),
        ('speed_unit = "knots"', "machine.speed_unit = 'knots' is not known"),
        ('part = "joint"', "for machines without \\[geometry\\]"),
    ],
)
def test_what_is_not_known_is_refused(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load(tmp_path, f"[machine]\n{line}\n")


def test_a_rotation_without_a_size_may_be_a_joint() -> None:
    with pytest.raises(ConfigError, match=r'machine\.part = "joint"'):
        si_factor("wheel.m1.v", "rad/s", wheel_radius=None, gear_ratio=1.0, at="wheel")


def test_advice_is_kept_and_its_keys_are_checked(tmp_path: Path) -> None:
    text = '[advice]\n"FR.sensor.stuck" = "Plug X12, 24 V."\n"steer.actuator" = "Call the workshop."\n'
    machine = load(tmp_path, text)
    assert machine.advice == {"FR.sensor.stuck": "Plug X12, 24 V.", "steer.actuator": "Call the workshop."}
    assert load(tmp_path, dump_machine(machine)) == machine
    assert haulotte().advice == {}
    for bad in (
        '"XX.sensor" = "a"',
        '"FR.side" = "a"',
        '"FR.sensor.tired" = "a"',
        'FR = "a"',
        '"FR.sensor" = 3',
        '"FR.sensor" = " "',
    ):
        with pytest.raises(ConfigError, match=r"\[advice\]"):
            load(tmp_path, f"[advice]\n{bad}\n")
