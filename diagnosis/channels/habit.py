"""How a channel is updated: at every sample, in counting windows, or when the wheel has travelled from pole to pole.

A counting window gives one value for its whole length; a pole sensor gives the mean speed between two poles, holds it until
the next one, longer at low speed, and reads zero after a timeout. Held values are no news, and a hold speaks for a stuck
channel only beyond this habit. No healthy window is assumed: every figure is a median over windows in which values change.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import rounding_step, usual_distance
from replay.arrays.quantiles import median_of

Array = NDArray[np.float64]

_WINDOW_S = 0.5
_LEAST_RUNS, _LEAST_WINDOWS = 3, 5
_MOST_WINDOWS = 300
_SHORT, _ABOUT = 0.2, 1.3  # quantile of the runs of a window: a repeated value is one long run; how alike two are
_FALLING = -0.35  # exponent of the hold over the speed: −1 between poles, 0 in counting windows
_APART = 0.3  # least distance of two log-speeds that say something about it
_LEAST_PAIRS = 20
_TICK_RUNS, _TICK_PARTS = 60, 100  # runs in a part, and parts that are looked at
_COUNTS = 0.5  # of the distance of two values
_ALIKE, _PASSED, _MOSTLY, _SLOWER = 1.6, 3.0, 0.6, 1.3
_LONG_HOLD = 2.5  # periods
_TIMEOUT_S, _LONGEST_S = 0.25, 1.0


class Habit(NamedTuple):
    """How long a channel holds a value.

    Attributes
    ----------
    window : float
        Shortest hold [s]; the sample period where every sample is news.
    travel : float
        What moves past between two updates [unit·s]; 0 where the hold does not depend on the speed.
    timeout : float
        Longest hold [s], after which the channel reads zero.
    stepwise : bool
        Whether values are held for longer than a sample.
    tick : float
        Rounding step of the inverse of the value [1/unit]: time between two poles is counted in clock ticks.
    """

    window: float
    travel: float
    timeout: float
    stepwise: bool
    tick: float = 0.0

    def hold(self, speed: Array) -> Array:
        """Time between two updates at some speeds [s]. Both of one shape (k,); speeds in m/s."""
        if not self.travel:
            return np.full(speed.shape, self.window)
        with np.errstate(divide="ignore", over="ignore"):
            return np.clip(self.travel / np.abs(speed), self.window, self.timeout)

    def rounding_noise(self, lsb: float) -> float:
        """Variance of the white part of a channel by its rounding alone, as second differences show it [unit²].

        A value is off by lsb²/12. A count is the difference of two rounded places, f(k) − f(k−1), so that the second
        differences of counts are third differences of f, of 20 times its variance and 20/6 of that as white noise.
        """
        return lsb**2 / 12 * (20.0 / 6.0 if self.stepwise else 1.0)

    def rounding(self, speed: Array) -> Array:
        """Rounding step at some speeds by the counted time [unit]. Both of one shape (k,)."""
        return np.asarray(self.tick * speed**2)


EVERY_SAMPLE = Habit(0.0, 0.0, 0.0, stepwise=False)


class _Runs(NamedTuple):
    """Runs of one value between two changes: first step, length [steps], the value held and the next one."""

    start: NDArray[np.intp]
    length: NDArray[np.intp]
    value: Array
    following: Array


def identify_habit(y: Array, fresh: NDArray[np.bool_], dt: float) -> Habit:
    """Habit of a channel.

    Parameters
    ----------
    y : Array, shape (n,)
        Its readings; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new sample.
    dt : float
        Step [s].
    """
    known = fresh & np.isfinite(y)
    period = dt * (usual_distance(known) if np.count_nonzero(known) > 1 else 1.0)
    every = Habit(period, 0.0, period, stepwise=False)
    runs = _runs(y, known)
    moving = (runs.value != 0.0) & (runs.following != 0.0) & ~_fading(runs, period / dt)
    parts = _parts_of(runs, moving, max(1, round(_WINDOW_S / dt)))
    if parts.runs.size < _LEAST_WINDOWS:
        return every
    shortest = _short(parts)
    window = float(median_of(shortest)) * dt
    if window < 1.5 * period:
        travel = _slow_travel(parts, shortest, runs, moving, (period, dt))
        return (
            every
            if travel is None
            else Habit(period, travel, _timeout(runs, travel, dt), stepwise=True, tick=_tick(runs))
        )
    kept = parts.length <= _ABOUT * shortest[parts.window]
    distance = dt * _medians((parts.length * parts.following)[kept], parts.window[kept])
    speed = _medians(parts.following, parts.window)
    slope = _slope(np.log(speed), np.log(shortest))
    if slope is not None and slope > _FALLING:
        return Habit(window, 0.0, window, stepwise=True, tick=_tick(runs))
    travel = float(median_of(distance))
    return Habit(period, travel, _timeout(runs, travel, dt), stepwise=True, tick=_tick(runs))


def _slow_travel(
    parts: _Parts, shortest: Array, runs: _Runs, moving: NDArray[np.bool_], steps: tuple[float, float]
) -> float | None:
    """Distance between poles [unit·s] of a sensor whose poles only come slower than its samples where the wheel is slow.

    None where the holds of slow windows, or the long holds of all of them, do not go with 1/speed, or fast windows should
    have held as well. `steps` are the channel's period and the timeline's step [s].
    """
    period, dt = steps
    speed = _medians(parts.following, parts.window)
    slow = shortest * dt >= 1.5 * period
    hold: NDArray[np.floating] = (shortest * dt)[slow]
    at: NDArray[np.floating] = speed[slow]
    if hold.size < _LEAST_WINDOWS:
        long = moving & (runs.length * dt >= _LONG_HOLD * period)
        hold, at = runs.length[long] * dt, np.abs(runs.following[long]).astype(np.float64)
    if hold.size < _LEAST_WINDOWS:
        return None
    travel = float(median_of(hold * at))
    alike = np.abs(np.log(hold * at / travel)) < np.log(_ALIKE)
    passes = travel / speed[~slow] < _PASSED * period
    fits = np.mean(alike) >= _MOSTLY and (not passes.size or np.mean(passes) >= _MOSTLY)
    return travel if fits and at.max() > _SLOWER * at.min() else None


def _runs(y: Array, known: NDArray[np.bool_]) -> _Runs:
    steps = np.flatnonzero(known)
    values = y[steps]
    change = np.flatnonzero(np.diff(values) != 0.0) + 1
    start = steps[change]
    return _Runs(start[:-1], np.diff(start), values[change[:-1]], values[change[1:]])


def _fading(runs: _Runs, sample: float) -> NDArray[np.bool_]:
    """Runs of one sample that only say that the next pole is late: its speed can be no more than a pole in this time."""
    falls = np.abs(runs.value) < np.abs(np.r_[np.inf, runs.value[:-1]])
    return np.asarray(falls & (runs.length <= 1.5 * sample))


class _Parts(NamedTuple):
    """Runs of some windows of the mission, window by window: length [steps] and size of the value that follows; runs per window."""

    window: NDArray[np.intp]
    length: NDArray[np.intp]
    following: Array
    runs: NDArray[np.intp]


def _parts_of(runs: _Runs, use: NDArray[np.bool_], width: int) -> _Parts:
    """Windows of `width` steps with several runs, spread evenly over the mission where there are more than are needed."""
    window = runs.start[use] // width
    first = np.flatnonzero(np.diff(window, prepend=-1))
    count = np.diff(first, append=window.size)
    many = np.flatnonzero(count >= _LEAST_RUNS)
    some = many[np.linspace(0, many.size - 1, min(many.size, _MOST_WINDOWS)).round().astype(np.intp)]
    places = np.repeat(first[some] - np.cumsum(count[some]) + count[some], count[some]) + np.arange(count[some].sum())
    number = np.repeat(np.arange(some.size), count[some])
    return _Parts(number, runs.length[use][places], np.abs(runs.following[use][places]), count[some])


def _short(parts: _Parts) -> Array:
    """A short run of every window, but not the shortest ones [steps]."""
    order = np.sort(parts.window * (parts.length.max() + 1) + parts.length) - parts.window * (parts.length.max() + 1)
    first = np.cumsum(parts.runs) - parts.runs
    return np.asarray(order[first + np.rint(_SHORT * (parts.runs - 1)).astype(np.intp)], dtype=np.float64)


def _medians(values: Array, window: NDArray[np.intp]) -> Array:
    """Median of the values of every window, which stand together."""
    ordered = values[np.lexsort((values, window))]
    first = np.flatnonzero(np.diff(window, prepend=-1))
    count = np.diff(first, append=window.size)
    return np.asarray((ordered[first + (count - 1) // 2] + ordered[first + count // 2]) / 2)


def _slope(x: Array, y: Array) -> float | None:
    """Median slope of all pairs that lie apart in x (Theil and Sen); None where there are too few."""
    i, j = np.triu_indices(x.size, 1)
    apart = np.abs(x[i] - x[j]) > _APART
    if np.count_nonzero(apart) < _LEAST_PAIRS:
        return None
    i, j = i[apart], j[apart]
    return float(median_of((y[i] - y[j]) / (x[i] - x[j])))


def _tick(runs: _Runs) -> float:
    """Step on which the inverse of the held values lies; 0 where most parts of the mission show none.

    Only of the faster half of the values: their own rounding blurs the inverse of a slow one. Values that lie on a step themselves
    are counts of poles in a window, and no times.
    """
    held = np.abs(runs.value[(runs.length > 1) & (runs.value != 0.0)])
    held = held[held >= median_of(held)] if held.size else held
    apart = np.diff(np.unique(held))
    if not apart.size or rounding_step(held) > _COUNTS * float(median_of(apart)):
        return 0.0
    parts = np.array_split(held, max(1, held.size // _TICK_RUNS))
    some = np.linspace(0, len(parts) - 1, min(len(parts), _TICK_PARTS)).round().astype(np.intp)
    steps = np.array([rounding_step(1.0 / parts[k]) for k in some])
    return float(median_of(steps[steps > 0.0])) if np.mean(steps > 0.0) > 0.5 else 0.0


def _timeout(runs: _Runs, travel: float, dt: float) -> float:
    """Hold before the channel falls to zero [s]: by its length, or by the speed that it stands for where it fades."""
    fell = (runs.following == 0.0) & (runs.value != 0.0)
    if not fell.any():
        return _TIMEOUT_S
    held = np.maximum(runs.length[fell] * dt, travel / np.abs(runs.value[fell]))
    return float(np.clip(median_of(held), 2 * dt, _LONGEST_S))


def of_kind(habits: Sequence[Habit]) -> list[Habit]:
    """Habits of sensors of one kind: one that did not show its own has what half of them, or more, have."""
    shown = [h for h in habits if h.stepwise]
    if 2 * len(shown) < len(habits) or len(shown) < 2:
        return list(habits)
    window, travel, timeout, _, tick = (float(x) for x in median_of(np.array(shown, dtype=np.float64), axis=0))
    usual = Habit(window, travel, timeout, stepwise=True, tick=tick)
    between = usual.travel > 0.0
    return [h if h.stepwise and (h.travel > 0.0) is between else usual for h in habits]
