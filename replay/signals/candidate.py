"""A recorded channel that may hold a canonical signal."""

from __future__ import annotations

from dataclasses import dataclass

from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource


@dataclass(frozen=True)
class Candidate:
    """A channel that may hold a signal.

    Attributes
    ----------
    signal : str
        Canonical name.
    origin : SignalSource
        Channel and conversion; an empty unit is left to what the channel states.
    rank : int
        Smaller is surer.
    why : str
        Reason, for the report.
    """

    signal: str
    origin: SignalSource
    rank: int
    why: str


def source_of(channel: Channel, unit: str = "", derivative: bool = False) -> SignalSource:
    """The channel as a source: by topic and field, as a symbol of a PLC, or as a column of a table."""
    if channel.topic:
        return SignalSource(topic=channel.topic, field=channel.field, unit=unit, derivative=derivative)
    if channel.type_name and channel.name != channel.field:
        return SignalSource(symbol=channel.name, unit=unit, derivative=derivative)
    return SignalSource(column=channel.name, unit=unit, derivative=derivative)


def message_field(channel: Channel) -> str:
    """Field of a message, also where a table of one topic holds it: `rostopic echo -p` writes ``field.`` before its names."""
    return channel.field if channel.topic else channel.name.strip().removeprefix("field.")
