"""What a log holds instead of a signal that was not found: kinds of messages that are not read, with what to record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from replay.log.raw_log import LogSummary
from replay.signals.possible_commands import possible_commands

_RECORD = "record the odometry itself (nav_msgs/Odometry, as /odom)"
#: By signal: types of messages that hold it in a form that is not read, and what to record instead.
_INSTEAD = dict.fromkeys(
    ("odom.x", "odom.y", "odom.yaw"), (("TFMessage", "PoseStamped", "PoseWithCovarianceStamped"), _RECORD)
) | {
    "odom.v": (("TFMessage",), _RECORD),
    "cmd.v": (("Joy",), "record the command that follows from it (geometry_msgs/Twist, as /cmd_vel)"),
    "cmd.omega": (("Joy",), "record the command that follows from it (geometry_msgs/Twist, as /cmd_vel)"),
}


def near_misses(missing: Mapping[str, str], summaries: Sequence[LogSummary], unknown: str) -> dict[str, str]:
    """The missing signals, where it helps with what is in the log instead: ``/tf holds …``.

    Parameters
    ----------
    missing : Mapping[str, str]
        Reason by canonical name.
    summaries : Sequence[LogSummary]
        Every topic of every file.
    unknown : str
        The reason that is to be replaced: that nothing fits.
    """
    out = dict(missing)
    commands = possible_commands((t.name, t.type_name) for s in summaries for t in s.topics)
    for name, at in (("cmd.v", 0), ("cmd.omega", 1)):
        if commands and out.get(name) == unknown:
            topic, lines = next(iter(commands.items()))
            out[name] = f"{topic} may be the command, which its name does not say; if it is, write {lines[at]}"
    for name, reason in [*out.items()]:
        types, advice = _INSTEAD.get(name, ((), ""))
        held = [
            t.name
            for s in summaries
            for t in s.topics
            if t.type_name.replace("/msg/", "/").rpartition("/")[2] in types and not t.name.endswith("_static")
        ]
        if held and reason == unknown:
            out[name] = f"{held[0]} ({_what(name)}) is not read; {advice}"
    return out


def _what(name: str) -> str:
    return "which may hold the pose" if name.startswith("odom") else "a joystick"
