"""Stamps of one file that contradict the order in which it was written; no second clock is needed to see it.

Rows of a table, and messages whose clocks were all set together, stand in the file in the order in which they were
recorded. Stamps that leave the course of their neighbours and come back are wrong by themselves; where stamps fall back
for good, the clock was set back, and time goes on from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.arrays.quantiles import median_of
from replay.log.raw_log import Channel, RawLog
from replay.number_words import told

Stamps = NDArray[np.int64]

_LEAST_NS = 50_000_000
_LEAST_MESSAGES_NS = 1_000_000_000
_LEAST_PERIODS = 20
_PAUSE_NS = 600_000_000_000
_LONGEST_NS = 86_400_000_000_000
_SIDE = 5
_SAMPLE = 20_000
_MOST = 100
_MOST_STRAYS = 0.05
_WHOLE_NS = 1_800_000_000_000
_NEAR_WHOLE = 0.01
_AT_ONCE = 0.02  # of the mean distance
_PART = 1 << 15  # stamps that stay in the processor's cache while they are compared


@dataclass
class _Course:
    """One array of stamps: which rows are kept, and what they become."""

    stamps: Stamps
    kept: NDArray[np.bool_]
    notes: list[str]
    damage: list[str]
    span: tuple[int, int] | None = None


def in_order(log: RawLog) -> RawLog:
    """Put the stamps of each table or topic into the order of its rows, or leave out what cannot be placed.

    Parameters
    ----------
    log : RawLog
        As read.

    Returns
    -------
    RawLog
        The same where all is well; else with a sentence per case in ``summary.notes``, and in ``summary.damage`` where
        samples were left out.
    """
    arrays: dict[int, tuple[str, Stamps, bool]] = {}
    for name, channel in log.channels.items():
        arrays.setdefault(id(channel.stamps), (channel.topic or _place(log, name), channel.stamps, not channel.topic))
    courses: dict[int, _Course] = {}
    span: tuple[int, int] | None = None  # of parts days apart the whole log keeps the one that its longest array keeps
    for key, array in sorted(arrays.items(), key=lambda item: -len(item[1][1])):
        course = _course(*array, span)
        if course is not None:
            courses[key] = course
            span = span or course.span
    if not courses:
        return log
    channels: dict[str, Channel] = {}
    new = {key: c.stamps[c.kept] for key, c in courses.items()}
    for name, channel in log.channels.items():
        own = courses.get(id(channel.stamps))
        if own is not None:
            values = channel.values if own.kept.all() else channel.values[own.kept]
            channel = replace(channel, stamps=new[id(channel.stamps)], values=values)
        channels[name] = channel
    notes = tuple(dict.fromkeys((*log.summary.notes, *(n for c in courses.values() for n in c.notes))))
    damage = tuple(dict.fromkeys((*log.summary.damage, *(d for c in courses.values() for d in c.damage))))
    return replace(log, channels=channels, summary=replace(log.summary, notes=notes, damage=damage))


def _place(log: RawLog, name: str) -> str:
    groups = [t for t in log.summary.topics if name in t.fields]
    file = PurePath(log.source).name
    return f"{file}, {groups[0].name}" if groups and groups[0].name != file else file


def _course(label: str, stamps: Stamps, rows_in_order: bool, span: tuple[int, int] | None) -> _Course | None:
    """Repair one array of stamps; None where nothing is wrong.

    Rows of a table stand in the order in which they were written. Messages may not (chunks of several threads, joined
    logs): what sorting them explains is left to it.
    """
    if len(stamps) < 2 * _SIDE:
        return None
    usual = _usual(stamps)
    limit = max(_LEAST_NS if rows_in_order else _LEAST_MESSAGES_NS, round(_LEAST_PERIODS * usual))
    if not usual or not _leaves_order(stamps, limit):
        return None
    course = _Course(stamps, np.ones(len(stamps), np.bool_), [], [])
    _leave_out_strays(course, label, limit, rows_in_order)
    rows = np.flatnonzero(course.kept)
    own = course.stamps[rows]
    steps = np.diff(np.clip(own, -(2**62), 2**62))
    back = np.flatnonzero(steps < -limit) + 1
    if not rows_in_order and 0 < len(back) <= _MOST:
        back = np.array([k for k in back.tolist() if _twice(own, k, back)], np.int64)
    if len(back) > _MOST or float(np.abs(steps[back - 1].astype(np.float64)).sum()) > 2.0**61:
        course.notes.append(f"{label}: its stamps run backwards {len(back)} times; they were sorted")
    elif len(back):
        own = _continued(own, back, usual)
        sizes = ", ".join(f"by {_seconds(float(steps[k - 1]) - usual)}" for k in back[:3])
        course.notes.append(
            f"{label}: its clock was set back {'once' if len(back) == 1 else f'{len(back)} times'} ({sizes}) while it was "
            "recorded; the rows after it follow the rows before it, one usual period later"
        )
        course.stamps = course.stamps.copy()
        course.stamps[rows] = own
    _part(course, label, limit, span)
    return course if course.notes or course.damage else None


def _usual(stamps: Stamps) -> float:
    """Median distance of stamps that rise, over some of them; 0 where none do [ns]."""
    parts = [stamps[k : k + _SAMPLE] for k in range(0, len(stamps), max(_SAMPLE, len(stamps) // 8))]
    steps = np.concatenate([np.diff(np.clip(p, -(2**62), 2**62)) for p in parts])
    rising = steps[steps > 0]
    return float(median_of(rising)) if len(rising) else 0.0


def _leaves_order(stamps: Stamps, limit: int) -> bool:
    """Whether stamps fall back by more than the limit, or jump ahead by ten minutes."""
    for rows in blocks(len(stamps)):
        steps = np.diff(np.clip(stamps[rows.start : rows.stop + 1], -(2**62), 2**62))
        if len(steps) and (int(steps.min()) < -limit or int(steps.max()) > max(limit, _PAUSE_NS)):
            return True
    return False


def _twice(stamps: Stamps, at: int, back: NDArray[np.int64]) -> bool:
    """Whether the part from a row on covers time that the rows before it cover too."""
    later = back[back > at]
    part = stamps[at : int(later[0]) if len(later) else len(stamps)]
    inside = np.count_nonzero((stamps[:at] >= part.min()) & (stamps[:at] <= part.max()))
    return bool(inside > 0.3 * min(len(part), at))


def _leave_out_strays(course: _Course, label: str, limit: int, rows_in_order: bool) -> None:
    """Drop few stamps that leave the course of their neighbours and come back."""
    stamps = np.clip(course.stamps, -(2**62), 2**62)
    jumps = np.flatnonzero(np.abs(np.diff(stamps)) > limit) + 1
    if len(jumps) > max(2 * _MOST, _MOST_STRAYS * len(stamps)):
        return
    edges = [0, *jumps.tolist(), len(stamps)]
    level = -np.inf
    out: list[tuple[int, int]] = []
    for i, (first, last) in enumerate(pairwise(edges)):
        if last - first > _SIDE:
            level = float(stamps[last - 1])
            continue
        # A short run is astray where it does not lie between the long ones around it, or lies days from them.
        after = next((float(stamps[a]) for a, b in pairwise(edges[i + 1 :]) if b - a > _SIDE), np.inf)
        start, stop = float(stamps[first]), float(stamps[last - 1])
        if (
            not level <= start <= stop <= after
            or _LONGEST_NS < start - level < np.inf
            or _LONGEST_NS < after - stop < np.inf
        ):
            out.append((first, last))
    if not rows_in_order:
        long = [stamps[a:b] for a, b in pairwise(edges) if b - a > _SIDE]
        low, high = min((int(p.min()) for p in long), default=0), max((int(p.max()) for p in long), default=0)
        out = [(a, b) for a, b in out if stamps[a] < low - limit or stamps[b - 1] > high + limit]
    rows = [k for first, last in out for k in range(first, last)]
    if not rows:
        return
    course.kept[rows] = False
    worst = np.datetime64(int(np.clip(course.stamps[rows[0]], -(2**62), 2**62)), "ns")
    course.damage.append(
        f"{label}: {len(rows)} of {len(stamps)} stamps are far from their neighbours' (row {rows[0] + 1}: {worst}); these "
        "samples cannot be placed and were left out"
    )


def _continued(stamps: Stamps, back: NDArray[np.int64], usual: float) -> Stamps:
    """Let time go on where it was set back."""
    shift = np.zeros(len(stamps), np.int64)
    for k in back.tolist():
        size = int(stamps[k - 1]) - int(stamps[k]) + round(usual)
        whole = round(size / _WHOLE_NS) * _WHOLE_NS
        if whole and abs(size - whole) < _NEAR_WHOLE * _WHOLE_NS and int(stamps[k]) + whole > int(stamps[k - 1]):
            size = whole  # a change of time zone is exact
        shift[k:] += size
    moved: Stamps = stamps + shift
    return moved


def _part(course: _Course, label: str, limit: int, span: tuple[int, int] | None) -> None:
    """Say where stamps jump ahead; of parts a day and more apart only the one with most samples is kept."""
    rows = np.flatnonzero(course.kept)
    own = course.stamps[rows]
    steps = np.diff(np.clip(own, -(2**62), 2**62))
    ahead = np.flatnonzero(steps > max(limit, _PAUSE_NS)) + 1
    if not len(ahead):
        return
    far = ahead[steps[ahead - 1] > _LONGEST_NS]
    if len(far):
        if span is None:
            edges = np.array([0, *far.tolist(), len(own)])
            best = int(np.argmax(np.diff(edges)))
            part = own[edges[best] : edges[best + 1]]
            span = course.span = (int(part.min()), int(part.max()))
        lost = (own < span[0] - _LONGEST_NS) | (own > span[1] + _LONGEST_NS)
        course.kept[rows[lost]] = False
        course.damage.append(
            f"{label}: its stamps jump ahead by {_seconds(float(steps[far[0] - 1]))}, more than a recording pauses; the "
            f"{lost.sum()} samples on the other side of such jumps cannot be placed and were left out"
        )
        return
    sizes = ", ".join(_seconds(float(steps[k - 1])) for k in ahead[:3])
    course.notes.append(
        f"{label}: its stamps jump ahead ({sizes}): the recording paused or its clock was set, which cannot be distinguished; "
        "they are kept"
    )


def _seconds(ns: float) -> str:
    return f"{told(ns / 86_400e9, '+.1f')} days" if abs(ns) > 2 * 86_400e9 else f"{told(ns / 1e9, '+.3f')} s"


def spread_ticks(stamps: Stamps, values: Sequence[object] | NDArray[np.generic]) -> tuple[Stamps, int] | None:
    """Spread samples over the ticks of a coarse clock, or of a gateway that hands several on at once.

    Parameters
    ----------
    stamps : NDArray[np.int64], shape (n,)
        Rising [ns].
    values : NDArray, shape (n,)
        Their values; repeated messages hold equal ones.

    Returns
    -------
    tuple[NDArray[np.int64], int] or None
        Stamps, and the clock's tick [ns]; None where equal stamps are too few, or their samples mostly the same.
    """
    if len(stamps) < 10:
        return None
    at_once = _AT_ONCE * float(stamps[-1] - stamps[0]) / len(stamps)  # a gateway hands bunches on in some µs
    parts = (np.diff(stamps[rows.start : rows.stop + 1]) <= at_once for rows in blocks(len(stamps), rows=_PART))
    if sum(int(np.count_nonzero(part)) for part in parts) / (len(stamps) - 1) < 0.3:
        return None
    equal = np.diff(stamps) <= at_once
    x = np.asarray(values)
    apart = np.diff(stamps) > 0  # one message twice has one stamp; a gateway also hands on what a slow node says again
    if ((x[1:] != x[:-1]) | apart)[equal].mean() < 0.3:
        return None
    first = np.flatnonzero(np.append(True, ~equal))
    count = np.diff(np.append(first, len(stamps)))
    if len(first) < 3:
        return None
    ticks = np.diff(stamps[first])
    tick = int(median_of(ticks))
    usual = float(median_of(count))
    room = np.append(np.minimum(ticks, tick), tick)  # a tick without samples before the next is a gap
    share = np.arange(len(stamps)) - np.repeat(first, count)
    width = room / np.maximum(count, 1.0)
    width[[0, -1]] = tick / max(usual, float(count[0]), 1.0), tick / max(usual, float(count[-1]), 1.0)
    late = np.zeros(len(first))
    late[0] = max(0.0, tick - count[0] * width[0])  # the first tick was entered in its course
    if np.any(np.diff(stamps)[equal]):
        late -= tick  # a gateway hands on what came before
    out: Stamps = np.repeat(stamps[first], count) + np.floor(
        share * np.repeat(width, count) + np.repeat(late, count)
    ).astype(np.int64)
    return out, tick
