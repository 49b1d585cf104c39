"""Find the missions behind the words of a command line."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from diagnosis.audit.discovery.finder import Finder, Found
from diagnosis.audit.discovery.mission_names import unique_names
from replay.log.file_types import words_of


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
    problem : str
        Why it cannot be audited, of a folder whose ``mission.toml`` is off; empty where it can.
    folder : str
        Name of the folder it was found in, where that is not the one which its files' real paths tell; else empty.
    """

    name: str
    files: tuple[str, ...]
    bytes: int
    stamps: tuple[str, ...]
    machine_id: str = ""
    machine_file: str | None = None
    sizes: tuple[int, ...] = ()
    problem: str = ""
    folder: str = ""


@dataclass(frozen=True)
class Discovery:
    """Missions behind the words of a command line.

    Attributes
    ----------
    missions : tuple[MissionSource, ...]
        In the order of their names.
    problems : tuple[str, ...]
        Words, folders and links behind which there is no mission though one was to be expected, one sentence each.
    left_aside : int
        Files that are no logs, or results of earlier runs.
    roots : tuple[str, ...]
        Folders and URLs that were looked through: a known mission below them that was not found is gone. One that holds
        nothing at all is not among them, as its disk may not be there.
    notes : tuple[str, ...]
        What else is to be known, one sentence each.
    """

    missions: tuple[MissionSource, ...]
    problems: tuple[str, ...] = ()
    left_aside: int = 0
    roots: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def discover(words: Iterable[str], *, exclude: Path | None = None) -> Discovery:
    """Find missions behind files, folders, globs, ``-`` (names on stdin, one per line) and URLs.

    One mission each: a rosbag2 folder; the numbered parts of a split recording; a recording with tables of the same stem
    beside it; a folder with a ``mission.toml``; any other log.

    Parameters
    ----------
    words : Iterable[str]
        As typed.
    exclude : Path or None
        Folder of the audit's own results, which is not looked into.
    """
    finder = Finder(os.path.realpath(exclude) if exclude is not None else "")
    local, remote = list[str](), list[str]()
    for word in dict.fromkeys(words_of(words)):
        (remote if "://" in word else local).append(word)
    finder.local(local)
    if remote:
        from diagnosis.audit.discovery.remote import look_remotely

        look_remotely(finder, remote)
    found = finder.missions()
    base = {where: _common([b for b in finder.bases if _where(b) == where]) for where in map(_where, finder.bases)}
    paths = [(f"{f.folder}/{f.stem}", f"{f.folder}/{_second_name(f)}") for f in found]
    names = unique_names([(_below(stem, base[_where(stem)]), _below(path, base[_where(path)])) for stem, path in paths])
    missions = [
        MissionSource(
            name=name,
            files=tuple(e.path for e in f.files),
            bytes=sum(e.size for e in f.files),
            stamps=tuple(e.stamp for e in f.files),
            machine_id=f.told.machine_id,
            machine_file=f.told.machine,
            sizes=tuple(e.size for e in f.files),
            problem=f.problem,
            folder=f.linked,
        )
        for f, name in zip(found, names, strict=True)
    ]
    missions.sort(key=lambda m: (m.name.casefold(), m.name))
    roots, notes = dict.fromkeys(finder.roots), dict.fromkeys(finder.notes)
    return Discovery(
        tuple(missions), tuple(dict.fromkeys(finder.problems)), finder.left_aside, tuple(roots), tuple(notes)
    )


def _second_name(found: Found) -> str:
    """Name of a mission whose first one is another's too: with its ending, or what it is called and its folder's name."""
    return f"{found.told.name}-{found.home}" if found.told.name else found.files[0].name


def _where(path: str) -> str:
    """Kind of a URL; empty for local paths."""
    return path.partition("://")[0] if "://" in path else ""


def _common(bases: Sequence[str]) -> list[str]:
    """Parts of the path that all bases share."""
    parts = [base.replace(os.sep, "/").split("/") for base in bases]
    shared = min(parts, key=len, default=[])
    while any(p[: len(shared)] != shared for p in parts):
        shared = shared[:-1]
    return shared


def _below(path: str, base: Sequence[str]) -> str:
    return "/".join(path.replace(os.sep, "/").split("/")[len(base) :])
