"""Write a simulated mission in any format, always with the same values and stamps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from replay.errors import ConfigError
from replay.export.formats.mcap import write_mcap
from replay.export.formats.rosbag1 import write_ros1_bag
from replay.export.formats.rosbag2 import write_rosbag2
from replay.export.formats.tables import write_csv, write_parquet
from replay.export.formats.topics import mission_topics
from replay.export.formats.twincat import write_twincat
from replay.simulation.options import SimulatedMission

_WRITERS: Mapping[str, Callable[[SimulatedMission, Path], None]] = {
    "mcap": lambda mission, path: write_mcap(path, mission_topics(mission, "cdr")),
    "ros1": lambda mission, path: write_ros1_bag(path, mission_topics(mission, "ros1")),
    "rosbag2": lambda mission, path: write_rosbag2(path, mission_topics(mission, "cdr")),
    "twincat": lambda mission, path: write_twincat(path, mission),
    "csv": lambda mission, path: write_csv(path, mission),
    "parquet": lambda mission, path: write_parquet(path, mission),
}

FORMATS: tuple[str, ...] = tuple(_WRITERS)


def write_mission(mission: SimulatedMission, path: Path, format: str) -> None:  # noqa: A002
    """Write a mission's log; its truth is written by `replay.truth.write_truth`.

    Parameters
    ----------
    mission : SimulatedMission
        What to write.
    path : Path
        File, or folder for ``rosbag2``; an existing log is replaced.
    format : str
        One of `FORMATS`.

    Raises
    ------
    ConfigError
        Where the format is not known.
    OutputError
        Where the place cannot be written.
    """
    if format not in _WRITERS:
        raise ConfigError(f"format = {format!r} is not known; expected one of {', '.join(FORMATS)}")
    _WRITERS[format](mission, path)
