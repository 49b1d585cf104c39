"""Faults of a stamp clock that a second clock proves: counters that start again, steps, single stamps gone astray.

`lead` is the stamp clock minus the second clock (header − log). A step of the lead alone does not tell which of the two
jumped: that one did whose own distance to the neighbouring stamp is unusual there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks

Stamps = NDArray[np.int64]

_FAR = 2**62
_COUNTERS = (2**32, 2**32 * 1000)  # 32 bits of nanoseconds and of microseconds [ns]
_COUNTER_SLACK_NS = 500_000_000
_LEAST_NS = 50_000_000
_DRIFT_NS = 1_000_000
_SIDE = 25
_FEWEST = 5
_MOST = 200
_WHOLE_NS = 1_800_000_000_000  # time zones differ by half hours
_NEAR_WHOLE_NS = 250_000_000
_STRAY_NS = 1_000_000_000
_BLOCK = 64


@dataclass(frozen=True)
class Step:
    """A jump of one clock against the other: from row `at` on the lead is `size` ns larger."""

    at: int
    size: int


def lead_of(stamps: Stamps, other: Stamps) -> Stamps:
    """Lead of the stamps [ns]; stamps beyond the year 2116 count as that, so that it fits 64 bits.

    All of shape (n,).
    """
    lead: Stamps = np.clip(stamps, -_FAR, _FAR) - np.clip(other, -_FAR, _FAR)
    return lead


def steady(stamps: Stamps, other: Stamps) -> bool:
    """Whether the lead stays within 50 ms, so that nothing is to be repaired. Both of shape (n,) [ns]."""
    low, high = [], []
    for rows in blocks(len(stamps)):
        lead = lead_of(stamps[rows], other[rows])
        low.append(int(lead.min()))
        high.append(int(lead.max()))
    return max(high) - min(low) < _LEAST_NS


def unwrapped(stamps: Stamps, other: Stamps) -> tuple[Stamps, int, int]:
    """Continue a 32-bit counter over its wraps.

    Both of shape (n,).

    Returns
    -------
    tuple[NDArray[np.int64], int, int]
        Stamps, number of wraps, and the counter's span [ns]; 0 wraps where it is none.
    """
    if len(stamps) > 1 and int(stamps.min()) >= 0:
        change = np.diff(lead_of(stamps, other))
        for span in _COUNTERS:
            turns = np.rint(-change / span).astype(np.int64)
            turned = turns != 0
            rest = np.abs(change[turned] + turns[turned] * span)
            if turned.any() and int(stamps.max()) < span and (turns >= 0).all() and rest.max() < _COUNTER_SLACK_NS:
                total = np.append(0, np.cumsum(turns))
                return stamps + total * span, int(total[-1]), span
    return stamps, 0, 0


def usual_step(stamps: Stamps) -> float:
    """Median distance of stamps that rise [ns]. Of shape (n,)."""
    steps = np.diff(stamps)
    rising = steps[steps > 0]
    return float(np.median(rising)) if len(rising) else 0.0


def find_steps(stamps: Stamps, other: Stamps) -> tuple[list[Step], list[Step]]:
    """Lasting jumps of the stamp clock, and of the second clock.

    A jump counts where the lead before and after it is steady and differs by more than 50 ms and more than it scatters.

    Both of shape (n,) [ns].
    """
    lead = lead_of(stamps, other)
    change = np.diff(lead)
    if len(lead) < 2 * _FEWEST:
        return [], []
    limit = max(_LEAST_NS, 8 * 1.4826 * float(np.median(np.abs(change))))
    places = np.flatnonzero(np.abs(change) > limit) + 1
    if len(places) > _MOST:
        places = np.sort(places[np.argsort(-np.abs(change[places - 1]), kind="stable")[:_MOST]])
    usual = usual_step(stamps), usual_step(other)
    mine: list[Step] = []
    theirs: list[Step] = []
    for k in places.tolist():
        if not _FEWEST <= k <= len(lead) - _FEWEST:
            continue
        near = lead[max(0, k - _SIDE) : k + _SIDE] - lead[k - 1]  # small numbers keep their nanoseconds
        before, after = near[: min(k, _SIDE)], near[min(k, _SIDE) :]
        low, high = float(np.median(before)), float(np.median(after))
        drift = float(np.median(np.delete(change[max(0, k - _SIDE) : k + _SIDE - 1], min(k, _SIDE) - 1)))
        drift *= 0.5 * (len(before) + len(after))
        size = high - low - (drift if abs(drift) > _DRIFT_NS else 0.0)
        scatter = max(float(np.median(np.abs(before - low))), float(np.median(np.abs(after - high))))
        if abs(size) < max(limit, 6 * scatter) or abs(size - change[k - 1]) > 0.3 * abs(size):
            continue
        odd = [abs(int(s[k]) - int(s[k - 1]) - u) for s, u in zip((stamps, other), usual, strict=True)]
        whole = round(size / _WHOLE_NS) * _WHOLE_NS
        step = Step(k, int(whole if whole and abs(size - whole) < _NEAR_WHOLE_NS else round(size)))
        if odd[0] >= 0.5 * abs(size) > odd[1]:
            mine.append(step)
        elif odd[1] >= 0.5 * abs(size) > odd[0]:
            theirs.append(Step(k, -step.size))
    return mine, theirs


def without_steps(stamps: Stamps, steps: list[Step], lead: Stamps) -> Stamps:
    """Take steps out; the part whose lead is nearest to none stays, where none is near the longest.

    `stamps`, `lead` and the result of shape (n,) [ns].
    """
    edges = [0, *(s.at for s in steps), len(stamps)]
    offset = np.cumsum([0, *(s.size for s in steps)])
    level = np.array([abs(float(np.median(lead[a:b]))) for a, b in pairwise(edges)])
    kept = int(np.argmin(level)) if level.min() < _STRAY_NS else int(np.argmax(np.diff(edges)))
    shift = np.repeat(offset - offset[kept], np.diff(edges))
    moved: Stamps = stamps - shift
    return moved


def strays(stamps: Stamps, other: Stamps) -> tuple[NDArray[np.bool_], Stamps]:
    """Single stamps that leave the course of the others.

    All of shape (n,) [ns].

    Returns
    -------
    tuple[NDArray[np.bool_], NDArray[np.int64]]
        Which stamps these are, and what the second clock would have given each row.
    """
    lead = lead_of(stamps, other)
    size = len(lead)
    count = max(1, size // _BLOCK)
    length = size // count
    middle = np.median(lead[: count * length].reshape(count, length), axis=1)
    course = np.interp(np.arange(size), np.arange(count) * length + 0.5 * (length - 1), middle)
    expected: Stamps = other + np.rint(course).astype(np.int64)
    off = lead - course
    limit = max(_STRAY_NS, 20 * usual_step(stamps), 15 * float(np.median(np.abs(off))))
    far = np.abs(off) > limit
    if not far.any():
        return far, expected
    # A message that was only received late keeps its place among its neighbours' stamps.
    before = np.maximum.accumulate(np.append(expected[0], stamps[:-1]))
    after = np.minimum.accumulate(np.append(stamps[1:], expected[-1])[::-1])[::-1]
    return far & ((stamps < before - limit) | (stamps > after + limit)), expected
