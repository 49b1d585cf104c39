"""Rules that guess where canonical signals are recorded: one candidate per fitting channel."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.signal_table import signal_of
from replay.signals.candidate import Candidate, message_field, source_of
from replay.signals.name_parts import axle_of, first_indices, index_of, is_drive, is_steering, wheel_of
from replay.signals.name_words import ASKING, tokens
from replay.signals.symbol_rules import by_symbol

MESSAGE_TYPES = (
    "JointState", "DynamicJointState", "Twist", "TwistStamped", "AckermannDrive", "AckermannDriveStamped", "Odometry",
    "Imu", "NavSatFix", "GPSFix", "Float64MultiArray", "Float32MultiArray", "Float64", "Float32",
    "JointTrajectoryControllerState",
)  # fmt: skip
_COMMON_PACKAGES = frozenset(
    (
        *("sensor_msgs", "nav_msgs", "geometry_msgs", "std_msgs", "tf2_msgs", "tf", "rcl_interfaces", "rosgraph_msgs"),
        *("visualization_msgs", "diagnostic_msgs", "stereo_msgs", "shape_msgs", "rosbag2_interfaces", "map_msgs"),
        *("foxglove_msgs", "lifecycle_msgs", "statistics_msgs", "service_msgs", "theora_image_transport"),
    )
)
#: Fields that only one type of message has, by which a table of its topic is known.
_EXPORTED = {
    "twist.twist.linear.x": ("odom.v", "m/s"),
    "pose.pose.position.x": ("odom.x", "m"),
    "pose.pose.position.y": ("odom.y", "m"),
    "angular_velocity.z": ("imu.yaw_rate", "rad/s"),
    "linear_acceleration.x": ("imu.acceleration", "m/s^2"),
}
_WORDS_REF = re.compile(r"ref|cmd|command|set|des|target|soll|demand")


def wanted_type(type_name: str) -> bool:
    """Whether messages of a type may hold signals: those of the rules, and types of no common package."""
    package, _, leaf = type_name.replace("/msg/", "/").rpartition("/")
    return leaf in MESSAGE_TYPES or (bool(package) and package not in _COMMON_PACKAGES and "_interfaces" not in package)


def candidates(channels: Mapping[str, Channel], machine: Machine) -> Iterator[Candidate]:
    """Yield every candidate of one log."""
    first = first_indices(channels)
    for channel in channels.values():
        yield from _by_canonical(channel, machine)
        if channel.topic:
            yield from _by_message(channel, machine, channels)
        elif (told := _EXPORTED.get(message_field(channel))) is not None:
            yield Candidate(told[0], source_of(channel, told[1]), 1, "a field of a message, in a table of its topic")
            continue
        if channel.topic and channel.type_name.rpartition("/")[2] in MESSAGE_TYPES[:10]:
            continue
        yield from by_symbol(channel, machine, first)


def _by_canonical(channel: Channel, machine: Machine) -> Iterator[Candidate]:
    """Yield a channel that already carries a canonical name."""
    known = {s.lower(): s for s in machine.canonical_signals()}
    bare = re.sub(r"\s*[\[(][^\[\]()]*[\])]$", "", channel.name).strip()
    inner = re.search(r"\[([^\[\]]+)\]$", channel.field)
    path = re.sub(r"^\.|^\.?mfhca\.", "", channel.topic.replace("/", "."))
    for text in (bare, inner.group(1) if inner else "", path, channel.field):
        signal = known.get(text.lower())
        if signal is not None and not (text == path and channel.field != "data"):
            yield Candidate(
                signal,
                source_of(channel, channel.unit or signal_of(signal).unit),
                0,
                "it carries the signal's own name",
            )
            return


def _by_message(channel: Channel, machine: Machine, others: Mapping[str, Channel]) -> Iterator[Candidate]:
    """Yield what common message types define."""
    leaf, topic, field = channel.type_name.rpartition("/")[2], channel.topic, channel.field
    plain = topic.rpartition("/")[2]

    def found(signal: str, unit: str, rank: int, why: str = "") -> Candidate:
        return Candidate(signal, source_of(channel, unit), rank, why or f"{leaf} on {topic}")

    if leaf in ("Twist", "TwistStamped") and (re.search(r"cmd|command", topic.lower()) or ASKING & {*tokens(topic)}):
        rank = {"cmd_vel": 1, "cmd": 2}.get(plain, 3) + topic.count("/") - 1
        if field in ("linear.x", "twist.linear.x"):
            yield found("cmd.v", "m/s", rank)
        elif field in ("angular.z", "twist.angular.z"):
            yield found("cmd.omega", "rad/s", rank)
        elif field in ("linear.y", "twist.linear.y") and np.any(channel.values):
            yield found("cmd.lateral", "m/s", rank)
    elif leaf.startswith("AckermannDrive"):
        if field in ("speed", "drive.speed"):
            yield found("cmd.v", "m/s", 4)
        elif field in ("steering_angle", "drive.steering_angle"):
            if "front" in machine.axles:
                yield found("steer.front.phi_ref", "rad", 4)
            if machine.geometry is not None and machine.geometry.steering_base is not None:
                yield found("cmd.omega", "rad", 5)
    elif leaf == "Odometry":
        rank = 1 if plain == "odom" else 2 if "odom" in plain else 4
        rank += 3 * bool(re.search(r"filter|gps|gnss|global|map", topic.lower()))
        for axis in ("x", "y"):
            if field == f"pose.pose.position.{axis}":
                yield found(f"odom.{axis}", "m", rank)
        if field == "twist.twist.linear.x":
            yield found("odom.v", "m/s", rank)
        if field == "pose.pose.orientation.w":
            whole = SignalSource(topic=topic, field="pose.pose.orientation", unit="rad")
            yield Candidate("odom.yaw", whole, rank, f"quaternion of {leaf} on {topic}")
    elif leaf == "Imu" and field == "angular_velocity.z":
        yield found("imu.yaw_rate", "rad/s", 1 + ("imu" not in topic.lower()))
    elif leaf == "Imu" and field == "linear_acceleration.x" and np.any(channel.values):
        yield found("imu.acceleration", "m/s^2", 1 + ("imu" not in topic.lower()))
    elif leaf in ("NavSatFix", "GPSFix"):
        signal = {"latitude": "gnss.lat", "longitude": "gnss.lon", "speed": "gnss.speed"}.get(field)
        if signal is not None:
            yield found(signal, "m/s" if field == "speed" else "deg", 1 + (plain != "fix"))
    elif leaf in ("JointState", "DynamicJointState", "JointTrajectoryControllerState"):
        yield from _by_joint(channel, machine, others)
    elif leaf.endswith("MultiArray"):
        yield from _by_command_array(channel, machine, others)


def _role(topic: str, field: str) -> str:
    """What a joint topic or field describes: ``u``, ``u_applied``, ``ref``, ``true`` or ``measured``."""
    text = topic.lower()
    if re.search(r"valve|spool", text):
        return "u_applied" if re.search(r"feedback|actual|state|spool|measured", text) else "u"
    if re.search(r"redundant|second|true", text):
        return "true"
    lead = field.split(".")[0].lower()
    if lead in ("reference", "desired") or _WORDS_REF.search(" ".join(tokens(text.rpartition("/")[2]))):
        return "ref"
    return "skip" if lead in ("error", "output") else "measured"


def _by_joint(channel: Channel, machine: Machine, others: Mapping[str, Channel]) -> Iterator[Candidate]:
    """Yield joints of wheels and steering axles, matched by name, or by number where all are numbered."""
    match = re.match(r"(?:(?P<lead>\w+)\.)?(?P<kind>position|velocit|effort)\w*\[(?P<joint>.+)\]$", channel.field)
    dynamic = re.match(
        r"interface_values\[(?P<joint>.+)\]\.values\[(?P<kind>position|velocity|effort)\]$", channel.field
    )
    found = match or dynamic
    if found is None:
        return
    joint, role = found["joint"], _role(channel.topic, channel.field)
    kind = "velocity" if found["kind"].startswith("velocit") else found["kind"]
    rank = 1 + (channel.topic.rpartition("/")[2] != "joint_states") + (dynamic is not None)
    axle = axle_of(joint, machine) if is_steering(joint) else None
    wheel = None if is_steering(joint) else wheel_of(joint, machine)
    if wheel is None and axle is None and is_drive(joint):
        wheel, rank = _only(joint, machine, others, channel) or _numbered(joint, machine, others, channel), rank + 2
    why = f"joint {joint!r} on {channel.topic}"
    if role in ("u", "u_applied"):
        part = f"wheel.{wheel}" if wheel else f"steer.{axle}" if axle else None
        if part and kind == "effort":
            yield Candidate(f"{part}.{role}", source_of(channel, "1"), rank, why)
    elif wheel and kind == "effort" and role == "measured":
        yield Candidate(f"wheel.{wheel}.effort", source_of(channel, "N·m"), rank, why)
    elif wheel and kind == "velocity":
        leaf = {"measured": "v", "ref": "v_ref", "true": "v_true"}.get(role)
        if leaf:
            yield Candidate(f"wheel.{wheel}.{leaf}", source_of(channel, "rad/s"), rank, why)
    elif wheel and kind == "position" and role == "measured":
        yield Candidate(f"wheel.{wheel}.v", source_of(channel, "rad", derivative=True), rank + 20, f"position of {why}")
        beside = re.sub(r"position", "velocity", channel.field, count=1)
        if f"{channel.topic}.{beside}" in others:  # else it is the speed itself
            source = source_of(channel, "rad", derivative=True)
            yield Candidate(f"wheel.{wheel}.v_position", source, rank, f"position of {why}")
    elif axle and kind == "position":
        leaf = {"measured": "phi", "ref": "phi_ref", "true": "phi_true"}.get(role)
        if leaf:
            yield Candidate(f"steer.{axle}.{leaf}", source_of(channel, "rad"), rank, why)


def _only(joint: str, machine: Machine, others: Iterable[str], channel: Channel) -> str | None:
    """The wheel of a machine with one, where no other joint is a wheel's: that of a tricycle."""
    drives = [j for j in _joints(others, channel) if is_drive(j) and not is_steering(j)]
    return machine.wheels[0] if len(machine.wheels) == 1 and drives == [joint] else None


def _joints(others: Iterable[str], channel: Channel) -> list[str]:
    """Joints beside a channel's in its field of one message."""
    prefix = f"{channel.topic}.{channel.field.split('[')[0]}["
    return [o[len(prefix) :].split("]")[0] for o in others if o.startswith(prefix)]


def _numbered(joint: str, machine: Machine, others: Iterable[str], channel: Channel) -> str | None:
    found = index_of(joint)
    if found is None:
        return None
    joints = _joints(others, channel)
    at = found[1] - min(first_indices(joints).get(found[0], found[1]), 1)
    return machine.wheels[at] if 0 <= at < len(machine.wheels) else None


def _by_command_array(channel: Channel, machine: Machine, others: Mapping[str, Channel]) -> Iterator[Candidate]:
    """Yield entries of a controller's command array, in the order of the machine's wheels or axles."""
    found = re.match(r"data\[(\d+)\]$", channel.field)
    name = channel.topic.lower()
    if found is None or not ASKING & {*tokens(channel.topic)}:
        return
    count = sum(1 for o in others if o.startswith(f"{channel.topic}.data["))
    at = int(found[1])
    why = f"entry {at} of {channel.topic}, its order taken to be"
    if re.search(r"steer|position", name) and count == len(machine.axles):
        signal = f"steer.{machine.axles[at]}.{'u' if 'valve' in name else 'phi_ref'}"
        yield Candidate(signal, source_of(channel, "1" if "valve" in name else "rad"), 6, f"{why} {machine.axles}")
    elif count == len(machine.wheels):
        valve = re.search(r"valve|effort|duty|pwm", name) is not None
        signal = f"wheel.{machine.wheels[at]}.{'u' if valve else 'v_ref'}"
        yield Candidate(signal, source_of(channel, "1" if valve else "rad/s"), 6, f"{why} {machine.wheels}")
