"""Topics of velocities that no name tells to be commands: ``/robot/nav_vel``. A person must say whether one asks or measures."""

from __future__ import annotations

from collections.abc import Iterable

from replay.log.source_options import SignalSource
from replay.machine.toml_text import signal_line
from replay.signals.name_words import MEASURED, tokens

_FIELDS = {"Twist": "", "TwistStamped": "twist."}
_MEASURING = MEASURED | frozenset(
    (*("odom", "odometry", "imu", "gps", "gnss", "fix", "ekf", "ukf", "filter", "filtered", "estimate", "estimated", "estimator"),
     *("local", "state", "states", "status", "sensor", "sensors", "truth", "body", "encoder", "encoders")),
)  # fmt: skip


def possible_commands(topics: Iterable[tuple[str, str]]) -> dict[str, tuple[str, str]]:
    """Lines of [signals] for commanded speed and yaw rate by topic, each once; none of topics whose names tell a measurement.

    Parameters
    ----------
    topics : Iterable[tuple[str, str]]
        Name and type of message.
    """
    out = {}
    for topic, kind in topics:
        lead = _FIELDS.get(kind.replace("/msg/", "/").rpartition("/")[2])
        if lead is None or _MEASURING & {*tokens(topic)}:
            continue
        speed = SignalSource(topic=topic, field=f"{lead}linear.x", unit="m/s")
        turn = SignalSource(topic=topic, field=f"{lead}angular.z", unit="rad/s")
        out[topic] = signal_line("cmd.v", speed), signal_line("cmd.omega", turn)
    return out
