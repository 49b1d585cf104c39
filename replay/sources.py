"""How a source that does not describe itself is read, and where a signal is recorded in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from replay.errors import ConfigError

StampClock = Literal["header", "log", "publish"]


@dataclass(frozen=True)
class SourceOptions:
    """How to read one source that does not describe itself.

    Attributes
    ----------
    time : str or None
        Time column of a table.
    time_unit : str
        ``s``, ``ms``, ``us``, ``ns``, ``filetime`` (100 ns since 1601) or ``iso`` (date text).
    epoch : str or None
        ISO date and time of zero of the time column; None: 1970.
    separator, decimal : str or None
        Of a text table; None: found from the file.
    scale : bool
        Whether ScaleFactor and Offset of a TwinCAT export are to be applied.
    stamp : str
        Clock of a message log.
    """

    time: str | None = None
    time_unit: str = "s"
    epoch: str | None = None
    separator: str | None = None
    decimal: str | None = None
    scale: bool = False
    stamp: StampClock = "header"

    def __post_init__(self) -> None:
        """Check values."""
        if self.time_unit not in ("s", "ms", "us", "ns", "filetime", "iso"):
            raise ConfigError(
                f"[sources] time_unit = {self.time_unit!r} is not known; expected s, ms, us, ns, filetime or iso"
            )
        if self.stamp not in ("header", "log", "publish"):
            raise ConfigError(f"[sources] stamp = {self.stamp!r} is not known; expected header, log or publish")


@dataclass(frozen=True)
class SignalSource:
    """Where a canonical signal is recorded, and how it becomes SI.

    SI value = (recorded · gain + offset) · factor(unit). Either `topic` with `field`, or `symbol` (TwinCAT), or
    `column` (table).
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

    @property
    def label(self) -> str:
        """Name of the channel it points to."""
        return f"{self.topic}.{self.field}" if self.topic is not None else str(self.symbol or self.column)
