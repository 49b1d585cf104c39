"""Valve gain, rate limit and lag of a steering axle, identified from the mission with faults in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from diagnosis.steering.blocks import WHITE_DOF, SensorNoise, SteeringBlocks, window_means
from diagnosis.steering.simplex import minimize

Array = NDArray[np.float64]

_WINDOW_S = 0.25
_SHORT_WINDOW_S = 0.1
_LEAST_WINDOWS = 8


@dataclass(frozen=True)
class SteeringPlant:
    """Valve and cylinder of an axle: ṙ = (sat(gain·u) − r)/lag, φ̇ = r.

    Attributes
    ----------
    gain : float
        Rate per full opening [rad/s].
    rate : float
        Rate limit [rad/s]; the largest rate seen where the mission never reached it.
    lag : float
        Lag [s].
    misfit : float
        Share of a rate that the model does not explain, in the windows that it explains better.
    windows : int
        Windows of steering behind it.
    """

    gain: float
    rate: float
    lag: float
    misfit: float
    windows: int

    @property
    def reliable(self) -> bool:
        """Whether valves can be judged by it."""
        return self.windows >= _LEAST_WINDOWS and self.misfit < 0.25


@njit(cache=True)
def _scan_rates(u, gain, limit, a, length):  # type: ignore[no-untyped-def]
    """Means over windows of `length` of r' = a·r + (1 − a)·sat(gain·u)."""
    out = np.zeros(u.size // length)
    r = 0.0
    for w in range(out.size):
        total = 0.0
        for k in range(w * length, (w + 1) * length):
            r = a * r + (1 - a) * min(max(gain * u[k], -limit), limit)
            total += r
        out[w] = total / length
    return out


@dataclass(frozen=True)
class Windows:
    """Rates of one axle in windows, and what drives them."""

    rate: Array  # mean rate between the middles of neighbouring windows [rad/s]
    u: Array  # opening by block
    good: NDArray[np.bool_]
    length: int
    dt: float
    noise: float  # of the rates [rad/s]

    def predicted(self, gain: float, limit: float, lag: float) -> Array:
        """Rates that a plant gives at these openings."""
        a = float(np.exp(-self.dt / max(lag, 1e-4)))
        means = _scan_rates(self.u, gain, limit, a, self.length)
        return np.asarray((means[:-1] + means[1:]) / 2)


def windows_of(blocks: SteeringBlocks, noise: SensorNoise, stop: float, window_s: float) -> Windows:
    """Rates between windows of `window_s`, marked where the sensor shows its usual noise and no end stop is near."""
    length = max(2, round(window_s / blocks.dt))
    known = blocks.count > 0
    mean = blocks.mean
    if not known.all() and known.any():
        mean = np.interp(np.arange(mean.size), np.flatnonzero(known), mean[known])
    power = window_means(blocks.power, length)
    middle = window_means(mean, length)
    # less or more noise than usual: not the healthy sensor; at its end stop an axle does not answer
    counts = float(np.median(blocks.count[known])) * length if known.any() else 1.0
    usual = 1 + max(0.3, 4 * float(np.sqrt(2 / (WHITE_DOF * counts))))
    alive = (window_means(known.astype(np.float64), length) > 0.9) & (np.abs(middle) < 0.97 * stop)
    alive &= window_means(blocks.blind.astype(np.float64), length) == 0.0
    alive &= power < usual * noise.white
    if noise.resolved:
        alive &= power > noise.white / usual
    rate = np.diff(middle) / (length * blocks.dt)
    spread = float(np.sqrt(2 * noise.white / max(counts, 1.0))) / (length * blocks.dt)
    return Windows(rate, blocks.u, alive[1:] & alive[:-1], length, blocks.dt, spread)


def _loss(parts: Sequence[Windows], gain: float, limit: float, lag: float, scale: float, tolerance: float) -> float:
    """Mean of capped residuals over windows in which the axle is steered or turns."""
    total, count = 0.0, 0
    for w in parts:
        predicted = w.predicted(gain, limit, lag)
        use = w.good & (np.maximum(np.abs(predicted), np.abs(w.rate)) > 0.1 * scale)
        residual = np.abs(w.rate[use] - predicted[use]) / (tolerance * (scale + np.abs(w.rate[use])) + 2 * w.noise)
        total += float(np.minimum(residual, 3.0).sum())
        count += int(np.count_nonzero(use))
    return total / count if count else np.inf


def _fit(
    parts: Sequence[Windows], short: Sequence[Windows], start: SteeringPlant | None = None
) -> SteeringPlant | None:
    """Gain, rate limit and lag with the smallest loss, from `start` or a coarse grid on.

    `parts` are long windows for the grid, `short` ones show the lag.
    """
    rates = np.concatenate([np.abs(w.rate[w.good]) for w in parts])
    noise = max(w.noise for w in parts)
    moving = rates[rates > max(5 * noise, 1e-4)]
    if moving.size < _LEAST_WINDOWS:
        return None
    scale = float(np.quantile(moving, 0.8))
    openings = np.concatenate(
        [np.abs(w.predicted(1.0, np.inf, 0.05))[w.good & (np.abs(w.rate) > 0.3 * scale)] for w in parts]
    )
    openings = openings[openings > 0]
    if not openings.size:
        return None
    typical = scale / float(np.median(openings))
    top = float(np.quantile(moving, 0.98))
    best = _best_of_grid(parts, typical, top, scale) if start is None else (start.gain, start.rate, start.lag)
    gain, limit, lag = _refined_fit(short, best, scale)
    residuals = []
    for w in parts:
        predicted = w.predicted(gain, limit, lag)
        use = w.good & (np.abs(predicted) > 0.3 * scale)
        residuals.append(np.abs(w.rate[use] - predicted[use]) / np.abs(predicted[use]))
    shares = np.concatenate(residuals)
    if not shares.size:
        return None
    return SteeringPlant(float(gain), float(limit), float(lag), float(np.quantile(shares, 0.3)), shares.size)


def _best_of_grid(parts: Sequence[Windows], gain: float, rate: float, scale: float) -> tuple[float, float, float]:
    """Gain, rate limit and lag of the smallest loss on a grid around a typical gain and the largest rate."""
    return min(
        (_loss(parts, g, limit, lag, scale, 0.1), g, limit, lag)
        for g in gain * np.geomspace(0.3, 5.0, 14)
        for limit in rate * np.array([0.6, 0.8, 1.0, 1.25])
        for lag in (0.02, 0.06, 0.18)
    )[1:]


def _refined_fit(
    parts: Sequence[Windows], start: tuple[float, float, float], scale: float
) -> tuple[float, float, float]:
    """Gain, rate limit and lag from a start on, with a loss that tolerates less and less."""
    best = start
    for tolerance in (0.05, 0.02, 0.006):
        # gain and lag trade off against each other: a simplex in their logarithms follows the valley

        def misfit(x: Array, tolerance: float = tolerance) -> float:
            return _loss(parts, np.exp(x[0]), np.exp(x[1]), np.exp(x[2]), scale, tolerance)

        found = minimize(
            misfit,
            np.log(best) + np.array([[0, 0, 0], [1, 0, 0.0], [0, 1, 0], [0, 0, 5]]) * 3 * tolerance,
            calls=45,
            x_tol=1e-3,
            f_tol=1e-4,
        )
        gain, limit, lag = np.exp(found)
        best = gain, limit, lag
    return best


def identify_plants(
    axles: Sequence[SteeringBlocks | None], noises: Sequence[SensorNoise], stop: float
) -> list[SteeringPlant | None]:
    """Identify each axle's plant: its own where both axles agree, else that of both together.

    A fault that lasts would make one axle look slow; a plant that the other axle does not confirm within a fifth is
    not believed.

    Parameters
    ----------
    axles : Sequence[SteeringBlocks or None]
        None where an axle cannot be used.
    noises : Sequence[SensorNoise]
        Noise of each sensor.
    stop : float
        Angle of the end stops [rad].
    """
    windows = [
        None if b is None else (windows_of(b, w, stop, _WINDOW_S), windows_of(b, w, stop, _SHORT_WINDOW_S))
        for b, w in zip(axles, noises, strict=True)
    ]
    usable = [w for w in windows if w is not None]
    pooled = _fit([w[0] for w in usable], [w[1] for w in usable]) if usable else None
    if pooled is None:
        return [None for _ in axles]
    out: list[SteeringPlant | None] = []
    for w in windows:
        own = pooled if w is None or len(usable) == 1 else _fit([w[0]], [w[1]], pooled)
        agrees = own is not None and own.reliable and abs(np.log(own.gain / pooled.gain)) < 0.2
        limit = max(pooled.rate, own.rate) if own is not None and agrees else pooled.rate
        out.append(
            SteeringPlant(own.gain, limit, pooled.lag, own.misfit, own.windows)
            if own is not None and agrees
            else pooled
        )
    return out
