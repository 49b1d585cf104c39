"""Speed sensors as they are: how each is updated, how its noise grows with the speed, and how late it may be.

A stepwise sensor brings news once per hold; what it reads is the speed of a little while ago, off by what the wheels
have changed their speed by since. Sensors of one kind share what faults hide of one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.habit import Habit, identify_habit, of_kind
from diagnosis.channels.held import held_reference, news_alone
from diagnosis.channels.noise import usual_distance, white_part
from diagnosis.channels.noise_growth import noise_growth
from diagnosis.channels.sample_status import PAIR
from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.step_kernel import RESTLESS, RESTS
from replay.arrays.quantiles import median_known, median_of, quantile_of

Array = NDArray[np.float64]

_COUNTED = 1.0 / 6.0  # variance of a time between two ticks, of its step squared
_LEAST = 0.05  # of the noise's variance: white noise at standstill
_SIBLINGS, _ALIKE = 3, 1.5
_LEAST_REST_S = 0.5
_RESTED, _LONG = (
    0.75,
    25.0,
)  # quantile of the time, and times its rests: healthy ones reached 17 times it in tuning missions
_OFTEN, _OFTEN_SHARE = 4.0, 0.3  # samples in a block from which its rises tell anything, and their share in noise


class SpeedNoise(NamedTuple):
    """White noise of a speed sensor: √(floor² + (share·v)² + rounding(v)²/6).

    Attributes
    ----------
    floor, share : float
        At standstill [m/s], and per speed [1].
    usual : float
        At the usual speed of its wheel [m/s].
    """

    floor: float
    share: float
    usual: float

    @property
    def grows(self) -> bool:
        """Whether it depends on the speed."""
        return self.usual > self.floor


def habits_of(y: Array, fresh: Sequence[NDArray[np.bool_]], dt: float) -> list[Habit]:
    """Habit of every wheel's speed sensor; y (n, wheels) [m/s]."""
    return of_kind([identify_habit(y[:, i], one, dt) for i, one in enumerate(fresh)])


def news(status: NDArray[np.int8], y: Array, habits: Sequence[Habit], dt: float) -> NDArray[np.int8]:
    """Status with `SKIP` for what repeats the reading before within the habit of its sensor, shape (n, wheels).

    The hold is that of the wheels' usual speed or of the wheel's own, whichever is shorter.

    Speeds in m/s, `dt` in s.
    """
    if not any(h.stepwise for h in habits):
        return status
    usual = _usual_speed(np.abs(y))
    out = status.copy()
    for i, habit in enumerate(habits):
        if habit.stepwise:
            hold = habit.hold(np.maximum(usual, np.abs(np.nan_to_num(y[:, i]))))
            out[:, i] = news_alone(np.ascontiguousarray(status[:, i]), np.ascontiguousarray(y[:, i]), hold, dt)
    return out


def _usual_speed(y: Array) -> Array:
    """Median over the wheels, 0 where none is known, shape (n,)."""
    known = np.isfinite(y)
    out = np.zeros(len(y))
    whole = known.all(axis=1)
    out[whole] = median_of(y[whole], axis=1)
    some = known.any(axis=1) & ~whole
    out[some] = median_known(y[some], axis=1)
    return out


def speed_noises(y: Array, status: NDArray[np.int8], habits: Sequence[Habit], dt: float) -> list[SpeedNoise | None]:
    """White noise of every sensor whose noise depends on the speed; None where it does not, or nothing shows it.

    `y` and `status` of shape (n, wheels), speeds in m/s, `dt` in s.
    """
    found = [_growth(y[:, i], status[:, i] == PAIR, habit, dt) for i, habit in enumerate(habits)]
    known = np.array([g for g in found if g is not None]).reshape(-1, 3)
    if len(known) < _SIBLINGS:
        return [g if g is not None and g.grows else None for g in found]
    floor, share = (float(x) for x in median_of(known[:, :2], axis=0))
    out: list[SpeedNoise | None] = []
    for g, habit in zip(found, habits, strict=True):
        if g is not None and (g.floor > _ALIKE * floor or g.share > _ALIKE * share + 1e-3):
            speed = np.sqrt(max(g.usual**2 - g.floor**2, 0.0)) / g.share if g.share > 0.0 else 0.0
            g = _at(floor, share, float(speed), habit)
        out.append(g if g is not None and g.grows else None)
    return out


def _growth(y: Array, new: NDArray[np.bool_], habit: Habit, dt: float) -> SpeedNoise | None:
    values = y[new]
    if values.size < 100:
        return None
    period = dt * usual_distance(new)
    size = np.abs(values)
    counted = habit.rounding(size) ** 2 * _COUNTED
    found = noise_growth(np.maximum(white_part(values) ** 2 - counted, 0.0), size, period)
    if found is None:
        return None
    moving = size[size > 0.0]
    return _at(found.floor, found.share, float(median_of(moving)) if moving.size else 0.0, habit)


def _at(floor: float, share: float, speed: float, habit: Habit) -> SpeedNoise:
    rounding = float(habit.rounding(np.array([speed]))[0])
    return SpeedNoise(floor, share, float(np.sqrt(floor**2 + (share * speed) ** 2 + _COUNTED * rounding**2)))


def with_readings(
    blocks: WheelBlocks, y: Array, habits: Sequence[Habit], noises: Sequence[SpeedNoise | None], driving: float
) -> WheelBlocks:
    """Blocks with the noise of their readings as a share of the usual one, how late they may be, and odd updates.

    Parameters
    ----------
    blocks : WheelBlocks
        The wheels.
    y : Array, shape (m, wheels)
        Readings of all samples [m/s].
    habits, noises
        Of each sensor.
    driving : float
        Speed from which a wheel drives [m/s].
    """
    if not any(h.stepwise for h in habits) and not any(noises):
        return blocks
    held = _carried(blocks.y, blocks.count > 0)
    usual = _usual_speed(held)  # with its sign: reversals count
    white, slack, count, odd = blocks.white.copy(), blocks.slack.copy(), blocks.count.copy(), blocks.habit.copy()
    rests = _rests(held, _usual_speed(np.abs(held)) > driving, blocks.dt)
    patience = _patience(rests, habits)
    for i, (habit, noise) in enumerate(zip(habits, noises, strict=True)):
        size = np.abs(held[:, i])
        if noise is not None:
            power = noise.floor**2 + (noise.share * size) ** 2 + _COUNTED * habit.rounding(size) ** 2
            white[:, i] = np.maximum(power / noise.usual**2, _LEAST)
        if habit.stepwise:
            slack[:, i] = held_reference(usual, habit, blocks.dt).spread
            count[:, i] = np.minimum(count[:, i], 1.0)  # the steps between such news are no white noise
            odd[rests[:, i] > patience, i] = RESTS
            if blocks.width >= _OFTEN:
                odd[_rises(y[:, i], blocks.width, len(held)) > _OFTEN_SHARE, i] = RESTLESS
    return replace(blocks, white=white, slack=slack, count=count, habit=odd)


def _rests(held: Array, moving: NDArray[np.bool_], dt: float) -> Array:
    """Time for which the wheels moved while a reading kept the value that it has in each block [s], (n, wheels)."""
    out = np.empty(held.shape)
    for i in range(held.shape[1]):
        first = np.flatnonzero(np.r_[True, np.diff(held[:, i]) != 0.0])
        length = np.add.reduceat(moving.astype(np.float64), first) * dt
        out[:, i] = np.repeat(length, np.diff(np.r_[first, len(held)]))
    return out


def _patience(rests: Array, habits: Sequence[Habit]) -> float:
    """Longest rest that says nothing [s], by the usual rests of the sensor that rests least but one."""
    if len(habits) < _SIBLINGS:
        return np.inf
    usual = [float(quantile_of(one[one > 0.0], _RESTED)) if (one > 0.0).any() else 0.0 for one in rests.T]
    return max(_LEAST_REST_S, _LONG * float(np.sort(usual)[1]))


def _rises(y: Array, width: int, n: int) -> Array:
    """Share of the samples of each block in which a reading grows; one that fades only says that it waits. Shape (n,)."""
    rise = np.diff(np.abs(np.nan_to_num(y)), prepend=0.0) > 0.0
    rise = np.pad(rise, (0, n * width - rise.size))
    return np.asarray(rise.reshape(n, width).mean(axis=1))


def _carried(y: Array, known: NDArray[np.bool_]) -> Array:
    """Readings held where there are none, shape (n, wheels)."""
    rows = np.where(known, np.arange(len(y))[:, np.newaxis], 0)
    return np.take_along_axis(y, np.maximum.accumulate(rows, axis=0), axis=0)
