"""What is measured twice on a steering axle, in blocks: a second angle, and the valve's position beside its command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.noise import relative_lag, shifted, slow_mismatch
from diagnosis.steering_blocks import SteeringBlocks, second_differences

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_MAX_LAG_S = 0.05
_SHARE_RANGE = (0.85, 1.15)
_LEAST_CHANGES = 4


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
    most = max(1, round(_MAX_LAG_S / dt)) if dt <= _MAX_LAG_S else 0
    moved = shifted(true, -relative_lag(true, y, use, -most, most))
    known = np.isfinite(moved)
    mean, count = _means(moved, known, blocks)
    power = _white(moved[known])
    slow = np.nan_to_num(slow_mismatch(moved - y, use & np.isfinite(moved), dt))
    second = blocks.second.copy()
    second[:, 0] = np.where(count > 0, mean, np.nan)
    second[:, 1] = power / np.maximum(count, 1) + max(slow**2 - power, 0.0) + tolerance**2
    return replace(blocks, second=second)


def with_position(
    blocks: SteeringBlocks, u: Array, position: Array, fresh: Flags, dt: float
) -> tuple[SteeringBlocks, Array]:
    """Add the valve's position: its mean beside the command's, and how much of the command's changes it follows.

    The second says whether a valve obeys even where only the sensor's noise moves its command.

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
        With the position.
    Array, shape (n,)
        Position less command, at the command's time, as multiples of its healthy noise; NaN where unknown.
    """
    use = fresh & np.isfinite(u) & np.isfinite(position)
    most = max(1, round(_MAX_LAG_S / dt)) if dt <= _MAX_LAG_S else 0
    lag = _jitter_lag(position, u, use, most)
    lag = relative_lag(position, u, use, 0, most) if lag is None else lag
    command = shifted(u, lag)
    known = use & np.isfinite(command)
    off = np.where(known, position - command, 0.0)
    power = max(_white(off[known]), 1e-8)
    u_mean, count = _means(command, known, blocks)
    p_mean, _ = _means(position, known, blocks)
    width = blocks.length
    places = np.minimum(np.arange(u.size) // width, count.size - 1)
    du = np.where(known, command - u_mean[places], 0.0)
    dp = np.where(known, position - p_mean[places], 0.0)
    starts = np.arange(0, u.size, width)
    changes = np.add.reduceat(du * du, starts)
    together = np.add.reduceat(du * dp, starts)
    slow = np.nan_to_num(slow_mismatch(np.where(known, off, np.nan), known, dt))
    second = blocks.second.copy()
    some = count > 0
    second[:, 2] = np.where(some, p_mean, np.nan)
    second[:, 3] = power / np.maximum(count, 1) + max(slow**2 - power, 0.0) / 4 + 0.05 * power
    second[:, 6] = np.where(some, u_mean, np.nan)
    lively = (changes > 1e-3 * power) & (count >= _LEAST_CHANGES)
    if lively.any():
        windows = np.add.reduceat(np.stack([together, changes]) * lively, np.arange(0, starts.size, 100), axis=1)
        share = windows[0] / np.maximum(windows[1], 1e-30)
        if _SHARE_RANGE[0] < float(np.median(share[windows[1] > 0])) < _SHARE_RANGE[1]:
            second[lively, 4] = together[lively] / changes[lively]
            second[lively, 5] = power / changes[lively]
    off = shifted(np.where(known, off / np.sqrt(power), np.nan), -round(lag))
    return replace(blocks, second=second), off


def _jitter_lag(position: Array, u: Array, use: Flags, most: int) -> float | None:
    """Delay [steps] at which the position's changes from sample to sample follow the command's; None where none do."""
    if u.size <= 2 * most:
        return None
    du = np.diff(np.where(use, u, 0.0), prepend=0.0)
    dp = np.diff(np.where(use, position, 0.0), prepend=0.0)
    limit = 10 * float(np.median(np.abs(du))) + 1e-12  # the small jitter of a healthy sensor, not jumps
    du[np.abs(du) > limit] = 0.0
    inner = dp[most:] * (np.abs(dp[most:]) < 10 * float(np.median(np.abs(dp))) + 1e-12)
    together = np.array([float(inner @ du[most - k : du.size - k]) for k in range(most + 1)])
    scale = float(np.sqrt((inner @ inner) * (du @ du) / max(inner.size, 1)))
    best = int(np.argmax(together))
    return float(best) if scale > 0 and together[best] > 8 * scale else None


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
    return float(np.median(squares[: count * 200].reshape(count, 200).mean(axis=1)))
