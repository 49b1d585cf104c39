"""What the name of a channel leaves open, and a channel of which a person must say it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from replay.log.source_options import SignalSource
from replay.machine.toml_text import signal_line


class Open(StrEnum):
    """What a name leaves open."""

    CURRENT = "current"
    COUNTS = "counts"
    POSITION = "position"
    SPEED = "speed"
    SECOND = "second"
    MOTION = "motion"
    OPENING = "opening"
    YAW_RATE = "yaw rate"
    PLACE = "place"
    GROUND = "over ground"
    ANGLE = "angle"
    DRIVERS = "drivers"


@dataclass(frozen=True)
class Unsure:
    """A channel that may hold a signal, once somebody says what its name leaves open.

    Attributes
    ----------
    signal : str
        Canonical name.
    origin : SignalSource
        The channel, with the conversion that it would have; an empty unit where that is open too.
    kind : Open
        What its name leaves open.
    beside : str
        Label of the channel that it goes with; may be empty.
    """

    signal: str
    origin: SignalSource
    kind: Open
    beside: str = ""

    @property
    def reason(self) -> str:
        """Why it is not taken, and the line of [signals] to write if it is what it seems."""
        line = signal_line(self.signal, _as_written(self))
        return f"{self.origin.label!r} {_REASONS[self.kind].format(beside=self.beside, unit=self.origin.unit)}, write {line}"


_REASONS = {
    Open.CURRENT: "is a valve's current or voltage, which is no opening by itself; with gain = 1 / the one that opens it fully",
    Open.COUNTS: "counts an encoder's steps, and how many make a turn is not known; with gain = 6.2832 / the steps of a turn",
    Open.POSITION: "may be the position of a wheel, whose slope is its speed; if it is, and in {unit}",
    Open.SPEED: "has no word for what it holds; if it is a speed, with its unit (m/s, rad/s, rpm, mm/s)",
    Open.MOTION: "may be what the machine is told to do, or what it does (odom.v is its measured speed); if it is the command",
    Open.SECOND: "may be a second sensor beside {beside!r}; if it is",
    Open.YAW_RATE: "may be the yaw rate, which its name does not say of all its axes; if it is, with its unit (rad/s, deg/s)",
    Open.PLACE: "may be a place by a satellite receiver; if it is, in degrees",
    Open.GROUND: "may be the speed over ground by a satellite receiver; if it is, with its unit (m/s, km/h, kn)",
    Open.ANGLE: "may be a steering angle; if it is, and in {unit}",
    Open.DRIVERS: "is the wheel that the driver turns, by its name, which is geared to the axle; if it is the axle's own angle, and in {unit}",
    Open.OPENING: "may be what a valve or pump is told, or where it stands (1 is fully open); if it is",
}


def _as_written(found: Unsure) -> SignalSource:
    """The origin with what stands in for what is open."""
    unit = {Open.COUNTS: "rad", Open.SPEED: found.origin.unit or "…", Open.GROUND: found.origin.unit or "…"}.get(
        found.kind, found.origin.unit
    )
    return replace(found.origin, unit=unit)
