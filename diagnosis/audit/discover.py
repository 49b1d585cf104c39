"""Find the missions behind the words of a command line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class MissionSource:
    """One mission as found.

    Attributes
    ----------
    name : str
        Safe as the name of a folder, and unique in the audit also where letter case does not count.
    files : tuple[str, ...]
        Local paths (files, rosbag2 folders) or URLs, in the order in which they are to be read.
    bytes : int
        Size of all files together.
    stamps : tuple[str, ...]
        Of each file: modification time [ns], or the object's ETag or version.
    machine_id : str
        From ``mission.toml``; may be empty.
    machine_file : str or None
        From ``mission.toml``: the machine file's path.
    sizes : tuple[int, ...]
        Of each file [bytes].
    """

    name: str
    files: tuple[str, ...]
    bytes: int
    stamps: tuple[str, ...]
    machine_id: str = ""
    machine_file: str | None = None
    sizes: tuple[int, ...] = ()


@dataclass(frozen=True)
class Discovery:
    """Missions behind the words of a command line.

    Attributes
    ----------
    missions : tuple[MissionSource, ...]
        In the order of their names.
    problems : tuple[str, ...]
        Words and folders behind which there is no mission, one sentence each.
    left_aside : int
        Files that are no logs, or results of earlier runs.
    roots : tuple[str, ...]
        Folders and URLs that were looked through: a known mission below them that was not found is gone.
    """

    missions: tuple[MissionSource, ...]
    problems: tuple[str, ...] = ()
    left_aside: int = 0
    roots: tuple[str, ...] = ()


def discover(words: Iterable[str], *, exclude: Path | None = None) -> Discovery:
    """Find missions behind files, folders, globs, ``-`` (names on stdin, one per line) and URLs.

    Parameters
    ----------
    words : Iterable[str]
        As typed.
    exclude : Path or None
        Folder of the audit's own results, which is not looked into.
    """
    missions = []
    for word in words:
        place = Path(word)
        for path in [place] if place.is_file() else sorted(place.rglob("*.mcap")):
            size, stamp = path.stat().st_size, str(path.stat().st_mtime_ns)
            missions.append(MissionSource(path.stem, (str(path),), size, (stamp,), sizes=(size,)))
    return Discovery(tuple(missions))
