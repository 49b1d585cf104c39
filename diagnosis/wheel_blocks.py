"""The wheels' samples in blocks of about 10 ms: mean speed, its steps from sample to sample, valve openings, status.

The valve's lag is tens of blocks long, so that nothing of it is lost in their means; what is quicker (noise, constancy,
jumps) stays in the mean square of the steps, and onsets are refined at the raw rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.modes import PAIR, SILENT, SKIP
from diagnosis.noise import white_part

Array = NDArray[np.float64]

BLOCK_S = 0.01
_RESOLVED_S = 0.0015  # a controller's step: openings of slower logs may change unseen between samples


@dataclass(frozen=True)
class WheelBlocks:
    """All wheels in n blocks of `width` samples; the last one is filled up with samples that say nothing.

    Attributes
    ----------
    width : int
        Samples per block.
    raw_dt : float
        Distance of samples [s].
    y : Array, shape (n, wheels)
        Mean of the new samples of the speed [m/s]; 0 where there are none.
    count : Array, shape (n, wheels)
        New samples.
    jitter : Array, shape (n, wheels)
        Mean squared step between consecutive new samples [m²/s²].
    u : Array, shape (n·width, wheels)
        Valve opening of every sample beyond its dead zone [fraction]; 0 where unknown.
    unsteady : Array, shape (n, wheels)
        Root mean square of what changes within a block in u [fraction].
    status : NDArray[np.int8], shape (n, wheels)
        `PAIR`, `SILENT` or `SKIP` of `diagnosis.modes`.
    quiet : NDArray[np.bool_], shape (n, wheels)
        Where a wheel is neither commanded nor expected to move.
    ratio, turn : Array, shape (n, wheels)
        Speed of each wheel per speed of the body [1], and what it rolls less because it steers [m/s]; NaN without
        geometry.
    """

    width: int
    raw_dt: float
    y: Array
    count: Array
    jitter: Array
    u: Array
    unsteady: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    ratio: Array
    turn: Array

    @property
    def dt(self) -> float:
        """Length of a block [s]."""
        return self.width * self.raw_dt

    def part(self, first: int, last: int) -> WheelBlocks:
        """Blocks [first, last) alone."""
        cut = slice(first, last)
        return WheelBlocks(
            width=self.width,
            raw_dt=self.raw_dt,
            y=self.y[cut],
            count=self.count[cut],
            jitter=self.jitter[cut],
            u=np.ascontiguousarray(self.u[first * self.width : min(last, self.y.shape[0]) * self.width]),
            unsteady=self.unsteady[cut],
            status=self.status[cut],
            quiet=self.quiet[cut],
            ratio=self.ratio[cut],
            turn=self.turn[cut],
        )

    def wander(self, speed_per_opening: Array) -> Array:
        """Error of the modelled speed after a block from openings that the log does not resolve [m/s], (n, wheels).

        Parameters
        ----------
        speed_per_opening : Array, shape (wheels,)
            K·dt/τ of one sample [m/s].
        """
        if self.raw_dt <= _RESOLVED_S:
            return np.zeros_like(self.unsteady)
        return np.asarray(self.unsteady * speed_per_opening * np.sqrt(self.width))


def block_width(dt: float) -> int:
    """Samples in a block."""
    return max(1, round(BLOCK_S / dt))


def blocks_of(
    y: Array,
    u: Array,
    status: NDArray[np.int8],
    quiet: NDArray[np.bool_],
    ratio: Array,
    turn: Array,
    dead: Array,
    dt: float,
) -> WheelBlocks:
    """Cut the wheels' channels into blocks.

    Parameters
    ----------
    y, u : Array, shape (m, wheels)
        Measured speed [m/s] and opening [fraction].
    status : NDArray[np.int8], shape (m, wheels)
        As in `diagnosis.modes`.
    quiet : NDArray[np.bool_], shape (m, wheels)
        Where a wheel is neither commanded nor expected to move.
    ratio, turn : Array, shape (m, wheels)
        As in `WheelBlocks`.
    dead : Array, shape (wheels,)
        Dead zone of each valve [fraction].
    dt : float
        Step [s].
    """
    width, (size, wheels) = block_width(dt), y.shape
    n = -(-size // width)
    fill = n * width - size
    opening = np.nan_to_num(u)
    opening = np.sign(opening) * np.maximum(np.abs(opening) - dead, 0.0)
    opening = np.pad(opening, ((0, fill), (0, 0)), mode="edge")
    parts = opening.reshape(n, width, wheels)
    unsteady = parts.std(axis=1)
    if width < 4:  # too few samples to see by themselves what changes within a block
        quick = np.stack([np.abs(white_part(opening[:, i])) for i in range(wheels)], axis=1)
        unsteady = np.maximum(unsteady, quick.reshape(n, width, wheels).mean(axis=1))
    mean, count, jitter = np.zeros((n, wheels)), np.zeros((n, wheels)), np.zeros((n, wheels))
    state = np.full((n, wheels), SKIP, dtype=np.int8)
    for i in range(wheels):
        new = np.flatnonzero(status[:, i] == PAIR)
        place = new // width
        count[:, i] = np.bincount(place, minlength=n)
        mean[:, i] = np.bincount(place, weights=y[new, i], minlength=n) / np.maximum(count[:, i], 1)
        if new.size > 1:
            gap = np.diff(new)
            near = gap <= 1.5 * float(np.median(gap))
            steps = np.where(near, np.diff(y[new, i]) ** 2, 0.0)
            known = np.bincount(place[1:], weights=near, minlength=n)
            jitter[:, i] = np.bincount(place[1:], weights=steps, minlength=n) / np.maximum(known, 1)
        silent = np.bincount(np.flatnonzero(status[:, i] == SILENT) // width, minlength=n) > 0.5 * width
        state[silent, i] = SILENT
        state[count[:, i] > 0, i] = PAIR
    edge = ((0, fill), (0, 0))
    return WheelBlocks(
        width=width,
        raw_dt=dt,
        y=mean,
        count=count,
        jitter=jitter,
        u=np.ascontiguousarray(opening),
        unsteady=unsteady,
        status=state,
        quiet=np.asarray(np.pad(quiet, edge, mode="edge").reshape(n, width, wheels).all(axis=1)),
        ratio=np.pad(ratio, edge, mode="edge").reshape(n, width, wheels).mean(axis=1),
        turn=np.pad(turn, edge, mode="edge").reshape(n, width, wheels).mean(axis=1),
    )


def per_sample(values: NDArray[np.generic], width: int, size: int) -> NDArray[np.generic]:
    """Values of blocks for every sample, shape (size,)."""
    return np.repeat(values, width)[:size]
