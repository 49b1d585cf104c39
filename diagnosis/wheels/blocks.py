"""The wheels' samples in blocks of about 10 ms: mean speed, its steps from sample to sample, valve openings, status.

The valve's lag is tens of blocks long, so that nothing of it is lost in their means; what is quicker (noise, constancy,
jumps) stays in the mean square of the steps, and onsets are refined at the raw rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import white_part
from diagnosis.channels.sample_status import PAIR, SILENT, SKIP
from diagnosis.estimation.valve_map import effective
from replay.arrays.blocks import block_means, framed, release
from replay.arrays.column_store import ColumnStore
from replay.arrays.numeric import carried
from replay.machine.config import WheelPlant

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
        Effective valve opening of every sample [fraction] (see `diagnosis.estimation.valve_map`); 0 where unknown.
    unseen : Array, shape (n, wheels)
        Part of it that lies beyond what a healthy wheel was seen with [fraction].
    unsteady : Array, shape (n, wheels)
        Root mean square of what changes within a block in u [fraction].
    status : NDArray[np.int8], shape (n, wheels)
        `PAIR`, `SILENT` or `SKIP` of `diagnosis.channels.sample_status`.
    quiet : NDArray[np.bool_], shape (n, wheels)
        Where a wheel is neither commanded nor expected to move.
    ratio, turn : Array, shape (n, wheels)
        Speed of each wheel per speed of the body [1], and what it rolls less because it steers [m/s]; NaN without
        geometry.
    blind : NDArray[np.bool_], shape (n, wheels)
        Blocks in most of which nobody knows the opening.
    white, slack : Array, shape (n, wheels)
        Variance of the readings' noise as a share of the usual one [1], and how far they may be off because they are late
        [m/s].
    habit : NDArray[np.int8], shape (n, wheels)
        What a reading shows by its updates alone: `RESTS`, `RESTLESS` or 0.
    body_speed, body_std : Array, shape (n, wheels), or None
        Speed at which each wheel rolls by sensors of the body, and its standard deviation [m/s]; NaN where unknown, None
        without any.
    """

    width: int
    raw_dt: float
    y: Array
    count: Array
    jitter: Array
    u: Array
    unseen: Array
    unsteady: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    ratio: Array
    turn: Array
    blind: NDArray[np.bool_]
    white: Array
    slack: Array
    habit: NDArray[np.int8]
    store: ColumnStore = field(default_factory=ColumnStore, repr=False)
    ended: bool = field(default=False, kw_only=True)
    body_speed: Array | None = field(default=None, kw_only=True)
    body_std: Array | None = field(default=None, kw_only=True)

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
            unseen=self.unseen[cut],
            unsteady=self.unsteady[cut],
            status=self.status[cut],
            quiet=self.quiet[cut],
            ratio=self.ratio[cut],
            turn=self.turn[cut],
            blind=self.blind[cut],
            white=self.white[cut],
            slack=self.slack[cut],
            habit=self.habit[cut],
            store=self.store,
            ended=self.ended,
            body_speed=None if self.body_speed is None else self.body_speed[cut],
            body_std=None if self.body_std is None else self.body_std[cut],
        )

    def ending(self) -> WheelBlocks:
        """The same if valves end where they were last seen, and what they give beyond is not known."""
        u = self.store.column(np.float64, self.u.shape[1:], len(self.u))
        for cut in self.store.blocks(len(self.u), self.width):
            less = self.unseen[cut.start // self.width : cut.stop // self.width]
            u.append(self.u[cut] - np.repeat(less, self.width, axis=0))
            release(self.u)
        return replace(self, u=u.finish(), ended=True)

    def wander(self, speed_per_opening: Array) -> Array:
        """Error of the modelled speed after a block from openings that the log does not resolve [m/s], (n, wheels).

        Parameters
        ----------
        speed_per_opening : Array, shape (wheels,)
            K·dt/τ of one sample [m/s].
        """
        unseen = np.where(self.blind, 2.0 * np.sqrt(self.width), 0.0)  # any opening, either way
        if self.raw_dt > _RESOLVED_S:
            unseen = np.maximum(unseen, self.unsteady)
        return np.asarray(unseen * speed_per_opening * np.sqrt(self.width))


def block_width(dt: float) -> int:
    """Samples in a block. `dt` in s."""
    return max(1, round(BLOCK_S / dt))


def blocks_of(
    y: Array,
    u: Array,
    status: NDArray[np.int8],
    quiet: NDArray[np.bool_],
    ratio: Array,
    turn: Array,
    plants: Sequence[WheelPlant | None],
    dt: float,
    store: ColumnStore | None = None,
) -> WheelBlocks:
    """Cut the wheels' channels into blocks.

    Parameters
    ----------
    y, u : Array, shape (m, wheels)
        Measured speed [m/s] and opening [fraction].
    status : NDArray[np.int8], shape (m, wheels)
        As in `diagnosis.channels.sample_status`.
    quiet : NDArray[np.bool_], shape (m, wheels)
        Where a wheel is neither commanded nor expected to move.
    ratio, turn : Array, shape (m, wheels)
        As in `WheelBlocks`.
    plants : Sequence[WheelPlant or None]
        Wheels with the maps of their valves.
    dt : float
        Step [s].
    store : ColumnStore or None
        Where long columns stand; None: one of their own.
    """
    store = store or ColumnStore()
    width, (size, wheels) = block_width(dt), y.shape
    opening, parts = store.column(np.float64, (wheels,)), []
    ends = [_Ends(_usual_gap(status[:, i])) for i in range(wheels)]
    spools: list[float | None] = [None] * wheels
    last = np.zeros(wheels)
    for cut in store.blocks(size, width):
        given, last = carried(u[cut], last)
        driving, more, spools = _effective(given, plants, spools)
        beyond = framed(driving, width)
        opening.append(beyond.reshape(-1, wheels))
        mean, count, jitter, state = _samples(y[cut], status[cut], width, len(beyond), ends)
        parts.append(
            _Part(
                y=mean,
                count=count,
                jitter=jitter,
                unseen=block_means(more, width),
                unsteady=beyond.std(axis=1),
                status=state,
                quiet=np.asarray(framed(quiet[cut], width).all(axis=1)),
                ratio=block_means(ratio[cut], width),
                turn=block_means(turn[cut], width),
                blind=block_means(~np.isfinite(u[cut]), width) > 0.5,
            )
        )
        release(y, u, ratio, turn)
    whole = {f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(_Part)}
    driven = opening.finish()
    if width < 4:  # too few samples to see by themselves what changes within a block
        quick = np.stack([np.abs(white_part(driven[:, i])) for i in range(wheels)], axis=1)
        whole["unsteady"] = np.maximum(whole["unsteady"], quick.reshape(-1, width, wheels).mean(axis=1))
    even, late, usual = np.ones(whole["y"].shape), np.zeros(whole["y"].shape), np.zeros(whole["y"].shape, np.int8)
    return WheelBlocks(
        width=width, raw_dt=dt, u=driven, white=even, slack=late, habit=usual, store=store, ended=False, **whole
    )


def _effective(
    u: Array, plants: Sequence[WheelPlant | None], spools: Sequence[float | None]
) -> tuple[Array, Array, list[float | None]]:
    """Effective openings of all wheels, what of them nobody has seen, and where the spools stand at the end."""
    opening, more, held = np.zeros(u.shape), np.zeros(u.shape), list(spools)
    for i, plant in enumerate(plants):
        if plant is None:
            opening[:, i] = u[:, i]
        else:
            opening[:, i], more[:, i], held[i] = effective(u[:, i], plant, held[i])
            opening[:, i] += more[:, i]
    return opening, more, held


@dataclass(frozen=True)
class _Part:
    """Columns of `WheelBlocks` that have a row per block."""

    y: Array
    count: Array
    jitter: Array
    unseen: Array
    unsteady: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    ratio: Array
    turn: Array
    blind: NDArray[np.bool_]


@dataclass
class _Ends:
    """Usual distance of new samples in steps, and the last one of the cut before: its place from the next, its value."""

    usual: float
    place: int | None = None
    value: float = 0.0


def _usual_gap(status: NDArray[np.int8]) -> float:
    """Median distance of new samples in steps; 0 where there are fewer than two."""
    new = np.flatnonzero(status == PAIR)
    return float(np.median(np.diff(new))) if new.size > 1 else 0.0


def _samples(
    y: Array, status: NDArray[np.int8], width: int, n: int, ends: list[_Ends]
) -> tuple[Array, Array, Array, NDArray[np.int8]]:
    """Mean, number and mean squared step of the new samples of n blocks of all wheels, and the blocks' status."""
    state = np.full((n, y.shape[1]), SKIP, dtype=np.int8)
    sums = np.zeros((3, n, y.shape[1]))
    for i, end in enumerate(ends):
        sums[:, :, i] = _samples_of_one(y[:, i], status[:, i], n, width, end)
        silent = np.bincount(np.flatnonzero(status[:, i] == SILENT) // width, minlength=n) > 0.5 * width
        state[silent, i] = SILENT
        state[sums[1, :, i] > 0, i] = PAIR
    return sums[0], sums[1], sums[2], state


def _samples_of_one(y: Array, status: NDArray[np.int8], n: int, width: int, ends: _Ends) -> Array:
    """Mean, number and mean squared step of the new samples of n blocks, shape (3, n)."""
    new = np.flatnonzero(status == PAIR)
    place, values = new // width, y[new]
    count = np.bincount(place, minlength=n)
    mean = np.bincount(place, weights=values, minlength=n) / np.maximum(count, 1)
    if ends.place is not None:
        new, values, place = np.r_[ends.place, new], np.r_[ends.value, values], np.r_[0, place]
    near = np.diff(new) <= 1.5 * ends.usual
    steps = np.where(near, np.diff(values) ** 2, 0.0)
    known = np.bincount(place[1:], weights=near, minlength=n)
    jitter = np.bincount(place[1:], weights=steps, minlength=n) / np.maximum(known, 1)
    if new.size:
        ends.place, ends.value = int(new[-1]) - status.size, float(values[-1])
    return np.stack([mean, count, jitter])


def per_sample(values: NDArray[np.generic], width: int, size: int) -> NDArray[np.generic]:
    """Values of blocks for every sample, shape (size,)."""
    return np.repeat(values, width)[:size]
