"""Logs of ordinary ROS robots: /joint_states, /cmd_vel, /imu and /robot_description in an MCAP file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
START_NS = 1_700_000_000_000_000_000
STEP_NS = 50_000_000
RADIUS, TRACK, BASE = 0.165, 0.56, 0.52

WHEELS = {
    "front_left_wheel_joint": (BASE / 2, TRACK / 2),
    "front_right_wheel_joint": (BASE / 2, -TRACK / 2),
    "rear_left_wheel_joint": (-BASE / 2, TRACK / 2),
    "rear_right_wheel_joint": (-BASE / 2, -TRACK / 2),
}


@dataclass(frozen=True)
class Robot:
    """A robot with fixed wheels and what of it is recorded.

    Attributes
    ----------
    wheels : Mapping[str, tuple[float, float]]
        Place of each wheel joint [m].
    mirrored : tuple[str, ...]
        Joints that count backwards.
    description : str
        Text of /robot_description; empty: not recorded.
    commands, imu : bool
        Whether /cmd_vel and /imu are recorded.
    stuck : tuple[str, float, float] or None
        A joint whose sensor is stuck, from and to [s].
    turns : float
        Commanded yaw rate by the one that is made of it [1].
    scale : float
        Recorded speeds by rad/s [1].
    positions : bool
        Whether positions of the joints are recorded.
    command_topic : str
        Where the commands are recorded.
    """

    wheels: Mapping[str, tuple[float, float]] = field(default_factory=lambda: WHEELS)
    mirrored: tuple[str, ...] = ()
    description: str = ""
    commands: bool = True
    imu: bool = True
    stuck: tuple[str, float, float] | None = None
    turns: float = 1.0
    scale: float = 1.0
    positions: bool = False
    command_topic: str = "/cmd_vel"


def urdf(wheels: Mapping[str, tuple[float, float]] = WHEELS, mirrored: tuple[str, ...] = ()) -> str:
    """Description as xacro writes it out: footprint, base, wheels turned about x so that they roll about z of their own."""
    parts = ['<?xml version="1.0"?><!-- expanded by xacro --><robot name="lorry">']
    parts += ['<link name="base_footprint"/><link name="base_link"/><link name="imu_link"/>']
    parts.append(_joint("base_joint", "fixed", "base_footprint", "base_link", (0.0, 0.0, RADIUS)))
    parts.append(_joint("imu_joint", "fixed", "base_link", "imu_link", (0.1, 0.0, 0.2)))
    for name, (x, y) in wheels.items():
        link = name.replace("_joint", "_link")
        body = f'<geometry><cylinder radius="{RADIUS}" length="0.1"/></geometry>'
        parts.append(f'<link name="{link}"><visual>{body}</visual><collision>{body}</collision></link>')
        axis = (0.0, 0.0, 1.0 if name in mirrored else -1.0)
        parts.append(_joint(name, "continuous", "base_link", link, (x, y, 0.0), (np.pi / 2, 0.0, 0.0), axis))
    return "".join([*parts, "</robot>"])


def _joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    xyz: tuple[float, float, float],
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0),
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0),
) -> str:
    place, turn, along = (" ".join(f"{v:g}" for v in triple) for triple in (xyz, rpy, axis))
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}" rpy="{turn}"/><axis xyz="{along}"/></joint>'
    )


def write_robot(path: Path, robot: Robot, seconds: float = 60.0, seed: int = 3) -> None:
    """Write a drive with turns and reversals; wheels follow their commands with a lag of 0.2 s and some noise."""
    rng = np.random.default_rng(seed)
    count = round(seconds * 1e9 / STEP_NS)
    block = round(3e9 / STEP_NS)
    v = np.repeat(rng.uniform(-0.6, 1.0, -(-count // block)), block)[:count]
    omega = np.repeat(rng.uniform(-0.8, 0.8, -(-count // block)), block)[:count]
    v[: block // 2] = omega[: block // 2] = 0.0
    speeds = {}
    for name, (_, y) in robot.wheels.items():
        wheel = _lagged((v - omega * y) / RADIUS, 0.2) + rng.normal(0.0, 0.02, count)
        if robot.stuck is not None and robot.stuck[0] == name:
            first, last = (round(t * 1e9 / STEP_NS) for t in robot.stuck[1:])
            wheel[first:last] = wheel[first]
        speeds[name] = -wheel if name in robot.mirrored else wheel
    angles = {name: np.cumsum(speed) * STEP_NS * 1e-9 for name, speed in speeds.items()}
    with path.open("wb") as file:
        writer = _Topics(file)
        if robot.description:
            writer.write("/robot_description", "std_msgs/msg/String", START_NS, data=robot.description)
        for k in range(count):
            at = START_NS + k * STEP_NS
            if robot.commands:
                turn = robot.turns * omega[k]
                writer.write(
                    robot.command_topic, "geometry_msgs/msg/Twist", at, linear=(v[k], 0, 0), angular=(0, 0, turn)
                )
            values = np.array([robot.scale * s[k] for s in speeds.values()])
            rolled = np.array([a[k] for a in angles.values()]) if robot.positions else np.empty(0)
            writer.joints("/joint_states", at, list(speeds), values, rolled)
            if robot.imu:
                writer.imu("/imu", at, omega[k] + rng.normal(0.0, 0.01))
        writer.close()


def _lagged(x: NDArray[np.float64], lag_s: float) -> NDArray[np.float64]:
    out, state, a = np.empty(x.size), 0.0, 1 - np.exp(-STEP_NS * 1e-9 / lag_s)
    for k, value in enumerate(x.tolist()):
        state += a * (value - state)
        out[k] = state
    return out


class _Topics:
    """Messages of ROS types into an MCAP file."""

    def __init__(self, file: Any) -> None:
        self.writer = Writer(file, compression=CompressionType.NONE)
        self.writer.start()
        self.channels: dict[str, int] = {}

    def send(self, topic: str, kind: str, at: int, message: Any) -> None:
        if topic not in self.channels:
            text = STORE.generate_msgdef(kind, ros_version=2)[0].encode()
            schema = self.writer.register_schema(kind, "ros2msg", text)
            self.channels[topic] = self.writer.register_channel(topic, "cdr", schema)
        data = bytes(STORE.serialize_cdr(message, kind))
        self.writer.add_message(self.channels[topic], at, data, at)

    def write(self, topic: str, kind: str, at: int, **values: Any) -> None:
        vector = STORE.types["geometry_msgs/msg/Vector3"]
        made = {k: vector(*map(float, x)) if isinstance(x, tuple) else x for k, x in values.items()}
        self.send(topic, kind, at, STORE.types[kind](**made))

    def joints(
        self, topic: str, at: int, names: list[str], values: NDArray[np.float64], rolled: NDArray[np.float64]
    ) -> None:
        kind = "sensor_msgs/msg/JointState"
        made = STORE.types[kind](self.header(at), names, rolled, values, np.empty(0))
        self.send(topic, kind, at, made)

    def imu(self, topic: str, at: int, yaw_rate: float) -> None:
        kind, zeros = "sensor_msgs/msg/Imu", np.zeros(9)
        vector, turn = STORE.types["geometry_msgs/msg/Vector3"], STORE.types["geometry_msgs/msg/Quaternion"]
        made = STORE.types[kind](
            self.header(at),
            turn(0.0, 0.0, 0.0, 1.0),
            zeros,
            vector(0.0, 0.0, yaw_rate),
            zeros,
            vector(0.0, 0.0, 9.81),
            zeros,
        )
        self.send(topic, kind, at, made)

    def header(self, at: int) -> Any:
        stamp = STORE.types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9)
        return STORE.types["std_msgs/msg/Header"](stamp, "base_link")

    def close(self) -> None:
        self.writer.finish()
