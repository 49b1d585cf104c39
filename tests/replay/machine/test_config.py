"""Machines: the paper's one by default, any number of wheels, and values checked by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from replay.errors import ConfigError
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import Control, Limits, Machine, Plant, WheelPlant, haulotte
from replay.machine.geometry import Geometry, WheelGeometry, four_wheel_geometry


def mapped(openings: tuple[float, ...], speeds: tuple[float, ...], unseen: tuple[float, ...] = ()) -> WheelPlant:
    return WheelPlant(2.4, 0.2, openings=openings, speeds=speeds, unseen=unseen)


def test_papers_machine() -> None:
    machine = haulotte()
    assert machine.geometry is not None
    assert machine.wheels == ("FR", "FL", "RR", "RL")
    assert machine.wheel_radius == pytest.approx(0.427)
    assert machine.axles == ("front", "rear")
    assert machine.geometry.wheels["FR"] == WheelGeometry(1.05, -0.73, -0.20, "front")
    assert machine.geometry.wheels["RL"] == WheelGeometry(-1.05, 0.73, 0.20, "rear")
    assert (machine.gear_ratio, machine.max_speed) == (17.7, 0.36)
    assert machine.max_steer == pytest.approx(0.785398, abs=1e-6)
    control = machine.control
    assert (control.lambda_, control.xi, control.beta, control.k_ps) == (1.0, 1.0, 0.001, 1.0)
    # 63 l/min over 100 cm³ per motor turn
    assert machine.plant.flow == pytest.approx(63e-3 / 60 / 100e-6 / 17.7 * 3.141592653589793 * 0.854, rel=0.002)


def test_axle_places() -> None:
    geometry = four_wheel_geometry(2.0, 1.0, 0.8, 0.1)
    assert (geometry.axle_x("front"), geometry.axle_x("rear")) == (1.0, -1.0)
    mixed = Geometry(
        {
            "A": WheelGeometry(1.0, 0.0, 0.0, "A_steer"),
            "B": WheelGeometry(0.0, 0.5, 0.0, "fixed"),
            "C": WheelGeometry(-1.0, 0.5, 0.0, "rear"),
            "D": WheelGeometry(-2.0, -0.5, 0.0, "rear"),
        },
        0.5,
    )
    assert mixed.axles == ("A_steer", "rear")
    assert mixed.axle_x("rear") == -1.5


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Control(lambda_=0.0), ["control.lambda", "0", "s/m", "1e-06", "10000"]),
        (lambda: Control(xi=-1.0), ["control.xi", "-1", "1/s", "0 to 1000"]),
        (lambda: Control(beta=2000.0), ["control.beta", "2000", "1/s"]),
        (lambda: Control(zeta=-5.0), ["control.zeta", "-5", "s/m^2"]),
        (lambda: Control(k_ps=0.0), ["control.k_ps", "0", "1/rad"]),
        (lambda: Control(u_max=0.0), ["control.u_max", "0", "full opening"]),
        (lambda: Control(phi_dot_hz=0.001), ["control.phi_dot_hz", "0.001", "Hz"]),
        (lambda: Control(law="pid"), ["control.law", "pid", "signed", "auto"]),  # type: ignore[arg-type]
        (lambda: Control(psi="frozen"), ["control.psi", "frozen", "implied"]),  # type: ignore[arg-type]
        (lambda: Control(phi_dot="x"), ["control.phi_dot", "'x'", "measured"]),  # type: ignore[arg-type]
        (lambda: WheelPlant(K=0.0, tau=0.2), ["plant.K", "0", "m/s per full opening"]),
        (lambda: WheelPlant(K=2.4, tau=90.0), ["plant.tau", "90", "s", "60"]),
        (lambda: WheelPlant(2.4, 0.2, hysteresis=1.5), ["plant.hysteresis", "1.5", "full opening", "0 to 1"]),
        (lambda: WheelPlant(2.4, 0.2, grip=-1.0), ["plant.grip", "-1"]),
        (lambda: WheelPlant(2.4, 0.2, wander=-0.1), ["plant.wander", "-0.1", "m/s/√s"]),
        (lambda: mapped((0.0, 1.0), (0.0,)), ["plant.openings, speeds and unseen", "2, 1 and 0", "as many"]),
        (lambda: mapped((0.0, 1.0), ()), ["plant.openings, speeds and unseen", "2, 0 and 0"]),
        (lambda: mapped((0.0, 1.0), (0.0, 2.0), (0.0,)), ["plant.openings, speeds and unseen", "2, 2 and 1"]),
        (lambda: mapped((), (), (0.0, 1.0)), ["plant.openings, speeds and unseen", "0, 0 and 2"]),
        (lambda: mapped((0.5,), (1.0,)), ["plant.openings", "one value", "two"]),
        (lambda: mapped((0.0, 0.5, 0.5), (0.0, 1.0, 1.2)), ["plant.openings must rise"]),
        (lambda: mapped((0.5, 0.0), (0.0, 1.0)), ["plant.openings must rise"]),
        (lambda: mapped((0.0, 0.5, 1.0), (0.0, 1.0, 0.9)), ["plant.speeds must not fall"]),
        (lambda: Plant(coupling="glue"), ["plant.coupling", "glue", "free"]),  # type: ignore[arg-type]
        (lambda: Plant(flow=0.0), ["plant.flow", "0", "m/s"]),
        (lambda: Limits(brief=-1.0), ["limits.brief", "-1", "s", "3600"]),
        (lambda: Limits(min_probability=0.4), ["limits.min_probability", "0.4", "0.5"]),
        (lambda: Limits(min_epsilon=1.5), ["limits.min_epsilon", "1.5", "0 to 1"]),
        (lambda: Limits(min_sat=-0.1), ["limits.min_sat", "-0.1"]),
        (lambda: Limits(min_assessed=-2.0), ["limits.min_assessed", "-2", "s"]),
        (lambda: Limits(driving_speed=-0.2), ["limits.driving_speed", "-0.2", "m/s"]),
        (lambda: SourceOptions(time_unit="h"), ["time_unit", "'h'", "ms"]),
        (lambda: SourceOptions(stamp="wall"), ["stamp", "wall", "header"]),  # type: ignore[arg-type]
        (lambda: four_wheel_geometry(2.1, 1.46, 0.0, 0.2), ["geometry.wheel_diameter", "0", "m", "0.02"]),
        (lambda: four_wheel_geometry(99.0, 1.46, 0.8, 0.2), ["geometry.wheelbase", "99", "m", "0.05 to 40"]),
        (lambda: four_wheel_geometry(2.1, 1.46, 0.8, 3.0), ["geometry.FR.offset", "-3", "m"]),
        (lambda: replace(haulotte(), gear_ratio=0.0), ["geometry.gear_ratio", "0"]),
        (lambda: replace(haulotte(), max_speed=-1.0), ["geometry.max_speed", "-1", "m/s"]),
        (lambda: replace(haulotte(), max_steer=4.0), ["geometry.max_steer", "4", "rad", "3.2"]),
        (lambda: replace(haulotte(), wheels=()), ["machine.wheels", "[]"]),
        (lambda: replace(haulotte(), wheels=("A", "A"), geometry=None), ["machine.wheels", "A"]),
        (lambda: replace(haulotte(), wheels=("A", "B")), ["geometry", "FR", "machine.wheels", "'A'"]),
    ],
)
def test_value_out_of_range_is_named(build: Any, words: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        build()
    assert [w for w in words if w not in str(caught.value)] == []


def test_degrees_where_radians_are_meant_get_the_line_to_write() -> None:
    with pytest.raises(ConfigError) as caught:
        replace(haulotte(), max_steer=45.0)
    assert "45 looks like degrees: write max_steer = 0.7854 in [geometry]" in str(caught.value)


def test_not_a_number_is_out_of_range() -> None:
    with pytest.raises(ConfigError, match=r"control\.lambda"):
        Control(lambda_=float("nan"))


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        ("wheel.XX.v", ["wheel.XX.v", "'XX'", "FR"]),
        ("steer.middle.phi", ["steer.middle.phi", "'middle'", "front"]),
        ("wheel.FR.torque", ["wheel.FR.torque", "not a known signal"]),
    ],
)
def test_signals_name_parts_of_the_machine(signal: str, words: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        replace(haulotte(), signals={signal: SignalSource(column="c", unit="m/s")})
    assert [w for w in words if w not in str(caught.value)] == []


def test_canonical_signals_follow_wheels_and_axles() -> None:
    names = haulotte().canonical_signals()
    assert len(names) == len(set(names)) == 3 + 4 * 10 + 2 * 5 + 9
    assert {"cmd.v", "wheel.RL.pressure_b", "steer.rear.phi_true", "odom.yaw"} <= set(names)
    rig = Machine(name="rig", id="", wheels=("M1",), geometry=None)
    assert rig.axles == ()
    assert rig.wheel_radius is None
    assert [n for n in rig.canonical_signals() if n.startswith("steer.")] == []


def test_geometry_takes_the_order_of_the_wheels() -> None:
    geometry = haulotte().geometry
    machine = replace(haulotte(), wheels=("RL", "RR", "FL", "FR"))
    assert machine.geometry is not None
    assert geometry is not None
    assert tuple(machine.geometry.wheels) == ("RL", "RR", "FL", "FR")
    assert machine.geometry.wheels == geometry.wheels


def test_label_of_a_signal_source() -> None:
    assert SignalSource(topic="/cmd_vel", field="linear.x").label == "/cmd_vel.linear.x"
    assert SignalSource(symbol="MAIN.v").label == "MAIN.v"
    assert SignalSource(column="Speed").label == "Speed"


def test_a_map_may_be_flat_and_known_throughout() -> None:
    plant = mapped((-1.0, -0.03, 0.03, 1.0), (-2.0, 0.0, 0.0, 1.8))
    assert plant.unseen == ()
    assert mapped((0.0, 1.0), (0.0, 0.0), (0.0, 0.5)).unseen == (0.0, 0.5)
