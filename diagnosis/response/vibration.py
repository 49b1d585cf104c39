"""Whether the body moves or stands, by how an inertial unit shakes: whatever its axis, sign and unit are.

A body that rolls shakes; one that stands leaves the unit its own noise, or what an engine makes of it. How much either is, the rest of the
mission shows: without rest and motion in it, and without a gap between the two, nothing is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.runs import runs_of

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_WINDOW_S = 0.5
_RESTS, _MOVES = 0.05, 0.2  # of the usual speed: below it stands, above it moves
_AROUND = 1  # windows beside a change, which are neither
_LEAST_REST, _LEAST_MOTION = 4, 20  # windows of either that show how it shakes
_LOW, _HIGH = 0.05, 0.95  # quantiles of a usual window
_APART = 2.0  # times what shakes at rest, that motion does not fall short of
_ALL = 0.9  # of a time
_SHORT = 2  # windows that tell nothing of a time


class Unit(NamedTuple):
    """An inertial unit.

    Attributes
    ----------
    acceleration : Array, shape (n,)
        Forward acceleration [m/s²]; NaN where not valid.
    fresh : Flags, shape (n,)
        Steps with a new reading.
    """

    acceleration: Array
    fresh: Flags


class Vibration(NamedTuple):
    """How the unit shakes.

    Attributes
    ----------
    level : Array, shape (windows,)
        Mean change from reading to reading of each window [m/s²]; NaN where it has too few.
    rest, motion : float
        Most of what is usual at rest, least of what is in motion [m/s²]; `rest` is NaN where the mission does not show it apart from motion.
    width : int
        Steps of a window.
    """

    level: Array
    rest: float
    motion: float
    width: int

    @property
    def between(self) -> float:
        """What parts the two [m/s²]."""
        return float(np.sqrt(np.maximum(self.rest, 1e-9) * self.motion))

    def share_moving(self, start: int, stop: int) -> float:
        """Share of the windows in steps [start, stop) that shake as in motion; NaN where there are too few."""
        first, last = -(-start // self.width), stop // self.width
        part = self.level[first:last]
        part = part[np.isfinite(part)]
        return float(np.mean(part > self.between)) if part.size >= _SHORT and np.isfinite(self.rest) else np.nan

    def moves(self, start: int, stop: int) -> bool:
        """Whether it shakes as in motion in nearly all of steps [start, stop)."""
        return self.share_moving(start, stop) >= _ALL

    def stands(self, start: int, stop: int) -> bool:
        """Whether it shakes as at rest in nearly all of steps [start, stop)."""
        return self.share_moving(start, stop) <= 1.0 - _ALL


def levels_of(acceleration: Array, fresh: Flags, dt: float) -> tuple[Array, int]:
    """Mean change from reading to reading in windows of half a second, shape (windows,), and the steps of one.

    Parameters
    ----------
    acceleration : Array, shape (n,)
        Readings [m/s²]; NaN where not valid.
    fresh : Flags, shape (n,)
        Steps with a new one.
    dt : float
        Step [s].
    """
    width = max(1, round(_WINDOW_S / dt))
    step = np.flatnonzero(fresh & np.isfinite(acceleration))
    number = -(-acceleration.size // width)
    if step.size < 2:
        return np.full(number, np.nan), width
    at, change = step[1:] // width, np.abs(np.diff(acceleration[step]))
    count = np.bincount(at, minlength=number)
    total = np.bincount(at, change, number)
    enough = count >= max(2, round(0.25 * np.median(count[count > 0])))
    return np.where(enough, total / np.maximum(count, 1), np.nan), width


def vibration_of(unit: Unit, speeds: Array, aside: Sequence[tuple[int, int]], dt: float) -> Vibration | None:
    """How the unit shakes at rest and in motion; None where the mission does not show the latter.

    Parameters
    ----------
    unit : Unit
        The inertial unit.
    speeds : Array, shape (n,)
        Largest size of all readings of the machine's speeds at each step [m/s]; NaN where unknown.
    aside : Sequence[tuple[int, int]]
        Steps [start, stop) in which what they say is in question: no example of either.
    dt : float
        Step [s].
    """
    level, width = levels_of(unit.acceleration, unit.fresh, dt)
    cut = np.full(level.size * width, np.nan)
    cut[: speeds.size] = np.abs(speeds)
    table = cut.reshape(level.size, width)
    known = np.isfinite(table).any(axis=1)
    most = np.where(known, np.max(np.where(np.isfinite(table), table, 0.0), axis=1), np.nan)
    least = np.where(known, np.min(np.where(np.isfinite(table), table, np.inf), axis=1), np.nan)
    if not (known & (most > 0.0)).any():
        return None
    usual = float(np.quantile(most[known & (most > 0.0)], 0.9))
    free = np.isfinite(level) & known
    for start, stop in aside:
        free[max(0, start // width - _AROUND) : -(-stop // width) + _AROUND] = False
    rest = _inside(most <= _RESTS * usual) & free
    motion = _inside(least >= _MOVES * usual) & free
    if np.count_nonzero(motion) < _LEAST_MOTION:
        return None
    moving, at_rest = float(np.quantile(level[motion], _LOW)), np.nan
    if np.count_nonzero(rest) >= _LEAST_REST:
        at_rest = float(np.quantile(level[rest], _HIGH))
    return Vibration(level, at_rest if moving > _APART * at_rest else np.nan, moving, width)


def _inside(flags: Flags) -> Flags:
    """Flags without the first and last ones of each run, shape (windows,): what came before, or comes next, still shakes there."""
    out = np.zeros(flags.size, np.bool_)
    for start, stop in runs_of(flags):
        out[start + _AROUND : max(start + _AROUND, stop - _AROUND)] = True
    return out
