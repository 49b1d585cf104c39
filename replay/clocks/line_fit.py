"""A straight line between two clocks, fitted to the readings of both recordings' windows.

A robust line through the readings of all signals (`replay.clocks.windows`) gives offset and drift. What the readings
scatter beyond their own variances, and what signals differ from one another, widens the bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from replay.clocks.duplicates import NEWEST, PAIRED, copied
from replay.clocks.shared_series import Shared
from replay.clocks.windows import TOLERANCES_S, Line, Readings, prepared, read_windows
from replay.number_words import told

Array = NDArray[np.float64]

_DRIFT_STD = 150e-6
_MOST_DRIFT = 1e-3
_STAGE_S = 600.0
_LEAST_AGREEING = 0.5
_STRETCHES = 8
_STEP_S = 0.005
_FEWEST = 3
_TUKEY = 4.685
_COARSE_S = 0.15
_UNLIKELY = 1e-3
_BENDS = (0.25, 0.5, 0.75)
_BEND_STD = 15e-6
_SHOWN = 4.0


def fit_line(shared: Sequence[Shared], lag_s: float, at_s: float) -> Line:
    """Refine a lag found by matching into offset and drift with their bound.

    Parameters
    ----------
    shared : Sequence[Shared]
        Quantities in both files.
    lag_s, at_s : float
        Lag to within a tenth of a second, and the middle of the part for which it was found [s of the other file].
    """
    line = Line(at_s, lag_s, 0.0, np.diag([0.05**2, _DRIFT_STD**2]))
    first = min(max(s.other.t[0], s.reference.t[0] - lag_s) for s in shared) - at_s
    last = max(min(s.other.t[-1], s.reference.t[-1] - lag_s) for s in shared) - at_s
    reach = _STAGE_S
    while True:
        line = _stage(shared, line, (at_s + max(first, -reach), at_s + min(last, reach)))
        if line.reason or (-reach <= first and last <= reach):
            break
        reach *= 3
    if line.reason:  # equal noise in both leaves little that windows can compare
        copies = copied(shared, Line(at_s, lag_s, 0.0, line.covariance), _COARSE_S)
        if copies is None or copies[1] != PAIRED:
            return line
    else:
        copies = copied(shared, line)
        if copies is None:
            return line
    exact = _robust_line(copies[0], shared, line, floor=0.0, known=copies[1])
    return line if exact.reason else exact


def _stage(shared: Sequence[Shared], line: Line, span: tuple[float, float]) -> Line:
    """Fit the windows of a stretch of time, starting from a line that holds for a part of it."""
    parts = [prepared(s, line, span) for s in shared]
    for tolerances in (TOLERANCES_S, TOLERANCES_S[-2:]):
        found = [read_windows(p, i, line, tolerances) for i, p in enumerate(parts)]
        readings = Readings(
            *(np.concatenate([getattr(f, k) for f in found]) for k in ("t", "lag", "variance", "signal"))
        )
        line = _robust_line(readings, shared, line)
        if line.reason:
            return line
    return line


def _robust_line(
    readings: Readings, shared: Sequence[Shared], start: Line, floor: float = 0.1, known: float = NEWEST
) -> Line:
    """Fit a line to the readings; outliers lose their weight, and disagreement widens the covariance.

    No reading counts as better than `floor` of the slower file's period; samples' ages are known to `known` of the faster's.
    """
    t, lag, variance = readings.t, readings.lag, readings.variance
    if len(t) < _FEWEST:
        return _refused(start, "too few moments show in both recordings")
    least = floor * float(np.median([max(s.reference.recorded, s.other.recorded) for s in shared]))
    weight0 = 1.0 / (variance + least**2)
    at = float(np.sum(weight0 * t) / weight0.sum())
    u = t - at
    line = np.array([_weighted_median(lag - start.drift * u, weight0), start.drift])
    scale = 5.0
    weight = weight0
    covariance = start.covariance
    for _ in range(12):
        residual = lag - line[0] - line[1] * u
        z = residual * np.sqrt(weight0)
        scale = max(1.0, min(1.4826 * _weighted_median(np.abs(z), weight0), scale * 1.5))
        weight = weight0 * np.square(1 - np.square(np.minimum(np.abs(z) / (_TUKEY * scale), 1.0)))
        total = weight.sum()
        if not total > 0:
            return _refused(start, "the moments that both recordings show contradict each other")
        normal = np.array([[total, (weight * u).sum()], [(weight * u).sum(), (weight * u * u).sum()]]) / scale**2
        normal[1, 1] += 1.0 / _DRIFT_STD**2
        covariance = np.asarray(np.linalg.inv(normal), np.float64)
        line = covariance @ np.array([(weight * lag).sum(), (weight * u * lag).sum()]) / scale**2
    agreeing = float((weight > 0.1 * weight0).mean())
    if agreeing < _LEAST_AGREEING:
        return _refused(start, f"only {agreeing:.0%} of the moments agree on one offset and drift")
    if abs(line[1]) > _MOST_DRIFT:
        return _refused(start, f"the drift would be {told(line[1] * 1e6, '.0f')} ppm")
    residual = lag - line[0] - line[1] * u
    uneven, more = _uneven(u, residual, weight0, weight, scale)
    if uneven:
        return _refused(start, uneven)
    used = [i for i in range(len(shared)) if (weight[readings.signal == i] > 0).any()]
    counted = int((weight > 0.1 * weight0).sum())
    freedom = max(1, counted - 2)
    from scipy.special import stdtrit

    covariance = (
        covariance * (stdtrit(freedom, 0.975) / 1.96) ** 2 * max(1.0, counted / freedom)
    )  # few readings tell less
    covariance[0, 0] += _between(readings, weight / scale**2, residual, shared, used, known) + more**2
    covariance[0, 0] += _bent(u, residual, weight / scale**2, _ends(shared, at))
    return Line(at, float(line[0]), float(line[1]), covariance, tuple(shared[i].name for i in used), t[weight > 0])


def _uneven(u: Array, residual: Array, weight0: Array, weight: Array, scale: float) -> tuple[str, float]:
    """Say where a whole stretch of time agrees on another offset than the line, or how far a stretch is off [s]."""
    edges = np.linspace(u.min(), u.max() + 1e-9, _STRETCHES + 1)
    offs, errors = [], []
    for first, last in pairwise(edges):
        mine = (u >= first) & (u < last)
        if mine.sum() < 2:
            continue
        off = float(np.average(residual[mine], weights=weight0[mine]))
        error = float(np.sqrt(np.average(np.square(residual[mine] - off), weights=weight0[mine])))
        if not (weight[mine] > 0.1 * weight0[mine]).any():
            if abs(off) > max(3.0 * error, _STEP_S):
                return (
                    f"the clocks do not run evenly against each other: {last - first:.0f} s deviate by {told(off * 1e3, '+.0f')} ms"
                ), 0.0
        elif weight[mine].any():
            offs.append(float(np.average(residual[mine], weights=weight[mine])))
            errors.append(scale / float(np.sqrt(weight[mine].sum())))
    if not offs:
        return "", 0.0
    from scipy.special import chdtri

    z = np.divide(offs, errors)
    if float(np.square(z).sum()) < chdtri(max(1, len(z) - 2), _UNLIKELY):
        return "", 0.0
    return "", float(np.abs(np.array(offs)[np.abs(z) > 1.0]).max(initial=0.0))


def _ends(shared: Sequence[Shared], at: float) -> tuple[float, float]:
    """First and last sample [s of the other file, from `at`]."""
    return min(float(s.other.t[0]) for s in shared) - at, max(float(s.other.t[-1]) for s in shared) - at


def _bent(u: Array, residual: Array, weight: Array, ends: tuple[float, float]) -> float:
    """Variance of the offset that a drift which changes once adds: as far as readings show it or leave it open."""
    wide = np.linspace(*ends, 33)
    line, free = np.stack([np.ones(len(u)), u]), np.stack([np.ones(len(wide)), wide])
    normal = (line * weight) @ line.T
    if not np.linalg.det(normal) > 0:
        return 0.0
    worst = 0.0
    for share in _BENDS:
        at = ends[0] + share * (ends[1] - ends[0])
        bend = np.maximum(u - at, 0.0)
        straight = np.linalg.solve(normal, (line * weight) @ bend)
        mine, shape = bend - straight @ line, np.maximum(wide - at, 0.0) - straight @ free
        known = float((weight * mine * mine).sum()) + 1.0 / _BEND_STD**2
        size = float((weight * mine * residual).sum()) / known
        square = (size**2 if size**2 * known > _SHOWN else 0.0) + 1.0 / known
        worst = max(worst, square * float(np.square(shape).max()))
    return worst


def _between(
    readings: Readings, weight: Array, residual: Array, shared: Sequence[Shared], used: list[int], known: float
) -> float:
    """Variance of what signals are late against each other, and of what stamps within a period cannot tell."""
    means, sizes = [], []
    for i in used:
        mine = readings.signal == i
        sizes.append(weight[mine].sum())
        means.append((weight[mine] * residual[mine]).sum() / sizes[-1])
    size, mean = np.array(sizes), np.array(means)
    share = size / size.sum()
    excess = 0.0
    if len(used) > 1:
        q = float((size * np.square(mean - (share * mean).sum())).sum())
        excess = max(0.0, (q - (len(used) - 1)) / (size.sum() - np.square(size).sum() / size.sum()))
    timing = known * min(min(s.reference.recorded, s.other.recorded) for s in shared)
    delay = max(shared[i].delay_s for i in used) / 1.96
    return float(excess * np.square(share).sum() + timing**2 + delay**2)


def _refused(line: Line, reason: str) -> Line:
    return Line(line.at_s, line.lag_s, line.drift, line.covariance, reason=reason)


def _weighted_median(values: Array, weight: Array) -> float:
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])
