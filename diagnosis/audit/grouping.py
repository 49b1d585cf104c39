"""Which logs of one folder belong together: parts of a split recording, and a recording with the table beside it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.audit.listing import Entry, Place
from replay.log_files import TABLE_ENDINGS, part_of, split_ending


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


def _split(place: Place, files: Sequence[Entry]) -> list[Group]:
    """Recordings in numbered parts, each with all of its parts."""
    named: dict[tuple[str, str], list[tuple[int, Entry]]] = defaultdict(list)
    for file in files:
        part = part_of(file.name)
        if part is not None:
            named[part[0], part[2]].append((part[1], file))
    out = []
    for (stem, _), numbered in named.items():
        numbered.sort(key=lambda n: n[0])
        numbers, parts = [n for n, _ in numbered], [p for _, p in numbered]
        if len(parts) > 1 and numbers == list(range(numbers[0], numbers[-1] + 1)) and place.continuous(parts):
            out.append(Group(stem, tuple(parts)))
    return out
