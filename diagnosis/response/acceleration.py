"""Forward acceleration of the body by an inertial unit beside the changes of a speed, in one band of both.

What the unit reads is the body's acceleration, a share of gravity where it stands on a slope, its own bias, and vibration:
a = κ·v̇ + g·sin θ + b + n. Over a window T, less half of what the windows before and behind have, a constant and a
ramp of it vanish, on both sides alike:

    D(F)(t) = F(t+T/2) − F(t−T/2) − ½·[F(t−T/2) − F(t−3T/2) + F(t+3T/2) − F(t+T/2)],   y = D(v),  x = D(∫a)     (T21)

κ, the delay between the two, T, the noise σ of x and the spread s of its share of y are found in the mission. A change y
of the reading is then the body's, or the sensor's, by

    x ~ N(κ·y, σ² + (s·κ·y)²)   or   x ~ N(0, σ² + (κ·u)²)                                                          (T22)

where u is how much the body's speed usually changes meanwhile. Their exponents are compared, ½[(x − κy)²/(…) − x²/(…)], without the widths: a relation that holds loosely
makes nothing probable by being wide. Axis, sign and unit need not be right: where nothing relates x to y,
nothing is said.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_WINDOWS_S = (0.25, 0.5, 1.0)
_DELAYS_S = 0.4  # between speed and acceleration, either way
_LEAST = 60  # windows behind each other that the relation is found in
_RELATED, _SURE = 0.3, 6.0  # correlation; the same in standard deviations of chance
_GAINS = 0.3, 3.0  # what κ may be: another one is another axis, or another unit
_KEPT, _ROUNDS = 0.9, 6
_NORMAL_90 = 1.645
_SMALL, _LARGE = 0.5, 0.95  # quantiles of |y| up to which x is noise, and from which its share of y shows
_ABOVE = 4.0  # times the noise, from which on it does
_LEAST_SPREAD = 0.1  # of the share
ENOUGH = 2.3  # nats of one change where two tell together: ten times as probable each
_MOST = 0.5  # of a change that the body has where it is the sensor's
_CAP = 5.0  # of what one change says, for noise has longer tails than a normal one


class Relation(NamedTuple):
    """How the changes of one series follow those of another, in a mission; units of speed and acceleration stand for any.

    Attributes
    ----------
    gain : float
        κ [1]; negative where the unit looks backwards.
    delay : int
        Cells by which the speed comes later than the acceleration.
    reach : int
        Cells of T.
    noise, spread, usual : float
        σ [m/s], s [1], u [m/s].
    y, x : Array, shape (cells,)
        Changes of the speed and of the acceleration's integral [m/s]; NaN where unknown.
    """

    gain: float
    delay: int
    reach: int
    noise: float
    spread: float
    usual: float
    y: Array
    x: Array

    def says(self, at: int) -> tuple[float, float, float]:
        """What a change about a cell is: for the sensor (> 0) or the body (< 0), in nats; y and x/κ there [m/s].

        The change is looked for within half of T. Nothing (0, NaN, NaN) where either is unknown.
        """
        half = max(1, self.reach // 2)
        first = max(0, at - half)
        near = self.y[first : at + half + 1]
        if not near.size or not np.isfinite(near).any():
            return 0.0, np.nan, np.nan
        k = first + int(np.nanargmax(np.abs(near)))
        y, x = float(self.y[k]), float(self.x[k])
        if not np.isfinite(x):
            return 0.0, np.nan, np.nan
        body = self.noise**2 + (self.spread * self.gain * y) ** 2
        own = self.noise**2 + (self.gain * self.usual) ** 2
        nats = 0.5 * ((x - self.gain * y) ** 2 / body - x * x / own)
        if x * self.gain * y > _MOST * (self.gain * y) ** 2:  # the body does it, or more than that
            nats = min(nats, -ENOUGH)
        return float(np.clip(nats, -_CAP, _CAP)), y, x / self.gain

    @property
    def least(self) -> float:
        """Smallest change of a reading [m/s], there and back, that would show as the sensor's where the body goes on evenly; infinite where none would."""
        left = 1.0 / (2.0 * ENOUGH) - self.spread**2
        return self.noise / abs(self.gain) / float(np.sqrt(left)) if left > 0.0 else np.inf


class _Related(NamedTuple):
    """κ [1], σ [m/s], s [1], u [m/s]."""

    gain: float
    noise: float
    spread: float
    usual: float


def changes(value: Array, reach: int) -> Array:
    """D of (T21), shape (cells,); NaN within 3T/2 of either end. `value` of shape (cells,), `reach` in cells."""
    out = np.full(value.size, np.nan)
    if value.size <= 3 * reach:
        return out
    step = value[reach:] - value[:-reach]
    part = step[reach:-reach] - 0.5 * (step[: -2 * reach] + step[2 * reach :])
    first = reach + reach // 2
    out[first : first + part.size] = part
    return out


def acceleration_of(speed: Array, acceleration: Array, aside: Flags, cell_s: float) -> Relation | None:
    """Relate the two; None where nothing does.

    Parameters
    ----------
    speed, acceleration : Array, shape (cells,)
        Means of cells [m/s], [m/s²]; NaN where nothing was read.
    aside : Flags, shape (cells,)
        Cells of changes that are in question: they are no example.
    cell_s : float
        Length of a cell [s].
    """
    if np.count_nonzero(np.isfinite(speed) & np.isfinite(acceleration)) < _LEAST:
        return None
    total = np.cumsum(np.nan_to_num(acceleration)) * cell_s
    integral = total - 0.5 * np.nan_to_num(acceleration) * cell_s  # up to the middle of each cell
    integral[~np.isfinite(acceleration)] = np.nan
    return relation(speed, integral, aside, cell_s, _GAINS)


def relation(value: Array, other: Array, aside: Flags, cell_s: float, gains: tuple[float, float]) -> Relation | None:
    """Relate the changes of two series in one band; None where those of the second do not follow those of the first.

    Parameters
    ----------
    value, other : Array, shape (cells,)
        The series; NaN where unknown.
    aside : Flags, shape (cells,)
        Cells of changes that are in question: they are no example.
    cell_s : float
        Length of a cell [s].
    gains : tuple[float, float]
        What the size of κ may be.
    """
    found: list[Relation] = []
    reaches = dict.fromkeys(max(1, round(t / cell_s)) for t in _WINDOWS_S)
    most = round(_DELAYS_S / cell_s)
    for reach in reaches:
        y = changes(value, reach)
        near = np.convolve(aside, np.ones(3 * reach + 2 * most + 1), mode="same")[: y.size] > 0.0
        unshifted = changes(other, reach)
        aside_y = np.where(near, np.nan, y)
        delay = max(range(-most, most + 1), key=lambda d: _alike(aside_y, _later(unshifted, d)))
        r = _related(aside_y, _later(unshifted, delay), reach, gains)
        if r is None:
            continue
        found.append(Relation(r.gain, delay, reach, r.noise, r.spread, r.usual, y, _later(unshifted, delay)))
    loose = [
        r for r in found if np.isinf(r.least)
    ]  # what leaps ahead of the body, as wheels that slip, does so within one of the windows
    return min(loose or found, key=lambda r: r.least, default=None)


def _later(x: Array, delay: int) -> Array:
    """A series, `delay` cells later; NaN where it then has none. Shape (cells,)."""
    out = np.full(x.size, np.nan)
    if delay >= 0:
        out[delay:] = x[: x.size - delay]
    else:
        out[:delay] = x[-delay:]
    return out


def _alike(y: Array, x: Array) -> float:
    """Size of the correlation of two series about 0 [1]; 0 where either is nothing."""
    known = np.isfinite(y) & np.isfinite(x)
    size = float(y[known] @ y[known]) * float(x[known] @ x[known])
    return abs(float(y[known] @ x[known])) / np.sqrt(size) if size > 0.0 else 0.0


def _related(y: Array, x: Array, reach: int, gains: tuple[float, float]) -> _Related | None:
    """How x follows y; None where it does not."""
    known = np.isfinite(y) & np.isfinite(x)
    if np.count_nonzero(known) < _LEAST * reach:
        return None
    y, x = y[known], x[known]
    alike = _alike(y, x)
    if alike < _RELATED or alike * np.sqrt(y.size / (3.0 * reach)) < _SURE:
        return None
    gain, kept = 0.0, np.ones(y.size, np.bool_)
    for _ in range(_ROUNDS):
        gain = float(x[kept] @ y[kept]) / max(float(y[kept] @ y[kept]), 1e-12)
        off = np.abs(x - gain * y)
        kept = off <= np.quantile(off, _KEPT)
    if not gains[0] <= abs(gain) <= gains[1]:
        return None
    size = np.abs(y)
    noise = max(float(np.quantile(off[size <= np.quantile(size, _SMALL)], _KEPT)) / _NORMAL_90, 1e-6)
    large = size >= max(float(np.quantile(size, _LARGE)), _ABOVE * noise / abs(gain))
    if np.count_nonzero(large) < reach:  # no change of the mission shows how closely x follows
        return None
    share = np.sqrt(np.maximum(off[large] ** 2 - noise**2, 0.0)) / (abs(gain) * size[large])
    apart = float(np.quantile(share, _KEPT)) / _NORMAL_90
    usual = float(np.quantile(size, _KEPT)) / _NORMAL_90
    return _Related(gain, noise, max(apart, _LEAST_SPREAD), usual)
