"""Containers in which logs are written, and the endings of their names."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

from replay.errors import ConfigError


class LogFormat(StrEnum):
    """Container of the log."""

    MCAP = "mcap"
    BAG = "bag"
    ROSBAG2 = "rosbag2"
    TWINCAT = "twincat"
    CSV = "csv"
    PARQUET = "parquet"


ENDINGS = {
    LogFormat.MCAP: ".mcap",
    LogFormat.BAG: ".bag",
    LogFormat.ROSBAG2: "",
    LogFormat.TWINCAT: ".txt",
    LogFormat.CSV: ".csv",
    LogFormat.PARQUET: ".parquet",
}


def format_of(output: Path) -> LogFormat:
    """Format that a file name asks for.

    Raises
    ------
    ConfigError
        Where its ending is none of a known format.
    """
    for kind, ending in ENDINGS.items():
        if output.suffix.lower() == ending:
            return kind
    known = ", ".join(e for e in ENDINGS.values() if e)
    raise ConfigError(
        f"{output}: cannot tell the format from its name; expected {known} or a folder name, or give --format"
    )


def format_named(name: str) -> LogFormat:
    """Format of a name.

    Raises
    ------
    ConfigError
        Where no format has that name.
    """
    if name not in list(LogFormat):
        raise ConfigError(f"format = {name!r} is not known; expected one of {', '.join(LogFormat)}")
    return LogFormat(name)
