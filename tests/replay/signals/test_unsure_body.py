"""Names of a letter or two, and such as their values and neighbours tell: taken where they are sure, else asked for, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from replay.log.raw_log import Channel
from replay.machine.config import Machine
from replay.machine.geometry import Geometry, WheelGeometry
from replay.signals.rules import candidates
from replay.signals.unsure_kinds import Open
from replay.signals.unsure_names import unsure
from tests.replay.setup.test_unsure_signals import COMMANDS, V, drafted

PLACES = {
    w: WheelGeometry(x, y, 0.0, "fixed" if x else "rear")
    for w, x, y in (("FR", 2.0, -0.6), ("FL", 2.0, 0.6), ("RR", 0.0, -0.6), ("RL", 0.0, 0.6))
}
TRUCK = Machine("truck", "", tuple(PLACES), Geometry(PLACES, 0.6))
T = np.arange(400)
SPEED, PART, ANGLE = 2.0 * np.sin(0.02 * T), 0.7 * np.sin(0.02 * T), 0.3 * np.sin(0.02 * T)


def columns(values: Mapping[str, np.ndarray], topic: str = "") -> dict[str, Channel]:
    stamps = np.arange(T.size, dtype=np.int64) * 10_000_000
    return {
        name: Channel(f"{topic}.{name}" if topic else name, topic, name if topic else "", stamps, x)
        for name, x in values.items()
    }


def sure(name: str, x: np.ndarray = SPEED) -> list[str]:
    return [c.signal for c in candidates(columns({name: x}), TRUCK)]


def asked(values: Mapping[str, np.ndarray], topic: str = "") -> dict[str, tuple[str, Open, str]]:
    return {u.origin.label: (u.signal, u.kind, u.origin.unit) for u in unsure(columns(values, topic), TRUCK)}


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("vset_FL", "wheel.FL.v_ref"),
        ("vsoll_FL", "wheel.FL.v_ref"),
        ("vist_FL", "wheel.FL.v"),
        ("nref_FL", "wheel.FL.v_ref"),
        ("uset_FL", "wheel.FL.u"),
        ("u_act_FL", "wheel.FL.u_applied"),
        ("phiset_rear", "steer.rear.phi_ref"),
        ("vset", "cmd.v"),
        ("wset", "cmd.omega"),
        ("yawrate", "imu.yaw_rate"),
        ("Latitude", "gnss.lat"),
        ("Längengrad", "gnss.lon"),
        ("WheelSpd_Frnt_Lft", "wheel.FL.v"),
    ],
)
def test_sure(name: str, signal: str) -> None:
    assert sure(name) == [signal]


@pytest.mark.parametrize(
    "name",
    [
        *("RelativeSpeedFrontAxleLeftWheel", "RelSpdFrontAxleLeftWheel", "speed_diff_FL", "SteeringWheelAngle"),
        *("StrWhlAng", "Lenkradwinkel", "latitude_std", "visit_FL", "preset_FL", "lateral_error", "gyro"),
    ],
)
def test_not_sure(name: str) -> None:
    assert sure(name) == []


@pytest.mark.parametrize(
    ("name", "x", "said"),
    [
        ("gyro", ANGLE, ("imu.yaw_rate", Open.YAW_RATE, "")),
        ("imu_gz [deg/s]", ANGLE, ("imu.yaw_rate", Open.YAW_RATE, "deg/s")),
        ("wz", ANGLE, ("imu.yaw_rate", Open.YAW_RATE, "")),
        ("delta_rear", ANGLE, ("steer.rear.phi", Open.ANGLE, "rad")),
        ("steer_pos_rear", 60.0 * ANGLE, ("steer.rear.phi", Open.ANGLE, "deg")),
        ("steer_demand_rear", ANGLE, ("steer.rear.phi_ref", Open.ANGLE, "rad")),
        ("SteeringWheelAngle", 900.0 * ANGLE, ("steer.rear.phi", Open.DRIVERS, "deg")),
        ("u_steer_rear", PART, ("steer.rear.u", Open.OPENING, "1")),
        ("ua_FL", PART, ("wheel.FL.u", Open.OPENING, "1")),
        ("opening_FL", 100.0 * PART, ("wheel.FL.u_applied", Open.OPENING, "%")),
    ],
)
def test_asked_for(name: str, x: np.ndarray, said: tuple[str, Open, str]) -> None:
    assert asked({name: x}) == {name: said}


@pytest.mark.parametrize(
    "name", ["gyro_x", "gyro_temp", "us_FL", "time_us", "pos_FL", "lat", "lateral_acc", "position"]
)
def test_neither(name: str) -> None:
    assert sure(name, PART) == []
    assert asked({name: PART}) == {}


def test_the_drivers_wheel_is_told_in_messages_too() -> None:
    found = asked({"steering_wheel_angle": 8.0 * ANGLE}, "/vehicle/report")
    assert [kind for _, kind, _ in found.values()] == [Open.DRIVERS]


def test_two_columns_are_a_place_and_one_is_not() -> None:
    lat, lon = 61.45 + 1e-6 * T, 23.85 + 1e-6 * T
    found = asked({"lat": lat, "lon": lon})
    assert [found[n][:2] for n in ("lat", "lon")] == [("gnss.lat", Open.PLACE), ("gnss.lon", Open.PLACE)]
    assert asked({"lat": lat, "lon": 1e3 * lon}) == {}  # metres


def test_a_position_goes_as_its_command_or_is_something_else() -> None:
    assert asked({"u_FL": PART, "pos_FL": 0.9 * PART})["pos_FL"][0] == "wheel.FL.u_applied"
    assert "pos_FL" not in asked({"u_FL": PART, "pos_FL": 0.9 * np.cos(0.02 * T)})
    assert "pos_FL" not in asked({"u_FL": PART, "pos_FL": 40.0 * PART + 900.0})


def test_steering_valves_are_those_of_an_axle_whose_angle_is_there() -> None:
    found = asked({"phi_rear": ANGLE, "us_rear": PART, "spos_rear": PART})
    assert {n: s for n, (s, *_) in found.items()} == {"us_rear": "steer.rear.u", "spos_rear": "steer.rear.u_applied"}
    assert asked({"us_rear": PART}) == {}


def test_of_two_speeds_the_numbered_one_is_a_second_sensor() -> None:
    found = asked({"v2_FL": SPEED, "v_FL": SPEED})
    assert found["v_FL"][:2] == ("wheel.FL.v", Open.SPEED)
    assert found["v2_FL"][:2] == ("wheel.FL.v_true", Open.SECOND)


def test_a_draft_takes_them_with_a_question_and_leaves_the_drivers_wheel(tmp_path: Path) -> None:
    speeds = {f"{w}_speed_mps": V for w in ("FR", "FL", "RR", "RL")}
    more = {"gyro": 0.1 * V, "SteeringWheelAngle": 9.0 * V, "rear_angle_rad": 0.2 * V}
    draft = drafted(tmp_path, {**COMMANDS, **speeds, **more})
    assert draft.machine.signals["imu.yaw_rate"].column == "gyro"
    assert any(q.startswith("is gyro the yaw rate of the machine, in rad/s?") for q in draft.questions)
    assert all(s.column != "SteeringWheelAngle" for s in draft.machine.signals.values())


@pytest.mark.parametrize(("name", "size", "unit"), [("cmd_{}", 1.0, "1"), ("ctrl_{}", 100.0, "%"), ("y_{}", 1.0, "1")])
def test_what_a_wheel_is_told_beside_commanded_speeds_may_be_an_opening(name: str, size: float, unit: str) -> None:
    wheels = {name.format(w): size * PART for w in PLACES}
    speeds = {f"v_ref_{w}": SPEED for w in PLACES} | {f"speed_{w}": SPEED for w in PLACES}
    found = asked(wheels | speeds)
    assert {found[n] for n in wheels} == {(f"wheel.{w}.u", Open.OPENING, unit) for w in PLACES}
    assert not wheels.keys() & asked(wheels | {f"speed_{w}": SPEED for w in PLACES}).keys()  # a speed may be asked so
    assert not wheels.keys() & asked({n: 400.0 * size * x for n, x in wheels.items()} | speeds).keys()


@pytest.mark.parametrize(
    ("name", "unit"), [("SOG", ""), ("gps_sog", ""), ("sog_kn", "kn"), ("SOG [kn]", "kn"), ("sog_kmh", "km/h")]
)
def test_a_speed_over_ground_is_asked_for(name: str, unit: str) -> None:
    assert asked({name: np.abs(SPEED)}) == {name: ("gnss.speed", Open.GROUND, unit)}
    assert "gnss.speed" not in sure(name)
    assert asked({name: SPEED, "gps_speed": SPEED}) == {}


@pytest.mark.parametrize("name", ["command_delta", "delta", "cmd_delta [rad]", "deltaRef", "steer.delta_cmd"])
def test_a_cars_steering_by_its_letter_is_a_command(name: str) -> None:
    assert asked({name: ANGLE, "wz": ANGLE})[name] == ("steer.rear.phi_ref", Open.ANGLE, "rad")


def test_of_two_letters_the_one_that_asks_is_the_command() -> None:
    said = asked({"delta": ANGLE, "delta_cmd": ANGLE})
    assert [said[n][0] for n in ("delta", "delta_cmd")] == ["steer.rear.phi", "steer.rear.phi_ref"]


@pytest.mark.parametrize(
    ("name", "x"),
    [
        ("delta_t", ANGLE),
        ("delta_v_cmd", ANGLE),
        ("cmd_delta_time", ANGLE),
        ("delta_x", ANGLE),
        ("delta_pos", ANGLE),
        ("delta", np.abs(ANGLE)),
        ("delta", 5.0 * ANGLE + 1.0),
        ("delta [m]", ANGLE),
        ("delta [s]", ANGLE),
        ("command_delta", 40.0 * ANGLE),
    ],
)
def test_a_difference_of_something_is_no_steering(name: str, x: np.ndarray) -> None:
    assert not any(said[0].startswith("steer.") for said in asked({name: x}).values())


def test_a_letter_beside_a_steering_angle_may_be_anything() -> None:
    assert "delta" not in asked({"delta": ANGLE, "steering_angle": ANGLE})
