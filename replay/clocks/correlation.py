"""Where two recordings of the same signals match: correlation of their changes over every possible shift."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.clocks.shared_series import Series, Shared
from replay.number_words import told

Array = NDArray[np.float64]

_BIN_S = 0.05
_LONG_BIN_S = 0.1
_LONG_S = 3600.0
_PART_S = 900.0
_PARTS = 4
_MOST_BINS = 4_000_000
_CHANGE_S = 0.2
_LEAST_OVERLAP_S = 10.0
_LEAST_INFORMATION = 25.0  # far above log(shifts tried), what the best of that many chance matches reaches
_RIVAL = 0.6
_LEAST_CORRELATION = 0.3
_NEAR_S = 5.0
_FEWEST_EVENTS = 4.0


@dataclass(frozen=True)
class Match:
    """How a part of one recording lies in the other.

    Attributes
    ----------
    lag_s : float
        Reference time − other time [s]; NaN where no shift is sure.
    at_s : float
        Middle of the matched part [s of the other file].
    reason : str
        Why no shift is sure; else empty.
    correlation : float
        Of the signals' changes under that shift.
    """

    lag_s: float
    at_s: float
    reason: str = ""
    correlation: float = 0.0


def match(shared: Sequence[Shared], wall_s: float = np.inf) -> Match:
    """Find the one shift under which the signals agree.

    Parameters
    ----------
    shared : Sequence[Shared]
        Quantities in both files.
    wall_s : float
        Lag by which the two clocks would show the same time [s]; a few changes tell a moment near it only.
    """
    found = _match(shared, wall_s, _calm_scale)
    return _match(shared, wall_s, _rms_scale) if found.reason else found


def _calm_scale(size: Array) -> float:
    """Usual change of a signal that moves all the time: jumps of a faulty sensor do not outweigh the drive."""
    return float(np.percentile(size, 80))


def _rms_scale(size: Array) -> float:
    """Usual change of a signal that moves now and then."""
    scale = float(np.sqrt(np.mean(np.square(size))))
    return float(np.sqrt(np.mean(np.square(np.minimum(size, 3 * scale)))))


def _match(shared: Sequence[Shared], wall_s: float, scaled: Callable[[Array], float]) -> Match:
    ends = [(s.reference.t[0], s.reference.t[-1], s.other.t[0], s.other.t[-1]) for s in shared]
    a0, a1 = min(e[0] for e in ends), max(e[1] for e in ends)
    b0, b1 = min(e[2] for e in ends), max(e[3] for e in ends)
    longest = max(a1 - a0, b1 - b0)
    width = _BIN_S if longest <= _LONG_S else _LONG_BIN_S
    if longest / width > _MOST_BINS:
        return Match(np.nan, np.nan, f"stamps span {longest:.0f} s, too long to search")
    if longest > _LONG_S:
        shared = shared[:3]
    swap = b1 - b0 > a1 - a0  # parts are cut from the shorter one
    spans = ((b0, b1), (a0, a1)) if swap else ((a0, a1), (b0, b1))
    whole = [_changes(s.other if swap else s.reference, spans[0], width, scaled) for s in shared]
    parted = [_changes(s.reference if swap else s.other, spans[1], width, scaled) for s in shared]
    best = Match(np.nan, np.nan, "its signals hardly move")
    for first, last in _busiest(parted, round(_PART_S / width)):
        part = [x[first:last] for x in parted]
        lag, r, reason = _correlate(whole, part, width)
        middle = (first + last) / 2 * width
        if swap:
            found = Match(-(lag - first * width + b0 - a0), b0 + middle + lag - first * width, reason, r)
        else:
            found = Match(lag - first * width + a0 - b0, b0 + middle, reason, r)
        if not reason and abs(found.lag_s - wall_s) > _NEAR_S and _events(part, width) < _FEWEST_EVENTS:
            reason = "they change too seldom to show that both files record the same drive"
        if not reason:
            return found
        best = Match(np.nan, np.nan, reason)
    return best


def _changes(series: Series, span: tuple[float, float], width: float, scaled: Callable[[Array], float]) -> Array:
    """Change over 0.2 s in each bin, scaled to its usual size and without outliers; NaN where nothing is known."""
    size = int((span[1] - span[0]) / width) + 1
    at = ((series.t - span[0]) / width).astype(np.int64)
    count = np.bincount(at, minlength=size)[:size]
    total = np.bincount(at, weights=series.x - series.x[0], minlength=size)[:size]
    known = np.flatnonzero(count)
    grid = np.arange(size)
    mean = np.interp(grid, known, total[known] / count[known])
    near = np.searchsorted(known, grid)
    gap = known[np.minimum(near, len(known) - 1)] - known[np.maximum(near - 1, 0)]
    mean[(count == 0) & (gap > max(0.5, 3 * series.period) / width + 1)] = np.nan
    step = round(_CHANGE_S / width)
    change = np.full(size, np.nan)
    change[step:] = mean[step:] - mean[:-step]
    size_of = np.abs(change[np.isfinite(change)])
    scale = 0.0
    if size_of.size:
        scale = scaled(size_of) or _rms_scale(size_of)
        change = np.clip(change, -2 * scale, 2 * scale)
    return change / scale if scale > 0 else np.full(size, np.nan)


def _busiest(parts: Sequence[Array], length: int) -> list[tuple[int, int]]:
    """Parts of at most that length with the most change, the busiest first."""
    size = len(parts[0])
    if size <= 1.5 * length:
        return [(0, size)]
    energy = np.nansum([np.minimum(np.square(p), 1.0) for p in parts], axis=0)
    count = size // length
    sums = energy[: count * length].reshape(count, length).sum(axis=1)
    return [(int(i) * length, (int(i) + 1) * length) for i in np.argsort(-sums, kind="stable")[:_PARTS]]


def _events(part: Sequence[Array], width: float) -> float:
    """How many seconds the changes fill, counted by their energy."""
    energy = np.nansum(np.square(part), axis=0)
    second = round(1.0 / width)
    sums = energy[: len(energy) // second * second].reshape(-1, second).sum(axis=1)
    return float(sums.sum() ** 2 / max(float(np.square(sums).sum()), 1e-300))


def _correlate(whole: Sequence[Array], part: Sequence[Array], width: float) -> tuple[float, float, str]:
    """Shift of the part in the whole [s], correlation there, and why it is not sure."""
    from scipy import fft

    n, m = len(whole[0]), len(part[0])
    size = fft.next_fast_len(n + m, real=True)

    def correlation(a: Array, b: Array) -> Array:
        spectrum = fft.rfft(a.astype(np.float32), size) * np.conj(fft.rfft(b.astype(np.float32), size))
        return np.asarray(np.roll(fft.irfft(spectrum, size), m)[: n + m], np.float64)  # shifts −m … n−1

    mask_a, mask_b = (np.asarray(np.isfinite(y).any(axis=0), np.float64) for y in (whole, part))
    known_a, known_b = np.nan_to_num(np.array(whole)), np.nan_to_num(np.array(part))
    both = np.sum([correlation(a, b) for a, b in zip(known_a, known_b, strict=True)], axis=0)
    overlap = correlation(mask_a, mask_b)
    energy_a = correlation(np.square(known_a).sum(axis=0), mask_b)
    energy_b = correlation(mask_a, np.square(known_b).sum(axis=0))
    least = 0.15 * min(float(np.square(known_a).sum()), float(np.square(known_b).sum()))
    allowed = (overlap * width >= 0.5 * _LEAST_OVERLAP_S) & (energy_a > least) & (energy_b > least)
    r = np.where(allowed, both / np.sqrt(np.where(allowed, energy_a * energy_b, 1.0)), 0.0)
    # Information of a match: changes over 0.2 s count once per 0.2 s.
    score = np.where(r > 0, -0.5 * overlap * (width / _CHANGE_S) * np.log1p(-np.minimum(np.square(r), 0.9999)), 0.0)
    peak = int(np.argmax(score))
    if score[peak] < _LEAST_INFORMATION or r[peak] < _LEAST_CORRELATION:
        return np.nan, 0.0, f"no shift makes them agree (best correlation {max(float(r[peak]), 0.0):.2f})"
    low = np.flatnonzero(score[: peak + 1] < 0.3 * score[peak])
    high = np.flatnonzero(score[peak:] < 0.3 * score[peak])
    margin = round(1.0 / width)
    first = min(int(low[-1]) if len(low) else 0, peak - margin)
    last = max(peak + int(high[0]) if len(high) else len(score), peak + margin)
    if (last - first) * width > 20.0:
        return np.nan, 0.0, "they change too slowly to determine the shift"
    rivals = np.concatenate([score[: max(first, 0)], np.zeros(1), score[last + 1 :]])
    rival = int(np.argmax(rivals))
    if rivals[rival] > _RIVAL * score[peak]:
        place = rival if rival < max(first, 0) else rival - max(first, 0) + last
        return (
            np.nan,
            0.0,
            f"they are periodic: a shift by another {told((place - peak) * width, '+.1f')} s fits nearly as well",
        )
    return (peak - m) * width, float(r[peak]), ""
