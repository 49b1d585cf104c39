"""Tables of one topic each, whose files' names say what their columns hold: ``cmd_vel.csv`` with ``linear.x``, ``odom.csv`` with ``vx``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import PurePath

import numpy as np

from replay.log.file_types import split_ending
from replay.log.raw_log import Channel, RawLog
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.signals.name_words import tokens
from replay.signals.rules import candidates

_COMMANDS = frozenset(("cmd", "command", "commands"))
_ODOMETRY = frozenset(("odom", "odometry"))
_SPEED = r"(linear[._]x|v|vx|speed|velocity)"
#: By a word of the file: signal, pattern of the column's whole name, and unit where the column states none.
_COLUMNS = (
    (_COMMANDS, (("cmd.v", _SPEED, "m/s"), ("cmd.omega", r"(angular[._]z|w|wz|omega|yaw_?rate)", "rad/s"))),
    (_ODOMETRY, (("odom.v", _SPEED, "m/s"), ("odom.x", "x", "m"), ("odom.y", "y", "m"))),
)


def signals_of_topics(logs: Sequence[RawLog]) -> dict[str, SignalSource]:
    """Sources by canonical name of commands and odometry in tables of their own, such as topics of a bag written as CSV.

    An odometry is taken where more than one file is given: of a single one the columns say themselves what they are.

    Parameters
    ----------
    logs : Sequence[RawLog]
        Files of one mission.
    """
    out: dict[str, SignalSource] = {}
    for log in logs:
        if len({c.topic for c in log.channels.values()}) != 1:
            continue
        words = {*tokens(split_ending(PurePath(log.source).name)[0])}
        for said, columns in _COLUMNS:
            if words & said and (said is _COMMANDS or len(logs) > 1):
                found = {s: c for s, pattern, unit in columns if (c := _column(log, pattern, unit)) is not None}
                out |= {
                    s: c for s, c in found.items() if s not in ("odom.x", "odom.y") or {"odom.x", "odom.y"} <= {*found}
                }
                break
    return out


def _column(log: RawLog, pattern: str, unit: str) -> SignalSource | None:
    """The column that is called so, if it ever changes."""
    for c in log.channels.values():
        if not c.topic and re.fullmatch(rf"(.*\.)?{pattern}", c.name.strip(), re.I) and _changes(c):
            return SignalSource(column=c.name, unit=c.unit or unit, source=PurePath(log.source).name)
    return None


def _changes(channel: Channel) -> bool:
    known = channel.values[np.isfinite(channel.values)] if channel.values.dtype.kind in "fiu" else channel.values[:0]
    return bool(known.size and np.ptp(known.astype(np.float64)) > 0.0)


def odometry_column(channels: Mapping[str, Channel], machine: Machine) -> tuple[Channel, SignalSource] | None:
    """The column whose name says that it is the forward speed by an odometry, with its source; None without one that changes.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        By name.
    machine : Machine
        To look for signals with.
    """
    columns = {n: c for n, c in channels.items() if not c.topic and _changes(c)}
    found = [c for c in candidates(columns, machine) if c.signal == "odom.v"]
    origin = min(found, key=lambda c: c.rank).origin if found else None
    channel = None if origin is None else next((c for c in columns.values() if c.name == origin.label), None)
    return None if channel is None or origin is None else (channel, origin)
