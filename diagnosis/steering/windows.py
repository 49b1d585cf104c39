"""Rates of a steering axle in windows, and what a plant gives at the same openings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.blocks import WHITE_DOF, SensorNoise, SteeringBlocks, window_means
from diagnosis.steering.valve_map import ValveMap, rate_at
from replay.arrays.compiling import njit
from replay.arrays.quantiles import median_of

Array = NDArray[np.float64]

_DEAD_STEP, _PLAY_STEP = 1e-4, 5e-5  # over which differences are taken [fraction], [rad]
_MISSED = 2.0  # times the usual distance of samples: from there on some are missing
_FAULTY = 0.1  # of the windows: a valve that does not obey in more has an opening of its own
_OBEYED, _NEARLY = 4.0, 1e-3  # standard deviations and opening [fraction] by which a healthy valve may differ


@njit(cache=True, error_model="numpy", nogil=True)
def _window_angles(u, pace, valve, lag, play, dt, length):  # type: ignore[no-untyped-def]
    """Means over windows of `length` blocks of the measured angle, from a start at 0: lag, cylinder, play; rates times `pace`."""
    out = np.zeros(u.size // length)
    a = np.exp(-dt / max(lag, 1e-4))
    k_r = lag * (1 - a)
    r = phi = seen = 0.0
    for w in range(out.size):
        total = 0.0
        for k in range(w * length, (w + 1) * length):
            f = pace[k] * rate_at(u[k], valve)
            phi += k_r * r + (dt - k_r) * f
            r = a * r + (1 - a) * f
            seen = min(max(seen, phi - play), phi + play)
            total += seen
        out[w] = total / length
    return out


@njit(cache=True, error_model="numpy", nogil=True)
def lagged(x, decay):  # type: ignore[no-untyped-def]
    """First-order lag of x from 0 [unit of x], shape (n,): what is left of the former value after a step is `decay` [1]."""
    out = np.empty(x.size)
    kept = 0.0
    for k in range(x.size):
        out[k] = kept + (1.0 - decay) * x[k]
        kept = decay * out[k]
    return out


@njit(cache=True, error_model="numpy", nogil=True)
def _window_slopes(u, pace, valve, lag, play, dt, length):  # type: ignore[no-untyped-def]
    """What `_window_angles` gives, (w,), and its derivatives by slopes, dead bands, limits (up, down), lag and play, (w, 8).

    The derivatives obey the plant's own recursion, driven by those of the rate; the play hands on those of the moment in
    which the sensor last moved. Those by dead bands and play are differences over a step, for at a dead band or a play of 0
    they would depend on openings and motions that are mere rounding. Long, for a loop that is split stores what stays in registers.
    """
    out, slopes = np.zeros(u.size // length), np.zeros((u.size // length, 8))
    lag = max(lag, 1e-4)
    a = np.exp(-dt / lag)
    b, k_r, k_f = 1 - a, lag * (1 - a), dt - lag * (1 - a)
    a_lag = a * dt / lag**2
    k_lag = (1 - a) - lag * a_lag
    r = phi = seen = wider = 0.0
    by_rate, by_angle, by_seen, total_by = np.zeros(7), np.zeros(7), np.zeros(7), np.zeros(7)
    for w in range(out.size):
        total = total_wider = 0.0
        total_by[:] = 0.0
        for k in range(w * length, (w + 1) * length):
            f = pace[k] * rate_at(u[k], valve)
            for i in range(7):
                by_angle[i] += k_r * by_rate[i]
                by_rate[i] *= a
            by_angle[6] += k_lag * (r - f)
            by_rate[6] += a_lag * (r - f)
            p_f, p_b = pace[k] * k_f, pace[k] * b
            if u[k] > valve.dead_up:
                beyond = u[k] - valve.dead_up
                if valve.slope_up * beyond < valve.limit_up:
                    by_angle[0], by_rate[0] = by_angle[0] + p_f * beyond, by_rate[0] + p_b * beyond
                    by_dead = -valve.slope_up * min(beyond / _DEAD_STEP, 1.0)
                    by_angle[2], by_rate[2] = by_angle[2] + p_f * by_dead, by_rate[2] + p_b * by_dead
                else:
                    by_angle[4], by_rate[4] = by_angle[4] + p_f, by_rate[4] + p_b
            elif u[k] < -valve.dead_down:
                beyond = u[k] + valve.dead_down
                if -valve.slope_down * beyond < valve.limit_down:
                    by_angle[1], by_rate[1] = by_angle[1] + p_f * beyond, by_rate[1] + p_b * beyond
                    by_dead = valve.slope_down * min(-beyond / _DEAD_STEP, 1.0)
                    by_angle[3], by_rate[3] = by_angle[3] + p_f * by_dead, by_rate[3] + p_b * by_dead
                else:
                    by_angle[5], by_rate[5] = by_angle[5] - p_f, by_rate[5] - p_b
            phi += k_r * r + k_f * f
            r = a * r + b * f
            if seen < phi - play or seen > phi + play:
                for i in range(7):
                    by_seen[i] = by_angle[i]
                seen = min(max(seen, phi - play), phi + play)
            wider = min(max(wider, phi - play - _PLAY_STEP), phi + play + _PLAY_STEP)
            total += seen
            total_wider += wider
            for i in range(7):
                total_by[i] += by_seen[i]
        out[w] = total / length
        for i in range(7):
            slopes[w, i] = total_by[i] / length
        slopes[w, 7] = (total_wider - total) / (length * _PLAY_STEP)
    return out, slopes


@dataclass(frozen=True)
class Windows:
    """Rates of one axle in windows, and what drives them.

    Attributes
    ----------
    rate : Array, shape (w,)
        Mean rate between the middles of neighbouring windows [rad/s].
    u : Array, shape (m,)
        Opening by block [fraction].
    pace : Array, shape (m,)
        What an axle turns at its opening at the speed of driving, as a multiple of its usual [1].
    opening : Array, shape (w,)
        Its mean between those middles [fraction].
    good : NDArray[np.bool_], shape (w,)
        Windows with the sensor's usual noise, away from the end stops.
    length : int
        Blocks per window.
    dt : float
        Length of a block [s].
    noise : float
        Of the rates [rad/s].
    """

    rate: Array
    u: Array
    pace: Array
    opening: Array
    good: NDArray[np.bool_]
    length: int
    dt: float
    noise: float

    def predicted(self, valve: ValveMap, lag: float, play: float) -> Array:
        """Rates that a plant gives at these openings [rad/s], shape (w,)."""
        angles = _window_angles(self.u, self.pace, valve, lag, play, self.dt, self.length)
        return np.asarray(np.diff(angles) / (self.length * self.dt))

    def slopes(self, valve: ValveMap, lag: float, play: float) -> tuple[Array, Array]:
        """What `predicted` gives, and its derivatives by both slopes, dead bands and limits, lag and play, shape (w, 8).

        Lag in s, play in rad, rates in rad/s.
        """
        angles, by = _window_slopes(self.u, self.pace, valve, lag, play, self.dt, self.length)
        span = self.length * self.dt
        return np.diff(angles) / span, np.diff(by, axis=0) / span

    def coarser(self, blocks: int) -> Windows:
        """The same windows with openings that are means of `blocks`; as they are where that does not divide a window."""
        if self.length % blocks:
            return self
        u, pace = window_means(self.u, blocks), window_means(self.pace, blocks)
        return replace(self, u=u, pace=pace, length=self.length // blocks, dt=self.dt * blocks)


def windows_of(blocks: SteeringBlocks, noise: SensorNoise, stop: float, window_s: float) -> Windows:
    """Rates between windows of `window_s`, marked where the sensor shows its usual noise and no end stop is near.

    `stop` in rad, `window_s` in s.
    """
    length = max(2, round(window_s / blocks.dt))
    known = blocks.count > 0
    mean = blocks.mean
    if not known.all() and known.any():
        mean = np.interp(np.arange(mean.size), np.flatnonzero(known), mean[known])
    samples = window_means(blocks.count, length)
    power = window_means(blocks.power * blocks.count, length) / np.maximum(samples, 1e-9)
    middle = window_means(mean, length)
    # less or more noise than usual: not the healthy sensor; at its end stop an axle does not answer
    counts = float(median_of(blocks.count[known])) * length if known.any() else 1.0
    usual = 1 + max(0.3, 4 * float(np.sqrt(2 / (WHITE_DOF * counts))))
    alive = (window_means(_sampled(known).astype(np.float64), length) > 0.9) & (np.abs(middle) < 0.97 * stop)
    alive &= window_means(blocks.blind.astype(np.float64), length) == 0.0
    alive &= power < usual * noise.white
    if noise.resolved:
        alive &= power > noise.white / usual
    rate = np.diff(middle) / (length * blocks.dt)
    u, obeyed = _opened(blocks, length)
    alive &= obeyed
    opening = window_means(u, length)
    spread = float(np.sqrt(2 * noise.white / max(counts, 1.0))) / (length * blocks.dt)
    middle_u = (opening[1:] + opening[:-1]) / 2
    return Windows(rate, u, blocks.pace, middle_u, alive[1:] & alive[:-1], length, blocks.dt, spread)


def _sampled(known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Blocks with a sample, and those between two samples of a channel that comes more rarely than blocks do. Shape (m,)."""
    at = np.flatnonzero(known)
    if at.size < 2:
        return known
    gaps, sampled = np.diff(at), known.copy()
    sampled[at[0] : at[-1]] = np.repeat(gaps, gaps) <= _MISSED * median_of(gaps)
    return sampled


def _opened(blocks: SteeringBlocks, length: int) -> tuple[Array, NDArray[np.bool_]]:
    """Openings of the blocks [fraction], shape (m,), and the windows of `length` blocks in which they are known, shape (w,).

    The command's; where a measured opening leaves that for long, the command less what the opening lacks of it.
    """
    obeyed = _obeyed(blocks, length)
    if np.count_nonzero(~obeyed) <= _FAULTY * obeyed.size:
        return blocks.u, obeyed
    lacks = blocks.redundancy.opening - blocks.redundancy.command
    known = np.flatnonzero(np.isfinite(lacks))
    return blocks.u + np.interp(np.arange(blocks.u.size), known, lacks[known]), np.ones_like(obeyed)


def _obeyed(blocks: SteeringBlocks, length: int) -> NDArray[np.bool_]:
    """Windows of `length` blocks in which the valve's opening, where it is measured, follows its command. Shape (w,)."""
    seen = blocks.redundancy
    known = np.isfinite(seen.opening) & np.isfinite(seen.command)
    deviation = np.where(known, seen.opening - seen.command, 0.0)
    count = window_means(known.astype(np.float64), length) * length
    variance = window_means(np.where(known, seen.opening_variance, 0.0), length) / np.maximum(count, 1.0)
    share = window_means(deviation, length) * length / np.maximum(count, 1.0)
    return np.asarray((count == 0) | (np.abs(share) < _OBEYED * np.sqrt(variance) + _NEARLY))
