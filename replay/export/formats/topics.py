"""A mission as ROS messages: topics, types and joint names.

    /joint_states            JointState    velocity [rad/s] of the wheels, position [rad] of the steering axles
    /joint_states_redundant  JointState    the same of the second sensors
    /wheel_commands          JointState    velocity references of the wheels, position references of the axles
    /valve_commands          JointState    effort = fraction of full valve opening commanded
    /valve_feedback          JointState    effort = fraction of full valve opening measured
    /cmd_vel                 TwistStamped  linear.x [m/s], angular.z [rad/s]
    /gnss/fix                NavSatFix     latitude, longitude [deg]
    /imu                     Imu           angular_velocity.z [rad/s]

Entries that a joint does not have are NaN.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.export.formats.message_layout import Dialect, Layout, TopicBatch
from replay.simulation.options import SIMULATED_AXLES, SimulatedMission

_JOINTS = {"FR": "front_right_wheel", "FL": "front_left_wheel", "RR": "rear_right_wheel", "RL": "rear_left_wheel"}
# Topic, then leaf of the wheels' and the axles' signals and the JointState field of each.
_JOINT_TOPICS = (
    ("/joint_states", ("v", "velocity"), ("phi", "position")),
    ("/wheel_commands", ("v_ref", "velocity"), ("phi_ref", "position")),
    ("/valve_commands", ("u", "effort"), ("u", "effort")),
    ("/valve_feedback", ("u_applied", "effort"), ("u_applied", "effort")),
    ("/joint_states_redundant", ("v_true", "velocity"), ("phi_true", "position")),
)


def wheel_joint(wheel: str) -> str:
    """Joint name of a wheel."""
    return _JOINTS.get(wheel, f"{wheel.lower()}_wheel")


def axle_joint(axle: str) -> str:
    """Joint name of a steering axle."""
    return f"{axle}_steering"


def mission_topics(mission: SimulatedMission, dialect: Dialect) -> list[TopicBatch]:
    """Every topic of a mission; a joint that logs no sample is left out of its messages (a batch of its own)."""
    rng = np.random.default_rng([mission.options.seed, 7])
    batches = [_twist(mission, dialect, rng)]
    for topic, wheel, steer in _JOINT_TOPICS:
        batches += _joint_states(mission, topic, wheel, steer, dialect, rng)
    for group in mission.slow:
        layout, fields = _header(dialect, "imu" if group.name == "imu" else "gnss", group.stamps)
        if group.name == "imu":
            type_name = "sensor_msgs/msg/Imu"
            layout.constant("d", 0.0, 0.0, 0.0, 1.0, -1.0, *[0.0] * 8, 0.0, 0.0)
            layout.varying("yaw_rate", "f8")
            layout.constant("d", *[0.0] * 8, 4e-6, 0.0, 0.0, 0.0, -1.0, *[0.0] * 8)
            fields["yaw_rate"] = group.columns["imu.yaw_rate"]
        else:
            type_name = "sensor_msgs/msg/NavSatFix"
            layout.constant("b", 2)
            layout.constant("H", 1)
            layout.varying("lat", "f8")
            layout.varying("lon", "f8")
            layout.constant("d", float("nan"), 0.0025, 0.0, 0.0, 0.0, 0.0025, 0.0, 0.0, 0.0, 0.01)
            layout.constant("B", 2)
            fields["lat"], fields["lon"] = group.columns["gnss.lat"], group.columns["gnss.lon"]
        topic = "/imu" if group.name == "imu" else "/gnss/fix"
        batches.append(TopicBatch(topic, type_name, layout, fields, _log_stamps(group.stamps, 900_000, rng)))
    return batches


def _log_stamps(stamps: NDArray[np.int64], after: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Receive stamps: a little after the header stamp, with jitter of whole microseconds [ns]."""
    return stamps + after + rng.integers(0, 60, stamps.size) * 1000


def _header(dialect: Dialect, frame: str, stamps: NDArray[np.int64]) -> tuple[Layout, dict[str, NDArray[np.generic]]]:
    """std_msgs/Header: stamp and frame; ROS 1 counts messages before them."""
    layout = Layout(dialect)
    fields: dict[str, NDArray[np.generic]] = {
        "sec": (stamps // 1_000_000_000).astype(np.uint32),
        "nanosec": (stamps % 1_000_000_000).astype(np.uint32),
    }
    if dialect == "ros1":
        layout.varying("seq", "u4")
        fields["seq"] = np.arange(stamps.size, dtype=np.uint32)
    layout.varying("sec", "u4")
    layout.varying("nanosec", "u4")
    layout.text(frame)
    return layout, fields


def _twist(mission: SimulatedMission, dialect: Dialect, rng: np.random.Generator) -> TopicBatch:
    rows = mission.rows("cmd.v")
    layout, fields = _header(dialect, "base_link", mission.stamps[rows])
    layout.varying("v", "f8")
    layout.constant("d", 0.0, 0.0, 0.0, 0.0)
    layout.varying("omega", "f8")
    fields |= {"v": mission.columns["cmd.v"][rows], "omega": mission.columns["cmd.omega"][rows]}
    stamps = _log_stamps(mission.stamps, 100_000, rng)[rows]
    return TopicBatch("/cmd_vel", "geometry_msgs/msg/TwistStamped", layout, fields, stamps)


def _joint_states(
    mission: SimulatedMission,
    topic: str,
    wheel: tuple[str, str],
    steer: tuple[str, str],
    dialect: Dialect,
    rng: np.random.Generator,
) -> list[TopicBatch]:
    wheels = mission.options.machine.wheels
    radius = mission.options.machine.wheel_radius
    assert radius is not None  # checked by SimulationOptions
    columns = [(f"wheel.{w}.{wheel[0]}", wheel[1]) for w in wheels]
    columns += [(f"steer.{a}.{steer[0]}", steer[1]) for a in SIMULATED_AXLES]
    if columns[0][0] not in mission.columns:
        return []
    names = [wheel_joint(w) for w in wheels] + [axle_joint(a) for a in SIMULATED_AXLES]
    values = np.column_stack([mission.columns[c] for c, _ in columns])
    values[:, [field == "velocity" for _, field in columns]] /= radius
    stamps = _log_stamps(mission.stamps, 200_000 + 100_000 * len(topic) // 8, rng)
    present = np.ones(values.shape, np.bool_)
    if mission.options.silent == "drop":
        present = ~np.isnan(values)
    recorded = mission.rows(columns[0][0])
    batches = []
    patterns, pattern = np.unique(present, axis=0, return_inverse=True)
    for i, joints in enumerate(patterns):
        rows = np.flatnonzero((pattern.ravel() == i) & recorded)
        if rows.size == 0:
            continue
        layout, fields = _header(dialect, "base_link", mission.stamps[rows])
        kept = np.flatnonzero(joints)
        layout.constant("I", kept.size)
        for j in kept:
            layout.text(names[j])
        for field in ("position", "velocity", "effort"):
            own = np.array([columns[j][1] == field for j in kept], np.bool_)
            layout.doubles(field if own.any() else None, kept.size)
            if own.any():
                fields[field] = np.where(own, values[rows][:, kept], np.nan)
        batches.append(TopicBatch(topic, "sensor_msgs/msg/JointState", layout, fields, stamps[rows]))
    return batches
