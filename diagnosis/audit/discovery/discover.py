"""Find the missions behind the words of a command line."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from diagnosis.audit.discovery.finder import Finder
from diagnosis.audit.discovery.mission_source import MissionSource, named_missions
from replay.log.file_types import words_of

_SHOWN = 12


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

    What one mission is says `diagnosis.audit.discovery.missions`.

    Parameters
    ----------
    words : Iterable[str]
        As typed.
    exclude : Path or None
        Folder of the audit's own results, which is not searched.
    """
    finder = Finder(os.path.realpath(exclude) if exclude is not None else "")
    local, remote = list[str](), list[str]()
    for word in dict.fromkeys(words_of(words)):
        (remote if "://" in word else local).append(word)
    finder.local(local)
    if remote:
        from diagnosis.audit.discovery.remote import find_remotely

        find_remotely(finder, remote)
    return Discovery(
        tuple(named_missions(finder.missions(), finder.bases)),
        tuple(dict.fromkeys(finder.problems)),
        finder.left_aside,
        tuple(dict.fromkeys(finder.roots)),
        tuple(dict.fromkeys([*finder.notes, *_packed(finder.packed)])),
    )


def _packed(files: Sequence[str]) -> list[str]:
    """A sentence on files that may hold logs and are none as they are."""
    if not files:
        return []
    shown = ", ".join(files[:_SHOWN]) + (f" and {len(files) - _SHOWN} more" if len(files) > _SHOWN else "")
    return [f"not looked into: {shown}; unpack what holds logs of machines, to have them audited"]
