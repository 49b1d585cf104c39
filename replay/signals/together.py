"""Tables of one drive that were written into several files, such as one per task of a PLC: ``drive_1_wheels.csv``, ``drive_1_steering.csv``.

They begin and end together, and each holds other columns; or the same ones, where each is of another wheel (`wheel_FL.csv`). Files of which
names differ in one word, and not in a number or date, may be such tables.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import NamedTuple

from replay.signals.name_parts import is_place

_APART_NS = 5 * 10**9  # by which the first and last stamps of files of one drive may differ
_TRIES = (
    3  # groups of files with the same differing words, of which one must be of one drive for the others to be looked at
)
_MOST = 40  # files of one drive
_MARKS = re.compile(r"([ _.\-]+)")


class Extent(NamedTuple):
    """When a table begins and ends [ns], and what its columns are called."""

    start_ns: int
    stop_ns: int
    columns: frozenset[str]


def are_together(extents: Sequence[Extent], words: Sequence[str] = ()) -> bool:
    """Whether tables are of one drive.

    Parameters
    ----------
    extents : Sequence[Extent]
        Of each table.
    words : Sequence[str]
        What their names differ in; empty: that is not known.
    """
    starts, stops = [e.start_ns for e in extents], [e.stop_ns for e in extents]
    if max(starts) - min(starts) > _APART_NS or max(stops) - min(stops) > _APART_NS or min(stops) <= max(starts):
        return False
    if sum(len(e.columns) for e in extents) == len(frozenset().union(*(e.columns for e in extents))):
        return all(e.columns for e in extents)
    return bool(words) and all(is_place(word.lower()) for word in words)


def tables_together(stems: Sequence[str], extent: Callable[[int], Extent | None]) -> list[tuple[str, list[int]]]:
    """Groups of tables of one drive: what their names share, and their places among the stems.

    Parameters
    ----------
    stems : Sequence[str]
        Names of tables of one folder without their endings.
    extent : Callable
        When the table of a place begins and ends; None where that cannot be read. Asked of few.
    """
    alike: dict[tuple[int, tuple[str, ...]], list[int]] = defaultdict(list)
    split = [_MARKS.split(stem) for stem in stems]
    for k, words in enumerate(split):
        for i in range(0, len(words), 2):
            if words[i] and not any(c.isdigit() for c in words[i]):
                alike[i, (*words[:i], "", *words[i + 1 :])].append(k)
    taken: set[int] = set()
    tried: dict[tuple[int, frozenset[str]], list[bool]] = defaultdict(list)
    out = []
    for (i, rest), every in sorted(alike.items(), key=lambda row: -row[0][0]):
        places = [k for k in every if k not in taken]
        words = [split[k][i] for k in places]
        results = tried[i, frozenset(words)]
        if not 1 < len(places) <= _MOST or (len(results) >= _TRIES and not any(results)):
            continue
        extents = [e for k in places if (e := extent(k)) is not None]
        results.append(len(extents) == len(places) and are_together(extents, words))
        if results[-1]:
            taken.update(places)
            out.append(("".join(rest).strip(" _.-") or "+".join(words), places))
    return out
