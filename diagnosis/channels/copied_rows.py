"""Rows that a logger repeats as a whole: speeds, efforts and commands of one source that stand still together are no data."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.arrays.numeric import without_nan
from replay.signals.signal import quantity_kind
from replay.signals.timeline import Timeline

_LEAST_S, _LEAST_ROWS = 1.0, 10
_BEYOND = 3.0  # times longer than the source's own longest repeats
_MOST = 0.25  # of the moving time: what is more common is the source's habit
_ONCE = 0.5  # the same of a single time, which is none
_ZERO, _EXTREME = 0.02, 0.98  # of a channel's largest value: what stands there may well stand still
_CHANNELS = 2  # that must stand still at a value of their own
_MOVING = ("v", "v_true", "u", "u_applied", "effort", "phi")
_HELD_ALONG = re.compile(
    r"steer\..*\.u"
)  # an axle is held at its angle by a gain alone: a sensor that is held holds its command, too
Span = tuple[int, int]


def without_copied_rows(timeline: Timeline) -> Timeline:
    """A timeline without samples where a source repeats its rows as a whole; the same one where none does.

    A drive's controller never holds its effort to the last digit while the speed stands still at a value too: such rows
    are the logger's. Where only one channel repeats itself, or an axle's angle with its command, a sensor may be stuck, and nothing is removed.
    """
    signals, fresh = dict(timeline.signals), dict(timeline.fresh)
    notes = list(timeline.notes)
    for names in _sources(timeline):
        spans = copied_rows(timeline, names)
        if not spans:
            continue
        for name in names:
            values, new = np.array(signals[name]), np.array(fresh[name])
            for start, stop in spans:
                values[start:stop], new[start:stop] = np.nan, False
            signals[name], fresh[name] = values, new
        longest = max(spans, key=lambda s: s[1] - s[0])
        notes.append(
            f"{len(spans)} time{'s' if len(spans) > 1 else ''} all of {_listed(names)} repeated the same values, for "
            f"{sum(b - a for a, b in spans) * timeline.dt:.1f} s together (longest {longest[0] * timeline.dt:.1f}–"
            f"{longest[1] * timeline.dt:.1f} s): copied rows, taken as no data."
        )
    return (
        timeline
        if len(notes) == len(timeline.notes)
        else replace(timeline, signals=signals, fresh=fresh, notes=tuple(notes))
    )


def copied_rows(timeline: Timeline, names: Sequence[str]) -> list[Span]:
    """Steps [start, stop) in which channels of one source repeat themselves together beyond the source's habit.

    Parameters
    ----------
    timeline : Timeline
        The mission.
    names : Sequence[str]
        Channels of one source.
    """
    telling = [n for n in names if n.rsplit(".", 1)[-1] in _MOVING and not _HELD_ALONG.fullmatch(n)]
    moving = [n for n in telling if not np.isnan(timeline.signals[n]).all()]
    if len(moving) < _CHANNELS:
        return []
    changes = np.flatnonzero(_changed(timeline, names))
    if changes.size < _LEAST_ROWS:
        return []
    start, stop = changes, np.r_[changes[1:], timeline.size]
    top = {n: float(np.nanmax(np.abs(timeline.signals[n]))) for n in moving}
    standing = np.zeros(start.size)
    for n in moving:
        size = np.abs(without_nan(timeline.signals[n][start]))
        standing += (size > _ZERO * top[n]) & (size < _EXTREME * top[n])
    use = standing >= _CHANNELS
    order = np.flatnonzero(use)[np.argsort((start - stop)[use], kind="stable")]
    length = (stop - start)[order]
    rows = max(timeline.periods_ns.get(n, 0) for n in moving) // timeline.step_ns * _LEAST_ROWS
    long = length >= max(_LEAST_S / timeline.dt, rows)
    alone = length > _BEYOND * np.r_[length[1:], 0]
    share = np.cumsum(length) / max(int(length.sum()), 1)
    rare = (share <= _MOST) | ((np.arange(length.size) == 0) & (share <= _ONCE))
    taken = np.flatnonzero(long & alone & rare)
    if not taken.size:
        return []
    period = max(1, max(timeline.periods_ns.get(n, 0) for n in moving) // timeline.step_ns)
    kept = np.sort(order[: int(taken[-1]) + 1])
    return [(int(start[k]) + period, int(stop[k])) for k in kept]


def _changed(timeline: Timeline, names: Sequence[str]) -> NDArray[np.bool_]:
    """Steps in which any of some channels differs from the step before, shape (n,)."""
    out = np.zeros(timeline.size, np.bool_)
    for part in timeline.blocks():
        first = max(part.start - 1, 0)
        for name in names:
            x = timeline.signals[name][first : part.stop]
            both = np.isnan(x[1:]) & np.isnan(x[:-1])
            out[first + 1 : part.stop] |= (x[1:] != x[:-1]) & ~both
    out[:1] = True
    return out


def _sources(timeline: Timeline) -> list[list[str]]:
    """Names of the channels of each source that logs wheels or steering."""
    found: dict[str, list[str]] = {}
    for name in timeline.signals:
        if name == "imu.acceleration":  # of another device, whose readings go on where rows of the drives are copied
            continue
        source = timeline.groups.get(name, timeline.sources.get(name, ""))
        found.setdefault(source.removesuffix(quantity_kind(name)), []).append(name)  # a table's rows are one source
    return [names for names in found.values() if any(n.startswith(("wheel.", "steer.")) for n in names)]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
