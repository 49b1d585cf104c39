"""The value of a signal at each step of the axis: its latest sample, as long as that stands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import release
from replay.arrays.column_store import ColumnStore
from replay.arrays.compiling import njit
from replay.signals.publishing import Standing
from replay.signals.signal import Signal

#: What is larger is no sample.
LARGEST = 1e9
_HOLD_PERIODS = 2.5
_COMMAND_HOLD_NS = 500_000_000
_BREAK_S = 1.0  # without anything: a command may have changed meanwhile


def usual_hold(name: str, period: int, step: int) -> float:
    """How long a sample of a signal stands [ns], where its sender comes regularly; `period` and `step` [ns]."""
    longest = max(_HOLD_PERIODS * period, 1.5 * step)
    command = name.startswith("cmd.") or name.endswith("_ref")
    return max(longest, float(_COMMAND_HOLD_NS)) if command else longest


def held(
    signal: Signal, standing: Standing, start: int, step: int, size: int, store: ColumnStore
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Latest sample at each step (half a step of tolerance), NaN once older than its holding time.

    Parameters
    ----------
    signal : Signal
        At its own stamps.
    standing : Standing
        How long its samples stand.
    start, step : int
        First step and distance of steps [ns].
    size : int
        Number of steps n.
    store : ColumnStore
        Where the columns go.

    Returns
    -------
    tuple[NDArray[np.float64], NDArray[np.bool_]], each of shape (n,)
        Values, and whether a new sample arrived in the step.
    """
    values, fresh = store.column(np.float64, rows=size), store.column(np.bool_, rows=size)
    at = -1
    for part in store.blocks(size):
        known, new = np.empty(part.stop - part.start), np.empty(part.stop - part.start, np.bool_)
        begin = start + part.start * step
        at = _scan_hold(
            signal.stamps,
            signal.values,
            standing.ends_ns,
            begin,
            step,
            float(standing.hold_ns),
            LARGEST,
            at,
            known,
            new,
        )
        values.append(known)
        fresh.append(new)
        release(signal.values, signal.stamps)
    return values.finish(), fresh.finish()


@njit(cache=True)
def _scan_hold(stamps, values, ends, start, step, longest, largest, at, known, fresh):  # type: ignore[no-untyped-def]
    """Walk along both axes; `at` is the newest sample at the step before, and is returned for the next one."""
    end = 0
    for k in range(known.size):
        time, before = start + k * step, at
        while at + 1 < stamps.size and stamps[at + 1] <= time + step // 2:
            at += 1
        known[k] = np.nan
        if at >= 0:
            while end < ends.size and ends[end] < stamps[at]:
                end += 1
            over = end < ends.size and ends[end] < time
            if time - stamps[at] <= longest and not over and abs(values[at]) <= largest:
                known[k] = values[at]
        fresh[k] = at != before and known[k] == known[k]
    return at


def breaks(fresh: Sequence[NDArray[np.bool_]], start: int, step: int, store: ColumnStore) -> NDArray[np.int64]:
    """When nothing at all was recorded for long [ns]: the first moment of each such time, rising.

    Parameters
    ----------
    fresh : Sequence[NDArray[np.bool_]], each of shape (n,)
        Steps with new samples, of every signal that comes by itself.
    start, step : int
        First step and distance of steps [ns].
    store : ColumnStore
        Where the columns stand.

    Returns
    -------
    NDArray[np.int64], shape (k,)
    """
    found, last = np.empty(0, np.int64), -1
    for part in store.blocks(fresh[0].size) if fresh else ():
        seen = np.flatnonzero(np.logical_or.reduce([f[part] for f in fresh])) + part.start
        seen = np.r_[last, seen]
        found = np.r_[found, seen[:-1][np.diff(seen) * step > _BREAK_S * 1e9]]
        last = int(seen[-1])
    moments: NDArray[np.int64] = start + (found + 1) * step
    return moments
