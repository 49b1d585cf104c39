"""What a robot records: joint states, commands, inertial unit, odometry and description, as MCAP or rosbag2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from .faults import Fault, of_the_body, published
from .habits import USUAL, Habits
from .machines import STEERED, Course, H, Robot
from .physics import Driven

Array = NDArray[np.float64]

STORE = get_typestore(Stores.ROS2_HUMBLE)
_START = 1_700_000_000.0
_NONE = np.zeros(0)


def write_log(
    path: Path,
    robot: Robot,
    course: Course,
    driven: Driven,
    fault: Fault | None,
    rng: np.random.Generator,
    habits: Habits = USUAL,
) -> None:
    """Write a mission: an MCAP file, or a folder of rosbag2 where `path` has no ending."""
    rows = [
        *_joints(robot, driven, fault, rng, habits),
        *habits.sent(_commands(robot, course, rng)),
        *_inertia(course, driven, fault, rng),
        *_odometry(robot, driven, fault, rng),
    ]
    rows = habits.stamped([r for r in rows if r[1] not in habits.without])
    if robot.described:
        rows.append(
            (0.0, "/robot_description", "std_msgs/msg/String", STORE.types["std_msgs/msg/String"](_urdf(robot)))
        )
    rows.sort(key=lambda r: r[0])
    kinds = {topic: kind for _, topic, kind, _ in rows}
    if path.suffix == ".mcap":
        with path.open("wb") as file:
            writer = Writer(file, compression=CompressionType.NONE)
            writer.start()
            ids = {}
            for topic, kind in kinds.items():
                text = STORE.generate_msgdef(kind, ros_version=2)[0].encode()
                ids[topic] = writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", text))
            for t, topic, kind, message in rows:
                at = round((_START + t) * 1e9)
                writer.add_message(ids[topic], at, bytes(STORE.serialize_cdr(message, kind)), at)
            writer.finish()
        return
    with BagWriter(path, version=9) as bag:
        links = {topic: bag.add_connection(topic, kind, typestore=STORE) for topic, kind in kinds.items()}
        for t, topic, kind, message in rows:
            bag.write(links[topic], round((_START + t) * 1e9), STORE.serialize_cdr(message, kind))


def _clock(rate: float, seconds: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Times of samples, and when their messages arrive [s]; the clock jitters and one message in 500 is lost."""
    t = np.arange(0.05, seconds - 0.05, 1.0 / rate)
    t = t + rng.normal(0.0, 0.04 / rate, t.size)
    t = t[rng.random(t.size) > 0.002]
    return t, np.maximum.accumulate(t + rng.exponential(0.002, t.size))


def _sampled(x: Array, t: Array) -> Array:
    return np.asarray(x[np.clip((t / H).astype(np.intp), 0, len(x) - 1)])


def _joints(
    robot: Robot, driven: Driven, fault: Fault | None, rng: np.random.Generator, habits: Habits
) -> list[tuple[float, str, str, Any]]:
    t, arrives = habits.clocked(*_clock(robot.rate, len(driven.steer) * H, rng))
    step = 2 * np.pi / robot.counts
    angle = np.floor(_sampled(np.cumsum(driven.seen, axis=0) * H, t) / step) * step
    speed = np.diff(angle, axis=0, prepend=0.0) / np.diff(t, prepend=t[0] - 1.0 / robot.rate)[:, None]
    speed[0] = 0.0
    if robot.smooth > 0.0:
        a = np.exp(-1.0 / robot.rate / robot.smooth)
        for k in range(1, len(speed)):
            speed[k] = a * speed[k - 1] + (1 - a) * speed[k]
    if fault is not None and fault.side == "sensor":
        speed[:, fault.wheel] = published(t, speed[:, fault.wheel], fault, H, rng)
        if fault.counted and fault.kind in ("encoder_frozen", "encoder_late"):  # the whole message part is late
            angle[:, fault.wheel] = published(t, angle[:, fault.wheel], fault, H, rng)
    mirrored = robot.described is False and robot.counts > 2e4  # motors of one side are mounted the other way round
    sign = np.array([-1.0 if mirrored and w.y < 0 else 1.0 for w in robot.wheels])
    names = [w.joint for w in robot.wheels]
    effort = sign * _sampled(driven.duty if robot.duties else driven.torque, t)
    effort = effort + rng.normal(0.0, 0.002 if robot.duties else 0.02 * robot.rail * robot.radius, effort.shape)
    turned, steering = _steering_joints(robot), _sampled(driven.steer, t)
    made, kind = STORE.types["sensor_msgs/msg/JointState"], "sensor_msgs/msg/JointState"
    rows: list[tuple[float, str, str, Any]] = []
    for k in range(t.size):
        torque = np.r_[effort[k], np.zeros(len(turned))] if robot.efforts else _NONE
        position, velocity = sign * angle[k], sign * speed[k] if habits.signed else np.abs(speed[k])
        position, velocity = np.r_[position, np.full(len(turned), steering[k])], np.r_[velocity, np.zeros(len(turned))]
        message = made(
            _header(t[k]),
            [*names, *turned],
            position if (robot.positions and habits.signed) or turned or not habits.velocities else _NONE,
            velocity if habits.velocities else _NONE,
            torque,
        )
        rows.append((arrives[k], "/joint_states", kind, message))
    return rows


def _steering_joints(robot: Robot) -> list[str]:
    names = {"car": ["front_left_steering_joint", "front_right_steering_joint"]}
    return names.get(robot.kind, ["front_steering_joint"] if robot.kind in STEERED else [])


def _commands(robot: Robot, course: Course, rng: np.random.Generator) -> list[tuple[float, str, str, Any]]:
    t, arrives = _clock(float(rng.choice([10.0, 20.0, 50.0])), course.v.size * H, rng)
    rows: list[tuple[float, str, str, Any]] = []
    for k in range(t.size):
        i = min(round(t[k] / H), course.v.size - 1)
        if course.silent[i] and course.silent[max(0, i - 300)]:  # a last zero, then nothing
            continue
        on = 0.0 if course.silent[i] else 1.0
        twist = _twist(on * course.v[i], on * course.lateral[i], on * course.omega[i])
        if robot.stamped:
            stamped = STORE.types["geometry_msgs/msg/TwistStamped"](_header(t[k]), twist)
            rows.append((arrives[k], "/cmd_vel", "geometry_msgs/msg/TwistStamped", stamped))
        else:
            rows.append((arrives[k], "/cmd_vel", "geometry_msgs/msg/Twist", twist))
    return rows


def _inertia(
    course: Course, driven: Driven, fault: Fault | None, rng: np.random.Generator
) -> list[tuple[float, str, str, Any]]:
    t, arrives = _clock(100.0 if rng.random() < 0.5 else 50.0, course.v.size * H, rng)
    yaw = _sampled(driven.body[:, 2], t) * rng.normal(1.0, 0.01) + rng.normal(0.0, 0.01) + rng.normal(0.0, 0.01, t.size)
    yaw = of_the_body(t, yaw, fault, "gyro", H)
    along = np.gradient(driven.body[:, 0], H) + 9.81 * np.sin(course.slope)
    along = _sampled(along, t) + rng.normal(0.0, 0.1) + rng.normal(0.0, 0.3, t.size)
    zeros, vector = np.zeros(9), STORE.types["geometry_msgs/msg/Vector3"]
    kind = "sensor_msgs/msg/Imu"
    still = STORE.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    return [
        (
            arrives[k], "/imu/data", kind,
            STORE.types[kind](_header(t[k]), still, zeros, vector(0.0, 0.0, yaw[k]), zeros, vector(along[k], 0.0, 9.81), zeros),
        )
        for k in range(t.size)
    ]  # fmt: skip


def _odometry(
    robot: Robot, driven: Driven, fault: Fault | None, rng: np.random.Generator
) -> list[tuple[float, str, str, Any]]:
    if robot.odometry == "none":
        return []
    t, arrives = _clock(float(rng.choice([10.0, 20.0, 50.0])), len(driven.steer) * H, rng)
    if robot.odometry == "wheels":
        rim = _sampled(driven.seen, t) * robot.radius
        if fault is not None and fault.side == "sensor":
            rim[:, fault.wheel] = robot.radius * published(t, rim[:, fault.wheel] / robot.radius, fault, H, rng)
        left, right = (np.array([(w.y > 0) == s for w in robot.wheels]) for s in (True, False))
        v = rim.mean(axis=1)
        if robot.kind == "tricycle":
            v, omega = v * np.cos(_sampled(driven.steer, t)), v * np.sin(_sampled(driven.steer, t)) / robot.wheelbase
        else:
            omega = (rim[:, right].mean(axis=1) - rim[:, left].mean(axis=1)) / (2 * abs(robot.wheels[0].y))
    else:
        v, omega = (_sampled(driven.body[:, i], t) * rng.normal(1.0, 0.01) for i in (0, 2))
        v, omega = v + rng.normal(0.0, 0.02, t.size), omega + rng.normal(0.0, 0.01, t.size)
    v, omega = (of_the_body(t, z, fault, "odometry", H) for z in (v, omega))
    step = np.diff(t, prepend=t[0])
    yaw = np.cumsum(omega * step)
    x, y = np.cumsum(v * np.cos(yaw) * step), np.cumsum(v * np.sin(yaw) * step)
    types, wide = STORE.types, np.zeros(36)
    kind = "nav_msgs/msg/Odometry"
    rows: list[tuple[float, str, str, Any]] = []
    for k in range(t.size):
        turn = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, np.sin(yaw[k] / 2), np.cos(yaw[k] / 2))
        pose = types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](x[k], y[k], 0.0), turn)
        message = types[kind](
            _header(t[k], "odom"), "base_link", types["geometry_msgs/msg/PoseWithCovariance"](pose, wide),
            types["geometry_msgs/msg/TwistWithCovariance"](_twist(v[k], 0.0, omega[k]), wide),
        )  # fmt: skip
        rows.append((arrives[k], "/odom", kind, message))
    return rows


def _twist(v: float, lateral: float, omega: float) -> Any:
    vector = STORE.types["geometry_msgs/msg/Vector3"]
    return STORE.types["geometry_msgs/msg/Twist"](vector(float(v), float(lateral), 0.0), vector(0.0, 0.0, float(omega)))


def _header(t: float, frame: str = "base_link") -> Any:
    at = round((_START + t) * 1e9)
    stamp = STORE.types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9)
    return STORE.types["std_msgs/msg/Header"](stamp, frame)


def _urdf(robot: Robot) -> str:
    """Wheels that roll about their own y, those that are steered on a joint about z."""
    parts = ['<?xml version="1.0"?><robot name="rover"><link name="base_link"/>']
    for w in robot.wheels:
        link = w.joint.replace("_joint", "_link")
        shape = f'<geometry><cylinder radius="{robot.radius:.4f}" length="0.08"/></geometry>'
        parent, place = "base_link", f"{w.x:.4f} {w.y:.4f} 0"
        if w.steered:
            name = w.joint.replace("wheel", "steering")
            parent = name.replace("_joint", "_link")
            parts.append(
                f'<link name="{parent}"/><joint name="{name}" type="revolute"><parent link="base_link"/><child link="{parent}"/>'
                f'<origin xyz="{place}" rpy="0 0 0"/><axis xyz="0 0 1"/><limit lower="-0.5" upper="0.5" effort="50" velocity="3"/></joint>'
            )
            place = "0 0 0"
        parts.append(
            f'<link name="{link}"><collision>{shape}</collision></link><joint name="{w.joint}" type="continuous">'
            f'<parent link="{parent}"/><child link="{link}"/><origin xyz="{place}" rpy="0 0 0"/><axis xyz="0 1 0"/></joint>'
        )
    return "".join([*parts, "</robot>"])
