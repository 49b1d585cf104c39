"""Files that are numbered like the parts of one recording: which go on from one to the next, and which are missing."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

from diagnosis.audit.discovery.listing import Entry, Place
from replay.log.file_types import part_of

_SHOWN = 5


def split_recordings(place: Place, files: Sequence[Entry]) -> list[tuple[str, tuple[Entry, ...]]]:
    """Stems of recordings in numbered parts, each with all of its parts."""
    out = []
    for (stem, _), numbered in _numbered(files).items():
        numbers, parts = [n for n, _ in numbered], [p for _, p in numbered]
        if len(parts) > 1 and _consecutive(numbers) and place.continuous(parts):
            out.append((stem, tuple(parts)))
    return out


def missing_parts(files: Sequence[Entry]) -> list[str]:
    """What is missing among files that are numbered from 0 like the parts of a recording, one sentence each."""
    out = []
    for (stem, ending), numbered in _numbered(files).items():
        there = {n for n, _ in numbered}
        if 0 in there and len(there) <= max(there) < 2 * len(there):
            missing = [n for n in range(max(there)) if n not in there]
            named = ", ".join(f"{stem}_{n}{ending}" for n in missing[:_SHOWN]) + (" …" if len(missing) > _SHOWN else "")
            out.append(
                f"{numbered[0][1].path}: numbered like parts of one recording, of which {named} is not there; the parts that are there are "
                "judged one by one"
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
