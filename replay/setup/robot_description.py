"""Wheels of a robot from its description (URDF): where they are, how large, what steers them, and which way they count."""

from __future__ import annotations

import re
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.signals.name_parts import is_drive, is_steering

Array = NDArray[np.float64]

_ACROSS = 0.7  # share of a wheel's axis that must lie across the robot, and of a steering axis that must stand upright
_DEEPEST = 64


@dataclass(frozen=True)
class WheelJoint:
    """One drive wheel.

    Attributes
    ----------
    joint : str
        Name of its joint, as in ``/joint_states``.
    x, y : float
        Place of the wheel, of a steered one that of its steering joint [m]; x forward, y left, from ``base_link``.
    offset : float
        From the steering joint to the wheel, positive to the left [m].
    mirrored : bool
        Whether its joint counts backwards when the robot drives forwards.
    radius : float or None
        Of its cylinder or sphere [m]; None where the description has none.
    steering : str
        Name of the joint that steers it; empty for a fixed wheel.
    """

    joint: str
    x: float
    y: float
    offset: float
    mirrored: bool
    radius: float | None
    steering: str


@dataclass(frozen=True)
class RobotDescription:
    """What a description says of the drive; `max_steer` is the largest limit of the steering joints [rad]."""

    name: str
    wheels: tuple[WheelJoint, ...]
    max_steer: float | None


@dataclass(frozen=True)
class _Joint:
    name: str
    kind: str
    parent: str
    child: str
    place: Array
    turn: Array
    axis: Array
    limit: float | None


def parse_description(text: str) -> RobotDescription:
    """Read a URDF, also one that xacro has expanded.

    Parameters
    ----------
    text : str
        XML.

    Raises
    ------
    LogError
        Where it is no XML, or xacro that was not expanded.
    """
    if "<!ENTITY" in text:
        raise LogError("robot_description declares XML entities, which a robot's description has no use for")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise LogError(f"robot_description is not XML that can be read ({error})") from error
    if any(str(tag.tag).startswith("{http://www.ros.org/wiki/xacro}") for tag in root.iter()):
        raise LogError("robot_description is xacro that was not expanded; record what `xacro FILE` prints")
    joints = {j.child: j for tag in root.iter("joint") if (j := _joint(tag)) is not None}
    links = {link.get("name", ""): link for link in root.iter("link")}
    steered, wheels = [], []
    for joint in joints.values():
        if joint.kind not in ("continuous", "revolute") or not _is_wheel(joint, links):
            continue
        chain = _chain(joint, joints)
        place, turn = _pose(chain)
        axis = turn @ joint.axis
        if abs(axis[1]) < _ACROSS:
            continue
        steer = next((j for j in reversed(chain[:-1]) if _upright(j, chain)), None)
        at = place if steer is None else _pose(chain[: chain.index(steer) + 1])[0]
        if steer is not None:
            steered.append(steer)
        offset = float(place[1] - at[1])
        wheels.append(
            WheelJoint(
                joint.name, float(at[0]), float(at[1]), 0.0 if steer is None else offset, bool(axis[1] < 0),
                _radius(links.get(joint.child)), "" if steer is None else steer.name,
            )
        )  # fmt: skip
    limits = [j.limit for j in steered if j.limit]
    return RobotDescription(root.get("name", ""), tuple(wheels), max(limits, default=None))


def _joint(tag: ElementTree.Element) -> _Joint | None:
    parent, child = tag.find("parent"), tag.find("child")
    if parent is None or child is None:
        return None
    origin, axis, limit = tag.find("origin"), tag.find("axis"), tag.find("limit")
    place = _three(None if origin is None else origin.get("xyz"), (0.0, 0.0, 0.0))
    turn = _rotation(_three(None if origin is None else origin.get("rpy"), (0.0, 0.0, 0.0)))
    along = _three(None if axis is None else axis.get("xyz"), (1.0, 0.0, 0.0))
    along = along / max(float(np.linalg.norm(along)), 1e-9)
    upper = None if limit is None else _number(limit.get("upper"))
    names = (tag.get("name", ""), tag.get("type", ""), parent.get("link", ""), child.get("link", ""))
    return _Joint(*names, place, turn, along, upper)


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def _three(text: str | None, default: tuple[float, float, float]) -> Array:
    parts = [p for p in map(_number, (text or "").split()) if p is not None]
    return np.array(parts if len(parts) == 3 else default)


def _rotation(rpy: Array) -> Array:
    """Rotation about the fixed axes x, y, z, in this order."""
    (a, b, c), (s, t, u) = np.cos(rpy), np.sin(rpy)
    x = np.array([[1, 0, 0], [0, a, -s], [0, s, a]])
    y = np.array([[b, 0, t], [0, 1, 0], [-t, 0, b]])
    z = np.array([[c, -u, 0], [u, c, 0], [0, 0, 1]])
    return np.asarray(z @ y @ x)


def _chain(joint: _Joint, joints: dict[str, _Joint]) -> list[_Joint]:
    """Joints from ``base_link``, or else the root, to a joint."""
    chain = [joint]
    while chain[0].parent in joints and chain[0].parent != "base_link" and len(chain) < _DEEPEST:
        chain.insert(0, joints[chain[0].parent])
    return chain


def _pose(chain: list[_Joint]) -> tuple[Array, Array]:
    place, turn = np.zeros(3), np.eye(3)
    for joint in chain:
        place = place + turn @ joint.place
        turn = turn @ joint.turn
    return place, turn


def _upright(joint: _Joint, chain: list[_Joint]) -> bool:
    turn = _pose(chain[: chain.index(joint) + 1])[1]
    return joint.kind in ("continuous", "revolute") and abs((turn @ joint.axis)[2]) > _ACROSS


def _is_wheel(joint: _Joint, links: dict[str, ElementTree.Element]) -> bool:
    """Whether names say so, or a continuous joint carries something round."""
    words = f"{joint.name} {joint.child}".lower()
    if re.search(r"cast[eo]r|roller", words) or (is_steering(joint.name) and is_steering(joint.child)):
        return False
    if is_drive(joint.name) or is_drive(joint.child):
        return True
    return joint.kind == "continuous" and _radius(links.get(joint.child)) is not None


def _radius(link: ElementTree.Element | None) -> float | None:
    """Radius of a link's cylinder or sphere [m], of its collision body first."""
    if link is None:
        return None
    for part in ("collision", "visual"):
        for shape in ("cylinder", "sphere"):
            for tag in link.findall(f"{part}/geometry/{shape}"):
                radius = _number(tag.get("radius"))
                if radius is not None and radius > 0:
                    return radius
    return None
