"""How a source that does not describe itself is read, and where a signal is recorded in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from replay.errors import ConfigError, check_range
from replay.log.time_zone import zone_called

StampClock = Literal["header", "log", "publish"]


@dataclass(frozen=True)
class SourceOptions:
    """How to read one source that does not describe itself.

    Attributes
    ----------
    time : str or None
        Time column of a table.
    time_unit : str
        ``s``, ``ms``, ``us``, ``ns``, ``filetime`` (100 ns since 1601), ``iso`` (date text), ``dc`` (EtherCAT
        distributed clock, ns since 2000), ``dc32`` (its lower 32 bits, which start again every 4.29 s) or ``dt`` (PLC
        DATE_AND_TIME, whole seconds: the samples of one second are spread evenly over it).
    epoch : str or None
        ISO date and time of zero of the time column; None: 1970 (2000 for ``dc`` and ``dc32``).
    time_zone : str or None
        In which dates are meant that state no zone: ``Europe/Berlin``, ``UTC``, ``+02:00``; None: UTC.
    separator, decimal : str or None
        Of a text table; None: found from the file.
    scale : bool
        Whether ScaleFactor and Offset of a TwinCAT export are to be applied.
    stamp : str
        Clock of a message log.
    clock : str
        How the source's clock is put onto that of the mission's first file: ``estimate`` (from signals that both recorded)
        or ``as recorded`` (not at all).
    clock_offset, clock_drift : float or None
        Instead of an estimate: seconds added to the source's stamps at its first sample, and their change [ppm].
    """

    time: str | None = None
    time_unit: str = "s"
    epoch: str | None = None
    time_zone: str | None = None
    separator: str | None = None
    decimal: str | None = None
    scale: bool = False
    stamp: StampClock = "header"
    clock: Literal["estimate", "as recorded"] = "estimate"
    clock_offset: float | None = None
    clock_drift: float | None = None

    def __post_init__(self) -> None:
        """Check values."""
        if self.time_unit not in ("s", "ms", "us", "ns", "filetime", "iso", "dc", "dc32", "dt"):
            raise ConfigError(
                f"[sources] time_unit = {self.time_unit!r} is not known; expected s, ms, us, ns, filetime, iso, dc, dc32 "
                "or dt"
            )
        if self.time_zone is not None:
            zone_called(self.time_zone)
        if self.stamp not in ("header", "log", "publish"):
            raise ConfigError(f"[sources] stamp = {self.stamp!r} is not known; expected header, log or publish")
        if self.clock not in ("estimate", "as recorded"):
            raise ConfigError(f"[sources] clock = {self.clock!r} is not known; expected estimate or as recorded")
        given = self.clock_offset is not None or self.clock_drift is not None
        if given and self.clock == "as recorded":
            raise ConfigError(
                '[sources] clock = "as recorded" contradicts clock_offset and clock_drift; give one of them'
            )
        check_range("[sources] clock_offset", self.clock_offset or 0.0, -4e9, 4e9, "s")
        check_range("[sources] clock_drift", self.clock_drift or 0.0, -1e5, 1e5, "ppm")


@dataclass(frozen=True)
class SignalSource:
    """Where a canonical signal is recorded, and how it becomes SI.

    SI value = (recorded · gain + offset) · factor(unit). Either `topic` with `field`, or `symbol` (TwinCAT), or
    `column` (table). `on_change`: its sender publishes it only when it changes (`replay.signals.publishing`).
    """

    topic: str | None = None
    field: str | None = None
    symbol: str | None = None
    column: str | None = None
    unit: str = ""
    gain: float = 1.0
    offset: float = 0.0
    derivative: bool = False
    at: Literal["motor", "wheel"] = "wheel"
    source: str | None = None
    on_change: bool = False

    @property
    def label(self) -> str:
        """Name of the channel it points to."""
        return f"{self.topic}.{self.field}" if self.topic is not None else str(self.symbol or self.column)
