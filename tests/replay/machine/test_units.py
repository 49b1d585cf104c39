"""Recorded units become SI, and a unit that does not fit is refused by name."""

from __future__ import annotations

import math
from typing import Any

import pytest

from replay.errors import ConfigError
from replay.machine.config import haulotte
from replay.machine.quantities import UNITS
from replay.machine.signal_table import quantity_of
from replay.machine.units import si_factor

WHEEL = {"wheel_radius": 0.427, "gear_ratio": 17.7}


def factor(signal: str, unit: str, **changed: Any) -> float:
    return si_factor(signal, unit, **({"at": "wheel"} | WHEEL | changed))


@pytest.mark.parametrize(
    ("signal", "unit", "expected"),
    [
        ("cmd.v", "m/s", 1.0),
        ("cmd.v", "km/h", 1 / 3.6),
        ("cmd.v", "kph", 1 / 3.6),
        ("gnss.speed", "cm/s", 0.01),
        ("wheel.FR.v", "mm/s", 0.001),
        ("cmd.omega", "deg/s", math.pi / 180),
        ("imu.yaw_rate", "°/s", math.pi / 180),
        ("imu.yaw_rate", "rev/s", 2 * math.pi),
        ("imu.acceleration", "m/s²", 1.0),
        ("imu.acceleration", "g", 9.80665),
        ("steer.front.phi", "deg", math.pi / 180),
        ("steer.rear.phi_true", " ° ", math.pi / 180),
        ("wheel.FR.u", "%", 0.01),
        ("steer.front.u_applied", "percent", 0.01),
        ("wheel.FR.psi", "1", 1.0),
        ("wheel.FR.pressure_a", "bar", 1e5),
        ("wheel.FR.pressure_b", "MPa", 1e6),
        ("odom.x", "mm", 0.001),
        ("odom.yaw", "deg", math.pi / 180),
        ("gnss.lat", "deg", 1.0),
        # a rotation of the wheel, r = 0.427 m
        ("wheel.FR.v", "rad/s", 0.427),
        ("wheel.FR.v_ref", "rpm", 2 * math.pi / 60 * 0.427),
        # as German and French programs write it
        ("wheel.FR.v", "U/min", 2 * math.pi / 60 * 0.427),
        ("wheel.FR.v", "tr/min", 2 * math.pi / 60 * 0.427),
        ("wheel.FR.v", "min^-1", 2 * math.pi / 60 * 0.427),
        ("wheel.FR.v", "RPM", 2 * math.pi / 60 * 0.427),
        ("wheel.FR.v", "Umdr./min", 2 * math.pi / 60 * 0.427),
        ("cmd.v", "km/std", 1 / 3.6),
        ("cmd.v", "KM/H", 1 / 3.6),
        ("imu.yaw_rate", "Grad/s", math.pi / 180),
        ("steer.front.phi", "degrés", math.pi / 180),
        ("steer.front.phi", "Grd", math.pi / 180),
        ("wheel.FR.u", "Prozent", 0.01),
        ("wheel.FR.u", "Proz.", 0.01),
        ("wheel.FR.u", "[%]", 0.01),
        ("wheel.FR.effort", "mA", 1e-3),
    ],
)
def test_factor_to_si(signal: str, unit: str, expected: float) -> None:
    assert factor(signal, unit) == pytest.approx(expected, rel=1e-12)


def test_motor_turns_of_the_papers_machine() -> None:
    # 1 motor rpm = 0.0025263 m/s; 0.36 m/s = 142.5 motor rpm
    one = factor("wheel.RL.v_true", "1/min", at="motor")
    assert one == pytest.approx(0.0025263, abs=5e-8)
    assert 0.36 / one == pytest.approx(142.5, abs=0.05)


def test_position_whose_derivative_is_the_signal() -> None:
    assert factor("wheel.FR.v", "mm", derivative=True) == pytest.approx(0.001)
    assert factor("wheel.FR.v", "rad", derivative=True) == pytest.approx(0.427)
    assert factor("imu.yaw_rate", "deg", derivative=True) == pytest.approx(math.pi / 180)


@pytest.mark.parametrize(
    ("signal", "unit", "words"),
    [
        ("wheel.FR.v", "furlong", ["wheel.FR.v", "furlong", "m/s", "rpm"]),
        ("wheel.FR.v", "rad", ["wheel.FR.v", "rad", "angle", "speed", "km/h"]),
        ("cmd.v", "rpm", ["cmd.v", "rotation", "expected a speed"]),
        ("wheel.FR.u", "bar", ["wheel.FR.u", "pressure", "fraction", "%"]),
        ("gnss.lon", "rad", ["gnss.lon", "rad", "deg"]),
        ("steer.front.phi", "m", ["steer.front.phi", "length", "angle"]),
        ("cmd.v", "m", ["cmd.v", "length", "speed"]),
    ],
)
def test_unfitting_unit_is_named(signal: str, unit: str, words: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        factor(signal, unit)
    assert [w for w in words if w not in str(caught.value)] == []


def test_rotation_needs_the_wheels_size() -> None:
    with pytest.raises(ConfigError, match=r"wheel\.FR\.v.*geometry\.wheel_diameter \[m\]"):
        factor("wheel.FR.v", "rad/s", wheel_radius=None)
    assert factor("wheel.FR.v", "m/s", wheel_radius=None) == 1.0


@pytest.mark.parametrize("name", ["cmd.speed", "wheel.FR.velocity", "steer.front.v", "v", "", "gnss.alt", "imu.v"])
def test_unknown_signal_is_named(name: str) -> None:
    with pytest.raises(ConfigError, match="not a known signal") as caught:
        quantity_of(name)
    assert repr(name) in str(caught.value)


def test_every_signal_of_a_machine_has_a_quantity_and_a_unit() -> None:
    for signal in haulotte().canonical_signals():
        quantity_of(signal)
        assert any(_fits(signal, unit) for unit in UNITS), signal


def _fits(signal: str, unit: str) -> bool:
    try:
        return factor(signal, unit) > 0
    except ConfigError:
        return False


@pytest.mark.parametrize(
    ("unit", "scale"), [("V", "gain = 0.1"), ("mA", "gain = 0.0625, offset = -0.25"), ("A", "1 / the")]
)
@pytest.mark.parametrize("signal", ["wheel.FR.u", "wheel.FR.u_applied", "steer.front.u_applied"])
def test_volts_and_amperes_are_no_opening_and_the_line_to_write_is_said(signal: str, unit: str, scale: str) -> None:
    with pytest.raises(ConfigError) as refused:
        si_factor(signal, unit, wheel_radius=0.4, gear_ratio=1.0, at="wheel")
    assert 'unit = "1"' in str(refused.value)
    assert scale in str(refused.value)
