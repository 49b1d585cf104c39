"""Wheels of a description: places, radius, steering, and which way they count."""

from __future__ import annotations

import pytest

from replay.errors import LogError
from replay.setup.robot_description import parse_description
from replay.setup.structure import described_structure
from tests.ros_robots import BASE, RADIUS, TRACK, WHEELS, urdf

CAR = """<robot name="car"><link name="base_link"/><link name="knuckle"/><link name="wheel"/><link name="castor"/>
<joint name="front_left_steering_joint" type="revolute"><parent link="base_link"/><child link="knuckle"/>
<origin xyz="1.0 0.4 0"/><axis xyz="0 0 1"/><limit upper="0.6" lower="-0.6" effort="1" velocity="1"/></joint>
<joint name="front_left_wheel_joint" type="continuous"><parent link="knuckle"/><child link="wheel"/>
<origin xyz="0 0.1 0"/><axis xyz="0 1 0"/></joint>
<joint name="castor_wheel_joint" type="continuous"><parent link="base_link"/><child link="castor"/>
<axis xyz="0 1 0"/></joint></robot>"""


def test_wheels_stand_where_their_joints_are() -> None:
    found = parse_description(urdf(mirrored=("rear_right_wheel_joint",)))
    assert found.name == "lorry"
    assert {w.joint: w.x for w in found.wheels} == pytest.approx({n: x for n, (x, _) in WHEELS.items()})
    assert {w.joint: w.y for w in found.wheels} == pytest.approx({n: y for n, (_, y) in WHEELS.items()})
    assert {w.radius for w in found.wheels} == {RADIUS}
    assert [w.joint for w in found.wheels if w.mirrored] == ["rear_right_wheel_joint"]


def test_wheels_are_named_by_their_places_whatever_their_joints_are_called() -> None:
    names = dict(zip(("joint_a", "joint_b", "joint_c", "joint_d"), WHEELS.values(), strict=True))
    structure = described_structure(parse_description(urdf(names)), [])
    assert structure is not None
    assert structure.wheels == ("FR", "FL", "RR", "RL")
    assert structure.joints["FL"].joint == "joint_a"
    assert structure.places is not None
    assert (structure.places["RR"].x, structure.places["RR"].y) == (-BASE / 2, -TRACK / 2)


def test_german_names_stay() -> None:
    names = dict(zip(("rad_vl", "rad_vr", "rad_hl", "rad_hr"), WHEELS.values(), strict=True))
    structure = described_structure(parse_description(urdf(names)), [])
    assert structure is not None
    assert structure.wheels == ("VR", "VL", "HR", "HL")


def test_a_steered_wheel_knows_its_joint_and_castors_are_no_drives() -> None:
    found = parse_description(CAR)
    (wheel,) = found.wheels
    assert (wheel.steering, wheel.x, wheel.y, round(wheel.offset, 9)) == ("front_left_steering_joint", 1.0, 0.4, 0.1)
    assert (wheel.radius, found.max_steer) == (None, 0.6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot>", "is not XML that can be read"),
        ('<!DOCTYPE x [<!ENTITY a "b">]><robot/>', "declares XML entities"),
        ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:wheel/></robot>', "xacro that was not expanded"),
    ],
)
def test_what_cannot_be_read_says_why(text: str, words: str) -> None:
    with pytest.raises(LogError, match=words):
        parse_description(text)
