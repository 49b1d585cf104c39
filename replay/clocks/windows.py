"""Moments that two recordings show: the lag between them, window by window.

Every signal is cut into windows. In each, other(t) = g·reference(t + lag + δ) + c is solved for g, c and δ by weighted
least squares around the lag known so far; δ with its variance is one reading of the clocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from replay.clocks.shared_series import Series, Shared

Array = NDArray[np.float64]

TOLERANCES_S = (0.05, 0.03, 0.015, 0.006)
_WINDOW_S = (4.0, 16.0)
_MOST_WINDOWS = 90
_BIN_S = 0.01
_SLOPE_S = 0.1
_CAPTURE_S = 0.15
_LEAST_EXPLAINED = 0.5
_LEAST_SIGNAL = 0.5
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
        """Lag at some times of the other file [s]. Both of one shape (k,)."""
        return self.lag_s + self.drift * (t - self.at_s)

    def bound(self, t: Array) -> Array:
        """95 % bound of the lag at some times [s]. Both of one shape (k,)."""
        u = t - self.at_s
        c = self.covariance
        return np.asarray(1.96 * np.sqrt(c[0, 0] + 2 * u * c[0, 1] + u * u * c[1, 1]), np.float64)


@dataclass(frozen=True)
class Readings:
    """Lags [s], their variances, times [s of the other file] and signals' numbers; each of shape (n,)."""

    t: Array
    lag: Array
    variance: Array
    signal: NDArray[np.int64]


@dataclass(frozen=True)
class Part:
    """Samples of one signal that are compared: a template, and samples whose place in it is sought.

    Attributes
    ----------
    template, samples : Series
        The faster recording, and the other one.
    slopes, noise : NDArray[np.float64], shape (n,)
        Slope around each sample of the template, and its square by noise alone.
    window : NDArray[np.int64], shape (m,)
        Window of each of `samples`.
    reversed : bool
        Whether `samples` are those of the reference.
    timing : float
        Error of a sample's own moment [s].
    """

    template: Series
    slopes: Array
    noise: Array
    samples: Series
    window: NDArray[np.int64]
    reversed: bool
    timing: float


def prepared(shared: Shared, line: Line, span: tuple[float, float]) -> Part:
    """Cut both recordings of a quantity to the windows that are used.

    Parameters
    ----------
    shared : Shared
        The quantity.
    line : Line
        Lag known so far.
    span : tuple[float, float]
        Stretch of time [s of the other file]; of a long one some windows, evenly spread.
    """
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
    on_reference = reference.t - line.lag(reference.t - line.lag_s) - span[0], reference
    on_other = other.t - span[0], other
    (at, samples), (place, template) = (on_reference, on_other) if backwards else (on_other, on_reference)
    window = np.floor(at / width).astype(np.int64)
    if every > 1.0:  # of a long mission some windows, evenly spread
        kept = np.unique((np.arange(_MOST_WINDOWS) * every).astype(np.int64))
        near = [np.floor((place + x) / width).astype(np.int64) for x in (-slack, 0.0, slack)]
        template = template.rows(np.any([np.isin(x, kept) for x in near], axis=0))
        rows = np.isin(window, kept)
        samples, window = samples.rows(rows), window[rows]
    return Part(template, *_slopes(template), samples, window, backwards, timing)


def read_windows(part: Part, number: int, line: Line, tolerances: Sequence[float]) -> Readings:
    """Lag of each window of one signal.

    Parameters
    ----------
    part : Part
        Its windows.
    number : int
        Number that its readings carry.
    line : Line
        Lag from which the search starts; at most 0.15 s from it are searched.
    tolerances : Sequence[float]
        Error of time that samples may have, one turn after the other [s].
    """
    samples, template, slopes, noise = part.samples, part.template, part.slopes, part.noise
    none = np.zeros(0)
    if len(samples.t) < 20 or len(template.t) < 20:
        return Readings(none, none, none, none.astype(np.int64))
    first = np.flatnonzero(np.diff(part.window, prepend=part.window[0] - 1))
    size = np.diff(np.append(first, len(part.window)))
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
    return Readings(t[good], lag[good], variance[good], np.full(int(good.sum()), number))


def _slopes(series: Series) -> tuple[Array, Array]:
    """Slope of each sample's surroundings, and the square that noise alone would give it."""
    reach = max(2, round(_SLOPE_S / series.period))
    if len(series.t) <= 2 * reach:
        return np.zeros(len(series.t)), np.zeros(len(series.t))
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
