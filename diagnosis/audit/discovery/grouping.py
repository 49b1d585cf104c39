"""Which logs of one folder belong together: parts of a split recording, and a recording with the table beside it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from diagnosis.audit.discovery.listing import Entry, Place
from replay.log.file_types import TABLE_ENDINGS, part_of, split_ending

_SHOWN = 5


@dataclass(frozen=True)
class Group:
    """Logs of one mission in the order in which they are read: message logs first, then tables by name."""

    stem: str
    files: tuple[Entry, ...]


def group(place: Place, files: Sequence[Entry], recordings: Sequence[Entry] = ()) -> list[Group]:
    """Group the logs of one folder into missions.

    Parameters
    ----------
    place : Place
        Where they are.
    files : Sequence[Entry]
        Log files.
    recordings : Sequence[Entry]
        Folders that are one recording each.

    Returns
    -------
    list[Group]
        Numbered parts are one recording where each goes on where the one before ended. Tables with a recording's stem
        are part of its mission where it is the only recording of that stem.
    """
    recorded: list[Group] = [Group(folder.name, (folder,)) for folder in recordings]
    split = _split(place, [f for f in files if split_ending(f.name)[1] not in TABLE_ENDINGS])
    recorded += split
    parts = {f.path for g in split for f in g.files}
    tables: dict[str, list[Entry]] = defaultdict(list)
    for file in files:
        stem, ending = split_ending(file.name)
        if ending in TABLE_ENDINGS:
            tables[stem].append(file)
        elif file.path not in parts:
            recorded.append(Group(stem, (file,)))
    count: dict[str, int] = defaultdict(int)
    for found in recorded:
        count[found.stem] += 1
    out = []
    for found in recorded:
        beside = tables.pop(found.stem, []) if count[found.stem] == 1 else []
        out.append(Group(found.stem, (*found.files, *beside)))
    out += [Group(stem, (table,)) for stem, alone in tables.items() for table in alone]
    return out


def holes(files: Sequence[Entry]) -> list[str]:
    """What is missing among files that are numbered from 0 like the parts of a recording, one sentence each."""
    out = []
    for (stem, ending), numbered in _numbered(files).items():
        there = {n for n, _ in numbered}
        if 0 in there and len(there) <= max(there) < 2 * len(there):
            missing = [n for n in range(max(there)) if n not in there]
            named = ", ".join(f"{stem}_{n}{ending}" for n in missing[:_SHOWN]) + (" …" if len(missing) > _SHOWN else "")
            out.append(
                f"{numbered[0][1].path}: numbered like parts of one recording, of which {named} is not there; what is there is "
                "judged part by part"
            )
    return out


def _numbered(files: Sequence[Entry]) -> dict[tuple[str, str], list[tuple[int, Entry]]]:
    """Files by stem and ending, with their numbers, in their order."""
    named: dict[tuple[str, str], list[tuple[int, Entry]]] = defaultdict(list)
    for file in files:
        part = part_of(file.name)
        if part is not None:
            named[part[0], part[2]].append((part[1], file))
    for numbered in named.values():
        numbered.sort(key=lambda n: n[0])
    return named


def _consecutive(numbers: Sequence[int]) -> bool:
    return all(b == a + 1 for a, b in pairwise(numbers))


def _split(place: Place, files: Sequence[Entry]) -> list[Group]:
    """Recordings in numbered parts, each with all of its parts."""
    out = []
    for (stem, _), numbered in _numbered(files).items():
        numbers, parts = [n for n, _ in numbered], [p for _, p in numbered]
        if len(parts) > 1 and _consecutive(numbers) and place.continuous(parts):
            out.append(Group(stem, tuple(parts)))
    return out
