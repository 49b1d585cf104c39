"""A straight line between two clocks, fitted to the moments that both recordings show.

Every signal is cut into windows. In each, other(t) = g·reference(t + lag + δ) + c is solved for g, c and δ by weighted
least squares around the lag known so far; δ with its variance is one reading of the clocks. A robust line through the
readings of all signals gives offset and drift. What the readings scatter beyond their own variances, and what signals
differ from one another, widens the bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from replay.clock_series import Series, Shared

Array = NDArray[np.float64]

_WINDOW_S = (4.0, 16.0)
_MOST_WINDOWS = 90
_BIN_S = 0.01
_SLOPE_S = 0.1
_TOLERANCES_S = (0.05, 0.03, 0.015, 0.006)
_CAPTURE_S = 0.15
_DRIFT_STD = 150e-6
_MOST_DRIFT = 1e-3
_STAGE_S = 600.0
_LEAST_EXPLAINED = 0.5
_LEAST_AGREEING = 0.5
_LEAST_SIGNAL = 0.5
_STRETCHES = 8
_STEP_S = 0.005
_FEWEST = 3
_TUKEY = 4.685


@dataclass(frozen=True)
class Line:
    """Reference time − other time as a line over the other file's time: lag + drift·(t − at).

    Attributes
    ----------
    at_s : float
        Where `lag_s` holds [s of the other file].
    lag_s, drift : float
        Lag [s] and its change per second [1].
    covariance : NDArray[np.float64], shape (2, 2)
        Of lag and drift.
    signals : tuple[str, ...]
        Quantities whose readings were used.
    seen : NDArray[np.float64], shape (n,)
        When these readings were taken [s of the other file].
    reason : str
        Why the line is not to be trusted; else empty.
    """

    at_s: float
    lag_s: float
    drift: float
    covariance: Array
    signals: tuple[str, ...] = ()
    seen: Array = field(default_factory=lambda: np.zeros(0))
    reason: str = ""

    def lag(self, t: Array) -> Array:
        """Lag at some times of the other file [s]."""
        return self.lag_s + self.drift * (t - self.at_s)

    def bound(self, t: Array) -> Array:
        """95 % bound of the lag at some times [s]."""
        u = t - self.at_s
        c = self.covariance
        return np.asarray(1.96 * np.sqrt(c[0, 0] + 2 * u * c[0, 1] + u * u * c[1, 1]), np.float64)


@dataclass(frozen=True)
class _Readings:
    """Lags [s], their variances, times [s of the other file] and signals' numbers; each of shape (n,)."""

    t: Array
    lag: Array
    variance: Array
    signal: NDArray[np.int64]


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
            return line
        reach *= 3


def _stage(shared: Sequence[Shared], line: Line, span: tuple[float, float]) -> Line:
    """Fit the windows of a stretch of time, starting from a line that holds for a part of it."""
    parts = [_prepared(s, line, span) for s in shared]
    for tolerances in (_TOLERANCES_S, _TOLERANCES_S[-2:]):
        found = [_readings(p, i, line, tolerances) for i, p in enumerate(parts)]
        readings = _Readings(
            *(np.concatenate([getattr(f, k) for f in found]) for k in ("t", "lag", "variance", "signal"))
        )
        line = _robust_line(readings, shared, line)
        if line.reason:
            return line
    return line


@dataclass(frozen=True)
class _Part:
    """Samples of one signal that are compared: a template, and samples whose place in it is sought."""

    template: Series
    samples: Series
    window: NDArray[np.int64]
    reversed: bool
    timing: float


def _prepared(shared: Shared, line: Line, span: tuple[float, float]) -> _Part:
    """Cut both recordings to the windows that are used."""
    other = shared.other.within(*span)
    shift = line.lag(np.array(span))
    slack = 1.0 + _CAPTURE_S
    reference = shared.reference.within(span[0] + shift[0] - slack, span[1] + shift[1] + slack)
    timing = 0.3 * max(shared.other.recorded, shared.reference.recorded)
    length = span[1] - span[0]
    width = float(np.clip(length / 12.0, *_WINDOW_S))
    every = max(1.0, length / width / _MOST_WINDOWS)
    other, reference = other.thinned(_BIN_S), reference.thinned(_BIN_S)
    backwards = other.period < reference.period
    samples, template = (reference, other) if backwards else (other, reference)
    at = samples.t - (line.lag(samples.t - line.lag_s) if backwards else 0.0) - span[0]
    window = (at / width).astype(np.int64)
    if every > 1.0:  # of a long mission some windows, evenly spread
        kept = np.unique((np.arange(_MOST_WINDOWS) * every).astype(np.int64))
        rows = np.isin(window, kept)
        samples, window = Series(samples.t[rows], samples.x[rows], samples.period, samples.recorded), window[rows]
    return _Part(template, samples, window, backwards, timing)


def _readings(part: _Part, number: int, line: Line, tolerances: Sequence[float]) -> _Readings:
    """Lag of each window of one signal."""
    samples, template = part.samples, part.template
    none = np.zeros(0)
    if len(samples.t) < 20 or len(template.t) < 20:
        return _Readings(none, none, none, none.astype(np.int64))
    first = np.flatnonzero(np.diff(part.window, prepend=part.window[0] - 1))
    size = np.diff(np.append(first, len(part.window)))
    slopes, noise = _slopes(template)
    widest = 3.0 * template.period + 1e-9
    # Place of the samples in the template by the line so far.
    place = samples.t - line.lag(samples.t - line.lag_s) if part.reversed else samples.t + line.lag(samples.t)
    moved = np.zeros(len(first))
    variance = np.full(len(first), np.inf)
    for tolerance in (*tolerances, part.timing):
        at = place + np.repeat(moved, size)
        i = np.clip(np.searchsorted(template.t, at), 1, len(template.t) - 1)
        before, after = template.t[i - 1], template.t[i]
        share = (at - before) / (after - before)
        known = (share >= 0) & (share <= 1) & (after - before <= widest)
        y = template.x[i - 1] + share * (template.x[i] - template.x[i - 1])
        p = slopes[i - 1] + share * (slopes[i] - slopes[i - 1])
        step, variance = _solve(samples.x, y, p, noise[i], known, first, max(tolerance, part.timing))
        moved = np.clip(moved + np.clip(step, -0.06, 0.06), -_CAPTURE_S, _CAPTURE_S)
    good = np.isfinite(variance) & (np.abs(moved) < 0.99 * _CAPTURE_S)
    middle = np.add.reduceat(samples.t, first) / size
    if part.reversed:
        t = middle - line.lag(middle - line.lag_s) + moved
        lag = middle - t
    else:
        t, lag = middle, line.lag(middle) + moved
    return _Readings(t[good], lag[good], variance[good], np.full(int(good.sum()), number))


def _slopes(series: Series) -> tuple[Array, Array]:
    """Slope of each sample's surroundings, and the square that noise alone would give it."""
    reach = max(2, round(_SLOPE_S / series.period))
    lever = np.arange(reach, -reach - 1, -1.0)  # convolution turns it round
    t = series.t - series.t[0]
    run = np.convolve(t, lever, "same")
    rise = np.convolve(series.x - series.x[0], lever, "same")
    slopes = np.where(run > 0, rise / np.where(run > 0, run, 1.0), 0.0)
    slopes[:reach] = slopes[len(slopes) - reach :] = 0.0
    bend = np.zeros(len(t))
    bend[1:-1] = np.square(series.x[1:-1] - 0.5 * (series.x[:-2] + series.x[2:])) / 1.5
    noise = bend * float(np.square(lever).sum()) / np.square(np.maximum(run, 1e-9))
    return slopes, np.where(run > 0, noise, 0.0)


@dataclass(frozen=True)
class _Sums:
    """Weighted sums over each window of x, y and p around their means, for x = c + g·y + q·p."""

    x: Array
    y: Array
    p: Array
    syy: Array
    spp: Array
    syp: Array
    sxy: Array
    sxp: Array
    sxx: Array

    @property
    def det(self) -> Array:
        return self.syy * self.spp - self.syp * self.syp

    @property
    def solution(self) -> tuple[Array, Array]:
        """Least squares g and q of each window."""
        g = (self.spp * self.sxy - self.syp * self.sxp) / self.det
        return g, (self.syy * self.sxp - self.syp * self.sxy) / self.det


def _sums(x: Array, y: Array, p: Array, w: Array, first: NDArray[np.int64], count: NDArray[np.int64]) -> _Sums:
    sw = np.add.reduceat(w, first)
    dx, dy, dp = (v - np.repeat(np.add.reduceat(w * v, first) / sw, count) for v in (x, y, p))
    wy, wp = w * dy, w * dp
    pairs = ((wy, dy), (wp, dp), (wy, dp), (wy, dx), (wp, dx), (w * dx, dx))
    return _Sums(dx, dy, dp, *(np.add.reduceat(a * b, first) for a, b in pairs))


def _solve(
    x: Array, y: Array, p: Array, noise_p: Array, known: NDArray[np.bool_], first: NDArray[np.int64], timing: float
) -> tuple[Array, Array]:
    """Solve x = c + g·y + q·p in each window; return δ = q/g and its variance (infinite where there is none).

    Samples that do not follow (faults of one copy) lose their weight. A sample's own moment is known to `timing` only.
    """
    count = np.diff(np.append(first, len(x)))
    weight = known.astype(np.float64)
    size = np.maximum(np.add.reduceat(weight, first), 1.0)
    spread = np.ones(len(x))
    with np.errstate(all="ignore"):
        for _ in range(2):
            sums = _sums(x, y, p, weight / np.square(spread), first, count)
            g, q = sums.solution
            residual = sums.x - np.repeat(g, count) * sums.y - np.repeat(q, count) * sums.p
            clear = known & np.isfinite(residual)
            if not clear.any():
                return np.zeros(len(first)), np.full(len(first), np.inf)
            low, half = np.percentile(np.abs(residual[clear]), (25, 50))  # the calm part: faults may fill the rest
            noise = max(low / 0.3186, 0.3 * 1.4826 * half, 1e-7 * float(np.ptp(x)), 1e-12)
            spread = np.sqrt(noise**2 + np.square(float(np.nanmedian(np.abs(g))) * p * timing))
            ratio = np.minimum(np.abs(residual) / (_TUKEY * spread), 1.0)
            weight = np.where(clear, np.square(1.0 - np.square(ratio)), 0.0)
        w = weight / np.square(spread)
        sums = _sums(x, y, p, w, first, count)
        g, q = sums.solution
        residual = sums.x - np.repeat(g, count) * sums.y - np.repeat(q, count) * sums.p
        loss = np.add.reduceat(w * np.square(residual), first)
        kept = np.add.reduceat(weight, first)
        # What noise of the template adds to the slope's square tells nothing of time, and would hold δ where it is.
        clean = 1.0 - np.add.reduceat(w * noise_p, first) * sums.syy / sums.det
        plain = np.maximum(loss / np.maximum(kept, 1.0), 1.0) * sums.syy / sums.det
        lever = w * (sums.p - np.repeat(sums.syp / sums.syy, count) * sums.y)  # δ's own direction
        sandwich = np.add.reduceat(np.square(lever * residual), first) / np.square(sums.det / sums.syy)
        follows = 1.0 - loss / sums.sxx > _LEAST_EXPLAINED
        usual = float(np.nanmedian(g[follows])) if follows.any() else np.nan
        good = follows & (clean > _LEAST_SIGNAL) & (np.abs(g / usual - 1.0) < 0.5) & (kept > 0.5 * size) & (size >= 20)
        step, variance = q / g / clean, np.maximum(plain, sandwich) / np.square(clean * g)
    good &= np.isfinite(step) & np.isfinite(variance)
    return np.where(good, step, 0.0), np.where(good, variance, np.inf)


def _robust_line(readings: _Readings, shared: Sequence[Shared], start: Line) -> Line:
    """Fit a line to the readings; outliers lose their weight, and disagreement widens the covariance."""
    t, lag, variance = readings.t, readings.lag, readings.variance
    if len(t) < _FEWEST:
        return _refused(start, "too few moments show in both recordings")
    floor = float(np.median([0.05 * max(s.reference.recorded, s.other.recorded) for s in shared])) ** 2
    weight0 = 1.0 / (variance + floor)
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
        return _refused(start, f"the drift would be {line[1] * 1e6:.0f} ppm")
    residual = lag - line[0] - line[1] * u
    uneven, more = _uneven(u, residual, weight0, weight)
    if uneven:
        return _refused(start, uneven)
    used = [i for i in range(len(shared)) if (weight[readings.signal == i] > 0).any()]
    covariance = covariance.copy()
    covariance[0, 0] += _between(readings, weight / scale**2, residual, shared, used) + more**2
    return Line(at, float(line[0]), float(line[1]), covariance, tuple(shared[i].name for i in used), t[weight > 0])


def _uneven(u: Array, residual: Array, weight0: Array, weight: Array) -> tuple[str, float]:
    """Say where a whole stretch of time agrees on another offset than the line, or how far a stretch is off [s]."""
    edges = np.linspace(u.min(), u.max() + 1e-9, _STRETCHES + 1)
    worst = 0.0
    for first, last in pairwise(edges):
        mine = (u >= first) & (u < last)
        if mine.sum() < 2:
            continue
        off = float(np.average(residual[mine], weights=weight0[mine]))
        error = float(np.sqrt(np.average(np.square(residual[mine] - off), weights=weight0[mine])))
        if not (weight[mine] > 0.1 * weight0[mine]).any():
            if abs(off) > max(3.0 * error, _STEP_S):
                return (
                    f"the clocks do not run evenly against each other: {last - first:.0f} s are off by {off * 1e3:+.0f} ms"
                ), 0.0
        elif weight[mine].any():
            off = float(np.average(residual[mine], weights=weight[mine]))
            worst = max(worst, abs(off) - 3.0 / float(np.sqrt(weight[mine].sum())))
    return "", worst


def _between(readings: _Readings, weight: Array, residual: Array, shared: Sequence[Shared], used: list[int]) -> float:
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
    timing = 0.29 * min(min(s.reference.recorded, s.other.recorded) for s in shared)
    delay = max(shared[i].delay_s for i in used) / 1.96
    return float(excess * np.square(share).sum() + timing**2 + delay**2)


def _refused(line: Line, reason: str) -> Line:
    return Line(line.at_s, line.lag_s, line.drift, line.covariance, reason=reason)


def _weighted_median(values: Array, weight: Array) -> float:
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])
