"""States of a wheel that is judged by its response, and how well each explains a block of a quarter of a second."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples
from diagnosis.response.identification import Response, beyond
from replay.arrays.numeric import without_nan
from replay.arrays.runs import runs_of

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

BLOCK_S = 0.25
#: Gains of a scaled sensor; between .75 and 1.35 a wheel's slip is as large.
SCALES = (0.15, 0.21, 0.3, 0.38, 0.48, 0.6, 0.72, 1.4, 1.65, 1.95, 2.3, 2.7)
HEALTHY, OTHER, FROZEN, SILENT, NOISY = range(5)
STATES = 5 + len(SCALES)
_BETWEEN = 0.05  # of the speed: what a gain between two of them leaves
#: How long a wheel stays healthy, and a fault stays, on average [s].
MEAN_HEALTHY_S, MEAN_FAULTY_S = 120.0, 10.0
#: Mean probability of its state from which a spell is a finding.
LEAST_P = 0.6

_FREEDOM = 3.0  # of Student's t: slip and wind-up are common
_SECOND = 0.25  # weight of a block's misfit beside its command: that lasts for about a second
_BESIDE = 0.5  # beside another wheel
_REPEATS = 0.5  # weight of repeats
_HABIT = 0.1  # share of repeats from which on their absence says something
_FEW = 8.0  # of a block's readings, however many there are, so many count
_OTHER_Z = 4.0  # misfit from which nothing known explains a block
_WHITE_SPREAD, _WHITE_MOST = 0.5, 3.0
_WHITE_UP = np.log(3.0)
_LONG_S = 2.0  # a value held for longer is no habit, unless a quarter of the driving is like that
_STILL = 0.02  # of the usual top speed
_QUIET = 0.01  # of the usual top speed: less than that from sample to sample is no noise worth a word
_STEP, _FAST = (
    0.25,
    2.0,
)  # of the range that a command makes a speed go through, in so many readings of a block: that is its roughness
_NEVER = -60.0


class Blocks(NamedTuple):
    """A wheel by blocks.

    Attributes
    ----------
    start : NDArray[np.intp], shape (b,)
        First timeline step of each block.
    mean : Array, shape (b,)
        Mean reading [m/s]; NaN without one.
    low, high, noise : Array, shape (b,)
        Expected band and its usual misfit [m/s].
    readings, same, zero : Array, shape (b,)
        Readings, those that repeat the one before, those of a wheel that stands still.
    rough, usual : Array, shape (b,)
        Root mean square of what changes from sample to sample, and the usual one [m/s].
    habitual : bool
        Whether values that are held for long may be the channel's habit, as other wheels have it.
    long_s : float
        Time from which on a value is held for long [s].
    most : Array or float, shape (b,)
        Most that may be usual of what changes from sample to sample, by the inertia of a wheel, whatever other wheels do [m/s].
    """

    start: NDArray[np.intp]
    mean: Array
    low: Array
    high: Array
    noise: Array
    readings: Array
    same: Array
    zero: Array
    rough: Array
    usual: Array
    habitual: bool = True
    long_s: float = _LONG_S
    most: Array | float = np.inf

    @property
    def white(self) -> Array:
        """What changes from sample to sample beside the usual (logarithm). Shape (blocks,)."""
        return np.asarray(np.log((self.rough + 0.3 * self.usual) / (1.3 * self.usual)))

    @property
    def held(self) -> Flags:
        """Blocks whose every reading repeats the one before. Shape (blocks,)."""
        return np.asarray((self.readings > 0) & (self.same == self.readings))

    @property
    def dead(self) -> Flags:
        """Blocks in which nothing but one reading of standstill came, or none. Shape (blocks,)."""
        return np.asarray((self.same == self.readings) & (self.zero == self.readings))


class Beside(NamedTuple):
    """What another view says of a wheel's speed.

    Attributes
    ----------
    speed, noise : Array, shape (b,)
        The speed by that view and the usual misfit [m/s]; NaN where it says nothing.
    blame : Array, shape (b,)
        How much of a misfit is this wheel's own, 0…1.
    rough : Array, shape (b,)
        What of the other wheels changes from sample to sample [m/s].
    compared : str
        What the view is by, in words.
    own : bool
        Whether it shows how this wheel itself turns, rather than how it should.
    across : Array or None, shape (b,)
        Speed of the other side [m/s], to which the view adds a share of the yaw rate; None where it takes no yaw rate.
    nobody : Array or None, shape (b,)
        How much of a misfit neither this wheel nor another one makes by what it is off its command, 0…1; None where that is not asked.
    """

    speed: Array
    noise: Array
    blame: Array
    rough: Array
    compared: str = ""
    own: bool = False
    across: Array | None = None
    nobody: Array | None = None


def blocks_of(samples: Samples, response: Response, cell: int, width: int, size: int) -> Blocks:
    """Put samples and expectation into blocks.

    Parameters
    ----------
    samples : Samples
        Of the wheel's speed.
    response : Response
        By cells.
    cell, width : int
        Steps in a cell and in a block.
    size : int
        Steps of the mission.
    """
    number = -(-size // width)
    start = np.arange(number) * width
    block = samples.step // width
    good = np.isfinite(samples.value)

    def total(x: Array | Flags) -> Array:
        return np.bincount(block[good], weights=np.asarray(x, np.float64)[good], minlength=number).astype(np.float64)

    count = total(np.ones(good.size))
    mean = np.where(count > 0, total(np.nan_to_num(samples.value)) / np.maximum(count, 1), np.nan)
    cells = np.minimum((start + width // 2) // cell, response.low.size - 1)
    white = np.sqrt(total(samples.white**2) / np.maximum(count, 1))
    top = float(np.nanquantile(np.abs(samples.value), 0.99))
    low, high = response.low[cells], response.high[cells]
    swing = _STEP * min(1.0, _FAST / max(float(np.median(count[count > 0])), 1.0)) if count.any() else 0.0
    asked = swing * np.where(np.isfinite(high - low), high - low, 0.0)
    usual = np.maximum(np.maximum(_usual_white(white, np.abs(mean), count), _QUIET * top), asked)
    still = np.abs(samples.value) <= _STILL * top
    return Blocks(
        start, mean, low, high, response.noise[cells], count,
        total(samples.same), total(still), white, usual,
    )  # fmt: skip


def scores(
    blocks: Blocks, driving: Flags, block_s: float, beside: Beside | None = None, joint: Beside | None = None
) -> Array:
    """Log-likelihood of each block in each state, shape (b, states).

    Parameters
    ----------
    blocks : Blocks
        The wheel.
    driving : Flags, shape (b,)
        Where the wheel is expected to move.
    block_s : float
        Length of a block [s].
    beside : Beside or None
        Another view of the same speed. Where it agrees, a misfit beside the command is none of the sensor's.
    joint : Beside or None
        The position of the same joint. Where it agrees it says nothing: both come from one encoder.
    """
    out = np.zeros((blocks.mean.size, STATES))
    moves = blocks.zero < blocks.readings
    first, next_one = hold_shares(blocks, driving, block_s)
    again = np.r_[False, blocks.held[:-1]]
    held = np.where(moves & blocks.held, np.log(np.where(again, next_one, first)), 0.0)
    busy = -_REPEATS * 0.5 * np.minimum(np.maximum(blocks.white, 0.0) / _WHITE_SPREAD, _WHITE_MOST) ** 2
    loud = -_REPEATS * 0.5 * (np.clip(blocks.white - _WHITE_UP, -2.0, 0.0) / _WHITE_SPREAD) ** 2
    repeat = float(
        np.clip(np.sum(blocks.same[driving & moves]) / max(np.sum(blocks.readings[driving & moves]), 1.0), 0.02, 0.95)
    )
    usual = _REPEATS * (blocks.same * np.log(repeat) + (blocks.readings - blocks.same) * np.log1p(-repeat)) * moves
    usual *= np.minimum(_FEW / np.maximum(blocks.readings, 1.0), 1.0) if repeat > _HABIT else 0.0
    for m, scale in ((HEALTHY, 1.0), *((NOISY + 1 + k, s) for k, s in enumerate(SCALES))):
        out[:, m] = _misfit(blocks, scale, beside) + _contradicted(blocks, scale, joint) + held + busy
    out[:, OTHER] = (
        -_SECOND * _loss(_OTHER_Z) - (0.0 if beside is None else _BESIDE * _loss(_OTHER_Z) * beside.blame) + held + busy
    )
    if joint is not None:
        out[:, OTHER] -= _BESIDE * _loss(_OTHER_Z) * joint.blame * _apart(blocks, joint)
    out[:, FROZEN] = np.where(blocks.held & moves, 0.0, _NEVER)
    out[:, SILENT] = np.where(moves, _NEVER, 0.0)
    # noise changes with every sample: nothing repeats
    few = np.minimum(blocks.readings, _FEW) * blocks.same / np.maximum(blocks.readings, 1.0)
    out[:, NOISY] = loud + _SECOND * 0.5 * _misfit(blocks, 1.0, None, 4.0) - 1.5 * few * moves - usual - 0.5
    out[blocks.readings == 0] = 0.0
    return out


def _misfit(blocks: Blocks, scale: float, beside: Beside | None, wider: float = 1.0) -> Array:
    """Log-likelihood of a block's mean if the sensor shows `scale` of the speed, 0 at best."""
    ends = np.array([scale * blocks.low, scale * blocks.high])
    off = beyond(blocks.mean, ends.min(axis=0), ends.max(axis=0))
    size = np.nan_to_num(np.max(np.abs(ends), axis=0), posinf=0.0)
    alone = -_SECOND * np.nan_to_num(_loss(off / (wider * _usual(scale, blocks.noise, size))))
    if beside is None:
        return np.asarray(alone)
    other = _loss((blocks.mean - scale * beside.speed) / _usual(scale, beside.noise, scale * beside.speed))
    known = np.isfinite(other)
    apart = np.where(known, other, 0.0)
    # what two views agree on is no misfit of one of them
    agreed = np.where(known, alone * np.minimum(apart / _loss(_OTHER_Z), 1.0), alone)
    return np.asarray(agreed - _BESIDE * apart * np.where(known, beside.blame, 0.0))


def _contradicted(blocks: Blocks, scale: float, joint: Beside | None) -> Array:
    """What a position takes from a scale of the speed beside it; nothing where both channels agree, whatever they show."""
    if joint is None:
        return np.zeros(blocks.mean.size)
    off = _loss((blocks.mean - scale * joint.speed) / _usual(scale, joint.noise, scale * joint.speed))
    return np.asarray(-_BESIDE * np.nan_to_num(off) * joint.blame * _apart(blocks, joint))


def _usual(scale: float, noise: Array, size: Array) -> Array:
    """Usual misfit of a scaled sensor [m/s] that is to read `size`: a gain lies between two of `SCALES`, however quiet the channel is."""
    usual = max(scale, 0.3) * noise
    return usual if scale == 1.0 else np.maximum(usual, _BETWEEN * np.abs(without_nan(size)))


def _apart(blocks: Blocks, joint: Beside) -> Array:
    """How surely speed and position differ, 0…1."""
    return np.clip(np.nan_to_num(_loss((blocks.mean - joint.speed) / joint.noise)) / _loss(_OTHER_Z), 0.0, 1.0)


def _loss(z: Array | float) -> Array:
    return np.asarray(0.5 * (_FREEDOM + 1.0) * np.log1p(np.asarray(z) ** 2 / _FREEDOM))


def hold_shares(blocks: Blocks, driving: Flags, block_s: float) -> tuple[float, float]:
    """Share of blocks without any change while the wheel moves, after one with a change and after one without, beside long holds [1].

    Parameters are those of `scores`.

    `driving` of shape (blocks,), `block_s` in s.
    """
    use, long = _long_holds(blocks, driving, block_s)
    if blocks.habitual and np.count_nonzero(long) > 0.25 * max(int(np.count_nonzero(use)), 1):
        long[:] = False
    kept = use & ~long
    if not kept.any():
        return 0.5, 0.5
    before = np.r_[False, blocks.held[:-1] & use[:-1]]
    after = [blocks.held[kept & (before == was)] for was in (False, True)]
    shares = [float(np.clip((x.sum() + 0.5) / (x.size + 1.0), 0.02, 0.95)) for x in after]
    if not after[1].size:  # nothing was held even once
        shares[1] = float(np.sqrt(shares[0]))
    return shares[0], max(shares)


def held_long(blocks: Blocks, driving: Flags, block_s: float) -> float:
    """Share of the driving in which a value is held for long [1]; parameters are those of `scores`.

    `driving` of shape (blocks,), `block_s` in s.
    """
    use, long = _long_holds(blocks, driving, block_s)
    return float(np.count_nonzero(long)) / max(int(np.count_nonzero(use)), 1)


def _long_holds(blocks: Blocks, driving: Flags, block_s: float) -> tuple[Flags, Flags]:
    """Blocks in which a channel should change, and those of them in which it holds one value for long; shapes (b,)."""
    use = driving & (blocks.readings > 0) & (blocks.zero < blocks.readings)
    long = np.zeros(use.size, np.bool_)
    for start, stop in runs_of(blocks.held & use):
        long[start:stop] = (stop - start) * block_s > blocks.long_s
    return use, long


def _usual_white(white: Array, speed: Array, count: Array) -> Array:
    """Usual root mean square of what changes from sample to sample, at a block's speed."""
    use = (count > 0) & (speed > 0)
    if np.count_nonzero(use) < 20:
        return np.full(white.size, max(float(np.max(white, initial=0.0)), 1e-6))
    edges = np.quantile(speed[use], [0.0, 0.33, 0.67])
    place = np.clip(np.searchsorted(edges, np.nan_to_num(speed), side="right") - 1, 0, 2)
    levels = np.array(
        [np.quantile(white[use & (place == k)], 0.7) if (use & (place == k)).any() else 0.0 for k in range(3)]
    )
    levels = np.maximum(np.maximum.accumulate(levels), 1e-6)
    return np.asarray(levels[place])
