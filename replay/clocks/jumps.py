"""Places where one of two clocks may have been set: every sample of a file pauses there, or its clock jumps.

Stamps alone do not tell a recording that paused from a clock that was set ahead. The signals of both sides do: they follow the
other file under one shift, or under two that differ by the pause. Where no stamp pauses (a clock set back that was repaired)
whole stretches that agree under another shift tell.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.clocks.correlation import match
from replay.clocks.shared_series import Series, Shared
from replay.clocks.windows import Line
from replay.number_words import told
from replay.signals.signal import Signal

Array = NDArray[np.float64]

_LEAST_S = 0.012
_PERIODS = 2.5
_MOST = 24
_SIDES_S = (20.0, 80.0, 400.0)
_MOST_SAMPLES = 8000
_SHIFTS = np.arange(-1.5, 1.51, 0.125)  # of a pause
_SURE = 4.0
_CHANCES_PER_S = 10.0
_MOST_OF_ONE = 8.0
_LEAST_LOSS = 1e-4
_WINDOW_S = 4.0
_WIDENED_S = 0.1
_DOUBTED = 6.0
_HABIT = 3
_STRETCH_S = 10.0
_MOST_STRETCHES = 12
_SEARCH_S = 8.0
_STEP_S = 0.3
_CORRELATION = 0.75


@dataclass(frozen=True)
class Pause:
    """Where a file holds no sample for longer than usual.

    Attributes
    ----------
    at_s : float
        Its middle [s of the other file].
    size_s : float
        By how much it exceeds the usual distance of samples [s].
    step_s : float
        Change of the lag if it is no pause but a clock that was set [s].
    """

    at_s: float
    size_s: float
    step_s: float


def pauses(
    reference: Mapping[str, Signal], other: Mapping[str, Signal], origins: tuple[int, int], line: Line
) -> list[Pause]:
    """The largest pauses of either file within the time that both cover.

    Parameters
    ----------
    reference, other : Mapping[str, Signal]
        All signals of the two files.
    origins : tuple[int, int]
        Zero of time of the two files [ns].
    line : Line
        How their clocks relate.
    """
    found = [Pause(at, size, -size) for at, size in _gaps(other.values(), origins[1])]
    for at, size in _gaps(reference.values(), origins[0]):
        found.append(Pause(at - float(line.lag(np.array([at - line.lag_s]))[0]), size, size))
    return sorted(found, key=lambda p: -p.size_s)[:_MOST]


def _gaps(signals: Iterable[Signal], origin: int) -> list[tuple[float, float]]:
    """Middles and sizes [s] of what no signal of a file has samples in."""
    items = sorted((s for s in signals if len(s.stamps) > 1), key=lambda s: -len(s.stamps))
    if not items:
        return []
    dense = items[0].stamps
    usual = float(np.median(np.diff(dense[: 1 << 20])))
    least = max(_LEAST_S * 1e9, _PERIODS * usual)
    ends: list[tuple[int, int]] = []
    for rows in blocks(len(dense)):
        stamps = dense[rows.start : rows.stop + 1]
        wide = np.flatnonzero(np.diff(stamps) > least)
        ends += zip(stamps[wide].tolist(), stamps[wide + 1].tolist(), strict=True)
    ends = sorted(ends, key=lambda e: e[0] - e[1])[: 4 * _MOST]
    for signal in items[1:]:
        ends = [
            e for e in ends if np.searchsorted(signal.stamps, e[0], "right") == np.searchsorted(signal.stamps, e[1])
        ]
    return [((0.5 * (a + b) - origin) * 1e-9, (b - a - usual) * 1e-9) for a, b in ends]


def jumps(shared: Sequence[Shared], line: Line, found: Sequence[Pause]) -> tuple[str, float]:
    """Say where a clock jumps or may have jumped.

    Parameters
    ----------
    shared : Sequence[Shared]
        Quantities in both files.
    line : Line
        How their clocks relate if neither jumps.
    found : Sequence[Pause]
        Pauses of either file.

    Returns
    -------
    tuple[str, float]
        Why the line does not hold everywhere, else empty; how far it may be off beyond its bound [s].
    """
    start = min(float(s.other.t[0]) for s in shared)
    proven: list[Pause] = []
    unknown: list[Pause] = []
    doubted_s = 0.0
    for pause in found:
        evidence = 0.0
        for side in _SIDES_S:
            evidence = _evidence(shared, line, pause, side)
            if abs(evidence) > _SURE:
                break
        if evidence > _SURE:
            where = f"{pause.at_s - start:.0f} s after its start"
            return f"its clock jumps by {told(-pause.step_s, '+.3f')} s against the other, {where}", 0.0
        if evidence > -_SURE:
            unknown.append(pause)
            continue
        proven.append(pause)
        if pause.size_s < _DOUBTED * float(line.bound(np.array([pause.at_s]))[0]):
            doubted_s = max(doubted_s, pause.size_s)  # a line that is hardly better than the pause may lie between two
    unknown = [p for p in unknown if sum(_alike(p, q) for q in proven) < _HABIT]
    open_s = sum(p.size_s for p in unknown)
    if open_s > _WIDENED_S:
        return (
            f"no sample is recorded for {unknown[0].size_s:.3g} s, {unknown[0].at_s - start:.0f} s after its start, and no moving "
            "signal distinguishes a pause of the recording from a clock that was set"
        ), 0.0
    return _elsewhere(shared, line), open_s + doubted_s


def _alike(pause: Pause, proven: Pause) -> bool:
    """Whether the same file paused as long elsewhere, so that it is known to lose samples."""
    return pause.step_s * proven.step_s > 0 and pause.size_s < 2.0 * proven.size_s


def widened(line: Line, more: float, length: float) -> Line:
    """Return the line with a bound that is wider by `more` seconds over the whole of a file of that length [s]."""
    bound = float(line.bound(np.array([0.0, length])).max())
    variance = more * (more + 2 * bound) / 1.96**2
    return replace(line, covariance=line.covariance + np.diag([variance, 0.0]))


def _evidence(shared: Sequence[Shared], line: Line, pause: Pause, side: float) -> float:
    """How much likelier [nats] two shifts, the pause apart, are than one shift for both sides of it."""
    profiles = []
    half = 0.5 * pause.size_s + 1e-9
    for first, last in ((pause.at_s - side, pause.at_s - half), (pause.at_s + half, pause.at_s + side)):
        rows = [_likelihood(s, line, (first, last), _SHIFTS * pause.size_s) for s in shared]
        profiles.append(np.sum(rows, axis=0))
    before, after = profiles
    step = round(1.0 / float(_SHIFTS[1] - _SHIFTS[0])) * (1 if pause.step_s > 0 else -1)
    both = before + after
    apart = before[:-step] + after[step:] if step > 0 else before[-step:] + after[:step]
    return float(apart.max() - both.max())


def _likelihood(shared: Shared, line: Line, span: tuple[float, float], shifts: Array) -> Array:
    """Logarithm of the likelihood of a stretch under shifts from the line, up to a constant."""
    other = shared.other.within(*span)
    if len(other.t) < 20:
        return np.zeros(len(shifts))
    other = other.rows(np.arange(len(other.t)) % max(1, len(other.t) // _MOST_SAMPLES) == 0)
    place = other.t + line.lag(other.t)
    template = shared.reference
    reach = float(np.abs(shifts).max())
    inside = (place - reach > template.t[0]) & (place + reach < template.t[-1])
    x, place = other.x[inside], place[inside]
    if len(x) < 20 or not np.ptp(x) > 0:
        return np.zeros(len(shifts))
    window = np.floor((other.t[inside] - span[0]) / _WINDOW_S)
    first = np.flatnonzero(np.diff(window, prepend=-1.0))
    size = np.diff(np.append(first, len(x)))
    loss = np.array([_loss(x, np.interp(place + s, template.t, template.x), first, size) for s in shifts])
    dx = x - np.repeat(np.add.reduceat(x, first) / size, size)
    total = np.add.reduceat(np.square(dx), first)
    good = (total > 1e-6 * total.max()) & (size >= 10)
    count = np.minimum(size, _CHANCES_PER_S * _WINDOW_S)[good]
    gained = -0.5 * count * np.log(np.maximum(loss[:, good] / total[good], _LEAST_LOSS))
    return np.asarray(np.maximum(gained - gained.max(axis=0), -_MOST_OF_ONE).sum(axis=1), np.float64)


def _loss(x: Array, y: Array, first: NDArray[np.int64], size: NDArray[np.int64]) -> Array:
    """What a gain and an offset leave of x in each window."""
    dx, dy = (v - np.repeat(np.add.reduceat(v, first) / size, size) for v in (x, y))
    sxx, sxy, syy = (np.add.reduceat(v, first) for v in (dx * dx, dx * dy, dy * dy))
    return np.asarray(sxx - np.where((sxy > 0) & (syy > 0), sxy * sxy / np.where(syy > 0, syy, 1.0), 0.0), np.float64)


def _elsewhere(shared: Sequence[Shared], line: Line) -> str:
    """Say which stretch agrees under another shift than the line's."""
    start, stop = min(s.other.t[0] for s in shared), max(s.other.t[-1] for s in shared)
    width = max(_STRETCH_S, (stop - start) / _MOST_STRETCHES)
    for first in np.arange(start, stop - 0.5 * _STRETCH_S, width).tolist():
        last = min(first + width, first + 6 * _STRETCH_S, stop)
        lag = float(line.lag(np.array([first]))[0])
        near = (first + lag - _SEARCH_S, last + lag + _SEARCH_S)
        parts = [replace(s, reference=s.reference.within(*near), other=s.other.within(first, last)) for s in shared]
        parts = [s for s in parts if _moves(s.reference) and _moves(s.other)]
        if not parts:
            continue
        place = match(parts, lag)
        step = place.lag_s - lag
        if not place.reason and abs(step) > _STEP_S and place.correlation > _CORRELATION:
            return f"its clock jumps: {first - start:.0f} s after its start, the signals need a further shift of {told(step, '+.2f')} s"
    return ""


def _moves(series: Series) -> bool:
    return len(series.t) > 20 and bool(np.ptp(series.x) > 0)
