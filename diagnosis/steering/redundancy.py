"""What is measured redundantly on a steering axle, in blocks: a second angle, and the valve's opening beside its command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import relative_lag, shifted, slow_mismatch
from diagnosis.channels.relation import Relation, relation_of
from diagnosis.steering.blocks import SteeringBlocks, second_differences
from replay.arrays.quantiles import median_of

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: What two healthy instruments differ by at most, of full opening or in rad; those of tuning machines differ by up to 0.003.
MOST_APART = 0.02
_MAX_LAG_S = 0.05
_ZERO_ERROR = 0.01  # rad: what two healthy angle sensors are set to zero apart
_SHARE_RANGE = (0.85, 1.15)
_LEAST_CHANGES = 4
_LEAST_SHARE = 0.5
_JITTER_S = 0.25
_AS_GOOD = 1.5  # times the power that a lag leaves: a valve that leaves no more at once has none
_LAG_ERROR = 0.2  # of a lag
_JITTER = 4.0  # standard deviations
_MEDIAN_SQUARE = 0.455  # of a standard normal variable


def with_second_angle(
    blocks: SteeringBlocks, y: Array, true: Array, fresh: Flags, dt: float, tolerance: float
) -> SteeringBlocks:
    """Add a second measurement of the angle.

    Parameters
    ----------
    blocks : SteeringBlocks
        The axle.
    y, true : Array, shape (n,)
        Angle and second angle [rad]; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new second angle.
    dt : float
        Step [s].
    tolerance : float
        What two healthy instruments may differ by [rad].
    """
    use = fresh & np.isfinite(y) & np.isfinite(true)
    most = most_lag(dt)
    moved = shifted(true, -relative_lag(true, y, use, -most, most))
    moved = moved + _zero_error(y - moved, use & np.isfinite(moved))
    known = np.isfinite(moved)
    mean, count = _means(moved, known, blocks)
    power = _white(moved[known])
    slow = _slow(moved - y, use & np.isfinite(moved), dt)
    redundancy = blocks.redundancy._replace(
        angle=np.where(count > 0, mean, np.nan),
        angle_variance=power / np.maximum(count, 1) + max(slow**2 - power, 0.0) + tolerance**2,
    )
    return replace(blocks, redundancy=redundancy)


def _slow(deviation: Array, use: Flags, dt: float) -> float:
    """How far two instruments usually differ, as far as healthy ones do: a fault from start to end is no usual difference."""
    return float(np.clip(np.nan_to_num(slow_mismatch(deviation, use, dt)), 0.0, MOST_APART))


def _zero_error(apart: Array, use: Flags) -> float:
    """How far apart two angles were set to zero [rad], as the mission's median says it, as far as healthy ones are."""
    return float(np.clip(median_of(apart[use]), -_ZERO_ERROR, _ZERO_ERROR)) if use.any() else 0.0


def with_valve_opening(
    blocks: SteeringBlocks, u: Array, position: Array, fresh: Flags, dt: float
) -> tuple[SteeringBlocks, Array]:
    """Add the valve's opening: its mean beside the command's, and how much of the command's changes it follows.

    The share of changes says whether a valve obeys even where only the sensor's noise moves its command; a log that is slower
    than the controller does not show it.

    Parameters
    ----------
    blocks : SteeringBlocks
        The axle.
    u, position : Array, shape (n,)
        Command and position [fraction]; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new position.
    dt : float
        Step [s].

    Returns
    -------
    SteeringBlocks
        With the opening.
    Array, shape (n,)
        Position less command, at the command's time, as multiples of its healthy noise; NaN where unknown.
    """
    use = fresh & np.isfinite(u) & np.isfinite(position)
    most = most_lag(dt)
    linked = _jitter_lag(position, u, use, most)
    lag = relative_lag(position, u, use, 0, most)
    command, doubt = _followed(position, u, use, lag, dt, blocks.length)
    if linked is not None:
        at_once = shifted(u, linked)
        if _apart(position, at_once, use) <= _AS_GOOD * _apart(position, command, use):
            lag, command, doubt = linked, at_once, np.zeros(u.size)
        else:
            linked = None
    known = use & np.isfinite(command)
    deviation = np.where(known, position - command, 0.0)
    power = max(_white(deviation[known]), 1e-8)
    slow = _slow(np.where(known, deviation, np.nan), known, dt)
    command_mean, count = _means(command, known, blocks)
    opening, _ = _means(position, known, blocks)
    share, share_variance = _followed_share(
        np.where(known, command - _held(command_mean, u.size, blocks.length), 0.0),
        np.where(known, position - _held(opening, u.size, blocks.length), 0.0),
        count,
        power,
        blocks.length,
    )
    variance = power / np.maximum(count, 1) + max(slow**2 - power, 0.0) / 4 + 0.05 * power
    variance += _means(doubt, known, blocks)[0]
    if linked is None:
        share, share_variance = np.full(count.size, np.nan), np.full(count.size, np.nan)
    some = count > 0
    redundancy = blocks.redundancy._replace(
        opening=np.where(some, opening, np.nan),
        opening_variance=variance,
        share=share,
        share_variance=share_variance,
        command=np.where(some, command_mean, np.nan),
    )
    deviation = shifted(np.where(known, deviation / np.sqrt(power), np.nan), -round(lag))
    return replace(blocks, redundancy=redundancy), deviation


def _followed(position: Array, u: Array, use: Flags, delay: float, dt: float, length: int) -> tuple[Array, Array]:
    """Command as a healthy valve follows it, whatever its gain, and the variance of a block's mean of that.

    A valve that answers behind a lag follows the command's jitter no further than the lag lets it; of one without a lag, the
    jitter is evened out. Where the command moves, the lag's own error counts.
    """
    span = float(np.max(np.abs(u[use]), initial=0.0))
    found = relation_of(position, u, use, Relation(delay=delay), dt, (0, most_lag(dt)), span)._replace(gain=1.0)
    even, jitter = _without_jitter(u, np.isfinite(u), dt)
    jitter = np.nan_to_num(shifted(jitter, found.delay))
    if found.lag <= dt:
        return found.expected(even, dt), jitter / length
    kept = float(np.exp(-dt / found.lag))
    command = found.expected(u, dt)
    at_once = found._replace(lag=0.0).expected(u, dt)
    lasting = max(1.0, 2 * found.lag / (length * dt))  # blocks for which an error lasts
    of_lag = np.nan_to_num(_LAG_ERROR * (command - at_once)) ** 2
    return command, lasting * ((1.0 - kept) / (1.0 + kept) * jitter + of_lag)


def _apart(position: Array, command: Array, use: Flags) -> float:
    """Power of what a position differs from its command by [1]."""
    known = use & np.isfinite(command)
    return float(np.mean((position[known] - command[known]) ** 2)) if known.any() else np.inf


def most_lag(dt: float) -> int:
    """Largest delay between two instruments [steps]."""
    return max(1, round(_MAX_LAG_S / dt)) if dt <= _MAX_LAG_S else 0


def _held(means: Array, size: int, length: int) -> Array:
    """Means of blocks at every one of `size` samples."""
    return np.asarray(means[np.minimum(np.arange(size) // length, means.size - 1)])


def _followed_share(
    command_changes: Array, opening_changes: Array, count: Array, power: float, length: int
) -> tuple[Array, Array]:
    """Share of the command's changes within a block that the opening follows, and its variance; NaN where unknown.

    Parameters
    ----------
    command_changes, opening_changes : Array, shape (n,)
        Command and opening less their means over the block [fraction].
    count : Array, shape (m,)
        Known samples of each block.
    power : float
        Power of the opening's noise [fraction²].
    length : int
        Samples per block.
    """
    starts = np.arange(0, command_changes.size, length)
    changes = np.add.reduceat(command_changes * command_changes, starts)
    together = np.add.reduceat(command_changes * opening_changes, starts)
    share, variance = np.full(starts.size, np.nan), np.full(starts.size, np.nan)
    lively = (changes > 1e-3 * power) & (count >= _LEAST_CHANGES)
    if lively.any():
        windows = np.add.reduceat(np.stack([together, changes]) * lively, np.arange(0, starts.size, 100), axis=1)
        by_window = windows[0] / np.maximum(windows[1], 1e-30)
        if _SHARE_RANGE[0] < float(median_of(by_window[windows[1] > 0])) < _SHARE_RANGE[1]:
            share[lively] = together[lively] / changes[lively]
            variance[lively] = power / changes[lively]
    return share, variance


def _jitter_lag(position: Array, u: Array, use: Flags, most: int) -> float | None:
    """Delay [steps] at which the position follows the command's jitter from sample to sample; None where it does not."""
    if u.size <= 2 * most:
        return None
    du, dp = (np.diff(np.where(use, x, 0.0), 2, prepend=[0.0, 0.0]) for x in (u, position))
    limit = 10 * float(median_of(np.abs(du))) + 1e-12  # the small jitter of a healthy sensor, not jumps
    du[np.abs(du) > limit] = 0.0
    inner = dp[most:] * (np.abs(dp[most:]) < 10 * float(median_of(np.abs(dp))) + 1e-12)
    together = np.array([float(inner @ du[most - k : du.size - k]) for k in range(most + 1)])
    scale = float(np.sqrt((inner @ inner) * (du @ du) / max(inner.size, 1)))
    best = int(np.argmax(together))
    follows = together[best] > max(8 * scale, _LEAST_SHARE * float(du @ du))
    return float(best) if scale > 0 and follows else None


def _without_jitter(command: Array, known: Flags, dt: float) -> tuple[Array, Array]:
    """The command with its sample-to-sample jitter evened out, and the jitter's local power.

    A log slower than the controller shows jitter that its record of the position does not follow sample by sample: a
    healthy valve would look like one that rests, or does what it likes.
    """
    size = command.size
    filled = np.interp(np.arange(size), np.flatnonzero(known), command[known]) if known.any() else np.zeros(size)
    width = max(3, round(_JITTER_S / dt))
    squares = second_differences(filled)
    rows = np.pad(squares, (0, -size % width), mode="edge").reshape(-1, width)
    power = median_of(rows, axis=1) / _MEDIAN_SQUARE  # a jump is no jitter
    near = np.pad(power, 1, mode="edge")
    jitter = np.repeat(np.maximum(np.maximum(near[:-2], near[2:]), power), width)[:size]
    total = np.concatenate([[0.0], np.cumsum(filled)])
    before, after = (np.clip(np.arange(size) + k, 0, size) for k in (-width, width + 1))
    even = (total[after] - total[before]) / (after - before)
    small = np.abs(filled - even) < _JITTER * np.sqrt(jitter)
    return np.where(small, even, filled), jitter


def _means(x: Array, known: Flags, blocks: SteeringBlocks) -> tuple[Array, Array]:
    """Mean of the known samples of each block, and their number."""
    starts = np.arange(0, x.size, blocks.length)
    count = np.add.reduceat(known.astype(np.float64), starts)
    total = np.add.reduceat(np.where(known, x, 0.0), starts)
    return np.asarray(total / np.maximum(count, 1.0)), np.asarray(count)


def _white(values: Array) -> float:
    """Power of the white part in the median window of 200 samples."""
    squares = second_differences(values)
    count = squares.size // 200
    if count < 3:
        return float(squares.mean()) if squares.size else 0.0
    return float(median_of(squares[: count * 200].reshape(count, 200).mean(axis=1)))
