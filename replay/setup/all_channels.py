"""Every channel of a log with its rate, range and unit, and the signals that it could be."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from replay.arrays.blocks import blocks
from replay.log.raw_log import Channel, RawLog
from replay.machine.config import Machine
from replay.machine.units import known_unit
from replay.signals.channel_data import own_rows
from replay.signals.file_names import in_its_file, named_channels
from replay.signals.named_units import unit_by_end
from replay.signals.rules import candidates
from replay.signals.timeline import median_period

# Units that message types define, by the end of the field's name.
_FIELDS = (
    (r"(^|\.)linear_acceleration\.[xyz]$", "m/s^2"),
    (r"(^|\.)angular_velocity\.[xyz]$|(^|\.)angular\.[xyz]$|^velocity\[", "rad/s"),
    (r"(^|\.)linear\.[xyz]$|(^|\.)speed$", "m/s"),
    (r"(^|\.)position\.[xyz]$|^altitude$", "m"),
    (r"^(latitude|longitude)$", "deg"),
    (r"^position\[|steering_angle$", "rad"),
    (r"^effort\[", "N·m"),
)
_MESSAGES = re.compile(
    r"(JointState|Twist|TwistStamped|Odometry|Imu|NavSatFix|GPSFix|Pose\w*|AckermannDrive\w*|DynamicJointState)$"
)


@dataclass(frozen=True)
class ChannelRow:
    """One channel.

    Attributes
    ----------
    name, topic, field, type_name, source : str
        As recorded; no topic for tables.
    samples : int
        How many it has.
    rate_hz : float or None
        By the median distance of its stamps.
    low, high : float or None
        Smallest and largest number, as recorded; None where it holds none.
    unit : str
        Stated by the file, by the message type, or guessed by the name; empty where nothing says it.
    guessed : bool
        Whether the unit is only guessed.
    could_be : tuple[str, ...]
        Canonical signals, the surest first.
    """

    name: str
    topic: str
    field: str
    type_name: str
    source: str
    samples: int
    rate_hz: float | None
    low: float | None
    high: float | None
    unit: str
    guessed: bool
    could_be: tuple[str, ...]


def channel_rows(logs: Sequence[RawLog], machine: Machine) -> list[ChannelRow]:
    """List every channel of the files of one mission.

    Parameters
    ----------
    logs : Sequence[RawLog]
        Decoded files.
    machine : Machine
        Whose signals they could be.
    """
    rows = []
    for log, channels in zip(logs, named_channels(logs), strict=True):
        fits: dict[str, list[tuple[int, str]]] = {}
        for c in candidates(channels, machine):
            fits.setdefault(in_its_file(c.origin, log).label, []).append((c.rank, c.signal))
        for channel in log.channels.values():
            label = channel.name
            if channel.field.startswith("pose.pose.orientation."):  # four numbers, one heading
                label = f"{channel.topic}.pose.pose.orientation"
            could_be = dict.fromkeys(signal for _, signal in sorted(fits.get(label, [])))
            rows.append(_row(log, channel, tuple(could_be)))
    return rows


def _row(log: RawLog, channel: Channel, could_be: tuple[str, ...]) -> ChannelRow:
    low, high = _range(channel)
    stamps = channel.stamps
    if not channel.topic:
        stamps = stamps[own_rows(log, channel)]
    period = median_period(stamps)
    unit, guessed = unit_of_channel(channel)
    return ChannelRow(
        channel.name, channel.topic, channel.field, channel.type_name, log.source, len(stamps),
        1e9 / period if period > 0 else None, low, high, unit, guessed, could_be,
    )  # fmt: skip


def _range(channel: Channel) -> tuple[float | None, float | None]:
    low, high = np.inf, -np.inf
    for part in blocks(len(channel.values)):
        values = np.asarray(channel.values[part], np.float64)
        values = values[np.isfinite(values)]
        low, high = min(low, values.min(initial=np.inf)), max(high, values.max(initial=-np.inf))
    return (float(low), float(high)) if low <= high else (None, None)


def unit_of_channel(channel: Channel) -> tuple[str, bool]:
    """Unit of a channel, and whether it is only guessed; empty where nothing says it."""
    if channel.unit:
        return known_unit(channel.unit) or channel.unit, False
    if channel.topic and _MESSAGES.search(channel.type_name):
        for pattern, unit in _FIELDS:
            if re.search(pattern, channel.field):
                return unit, False
    return unit_by_end(channel.name, doubtful=True), True
