"""A steering axle's samples in blocks of about 10 ms, or of one sample: mean, power of the white part, valve command, status."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import rounding_step
from diagnosis.channels.noise_growth import noise_growth
from diagnosis.channels.sample_status import PAIR, SILENT, SKIP
from diagnosis.steering.filter_state import Redundancy
from replay.arrays.blocks import blocks as cut
from replay.arrays.blocks import release
from replay.arrays.column_store import ColumnStore
from replay.arrays.numeric import carried
from replay.arrays.quantiles import median_of, quantile_of
from replay.machine.config import Noise

Array = NDArray[np.float64]

WHITE_DOF = 0.514  # degrees of freedom per sample in the mean square of second differences
_BLOCK_S = 0.01
_LOOKED, _FEW = 100_000, 20  # steps in which the distance of samples is found, and samples that do not tell it
_USUAL = 0.9  # quantile of these distances: beyond it samples are missing
_WINDOW_S = 0.25
_RATE_S = 0.05  # to either side, for the steering rate


@dataclass(frozen=True)
class SteeringBlocks:
    """One axle in m blocks of `length` samples, the last one cut.

    Attributes
    ----------
    length : int
        Samples per block.
    dt : float
        Length of a block [s].
    mean : Array, shape (m,)
        Mean of the new samples of the angle [rad]; 0 where there are none.
    power : Array, shape (m,)
        Mean square of what changes from sample to sample, from second differences [rad²].
    count : Array, shape (m,)
        New samples.
    u : Array, shape (m,)
        Mean valve opening between the middles of the block before and this one [fraction].
    status : NDArray[np.int8], shape (m,)
        `PAIR`, `SILENT` or `SKIP` of `diagnosis.channels.sample_status`.
    raw_u : Array, shape (n,)
        Valve opening of every sample, 0 where unknown.
    blind : NDArray[np.bool_], shape (m,)
        Blocks in most of which nobody knows the opening.
    redundancy : Redundancy
        What is measured redundantly.
    pace : Array, shape (m,)
        What the axle turns at its opening at the speed of driving, as a multiple of its usual [1]; 1 unless identified.
    store : ColumnStore
        Where long columns stand.
    """

    length: int
    dt: float
    mean: Array
    power: Array
    count: Array
    u: Array
    status: NDArray[np.int8]
    raw_u: Array
    blind: NDArray[np.bool_]
    redundancy: Redundancy
    pace: Array
    store: ColumnStore = field(default_factory=ColumnStore, repr=False)


def block_length(fresh: Sequence[NDArray[np.bool_]], dt: float) -> int:
    """Steps per block: about 10 ms, and no less than between two samples of the slowest of some channels.

    Parameters
    ----------
    fresh : Sequence[NDArray[np.bool_]], each of shape (n,)
        Steps with a new sample of each channel.
    dt : float
        Step [s].
    """
    length = max(1, round(_BLOCK_S / dt))
    for new in fresh:
        at = np.flatnonzero(new[:_LOOKED])
        if at.size > _FEW:
            length = max(length, round(float(quantile_of(np.diff(at), _USUAL))))
    return length


def between(x: Array, length: int, blocks: int, function: Callable[[Array], Array] = np.asarray) -> Array:
    """Mean of function(x) over `length` samples up to the middle of each block.

    From shape (n,) to (blocks,), in the unit of function(x).
    """
    middle = np.minimum(np.arange(blocks) * length + length // 2, x.size)
    until, total = np.empty(blocks), 0.0
    for part in cut(x.size, length):
        sums = total + np.concatenate([[0.0], np.cumsum(function(x[part]))])
        a, b = part.start // length, -(-part.stop // length)
        until[a:b] = sums[middle[a:b] - part.start]
        total = float(sums[-1])
    before = np.concatenate([[0.0], until[:-1]])
    return np.asarray((until - before) / np.maximum(np.diff(middle, prepend=0), 1))


def second_differences(values: Array) -> Array:
    """(y_k − 2y_{k−1} + y_{k−2})²/6 of consecutive samples: their mean is the white noise's power; 0 for the first two.

    Shape (n,).
    """
    out = np.zeros(values.size)
    if values.size > 2:
        out[2:] = (values[2:] - 2 * values[1:-1] + values[:-2]) ** 2 / 6.0
    return out


def blocks_of(
    y: Array,
    u: Array,
    fresh: NDArray[np.bool_],
    alive: NDArray[np.bool_],
    dt: float,
    store: ColumnStore | None = None,
    length: int | None = None,
) -> SteeringBlocks:
    """Cut an axle's channels into blocks.

    Parameters
    ----------
    y, u : Array, shape (n,)
        Angle [rad] and valve opening [fraction]; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new sample of y.
    alive : NDArray[np.bool_], shape (n,)
        Whether another channel of y's source delivers.
    dt : float
        Step [s].
    store : ColumnStore or None
        Where long columns stand; None: one of their own.
    length : int or None
        Samples per block; None: as `block_length` has it.
    """
    store = store or ColumnStore()
    length = length or block_length([fresh], dt)
    opening, parts = store.column(np.float64), []
    last = np.zeros(1)
    before = np.zeros(0)  # the last two new samples of the part before
    for part in store.blocks(y.size, length):
        near, missing = y[part], ~np.isfinite(y[part])
        starts = np.arange(0, near.size, length)
        new = fresh[part] & ~missing
        power = np.zeros(near.size)
        values = np.concatenate([before, near[new]])
        power[new] = second_differences(values)[before.size :]
        before = values[-2:]
        count = np.add.reduceat(new.astype(np.float64), starts)
        mean = np.add.reduceat(np.where(new, near, 0.0), starts) / np.maximum(count, 1.0)
        status = np.where(count > 0, PAIR, SKIP).astype(np.int8)
        silent = np.add.reduceat((missing & alive[part]).astype(np.float64), starts) > 0.5 * length
        status[silent & (count == 0)] = SILENT
        unknown = np.add.reduceat((~np.isfinite(u[part])).astype(np.float64), starts)
        blind = unknown > 0.5 * np.diff(np.append(starts, near.size))
        parts.append((mean, np.add.reduceat(power, starts) / np.maximum(count, 1.0), count, status, blind))
        given, last = carried(u[part][:, np.newaxis], last)
        opening.append(given[:, 0])
        release(y, u)
    mean, power, count, status, blind = (np.concatenate(x) for x in zip(*parts, strict=True))
    raw_u, redundancy = opening.finish(), Redundancy.nothing(mean.size)
    u_mean = between(raw_u, length, mean.size)
    return SteeringBlocks(
        length,
        length * dt,
        mean,
        power,
        count,
        u_mean,
        status,
        raw_u,
        blind,
        redundancy,
        np.ones(mean.size),
        store=store,
    )


def window_means(x: Array, length: int) -> Array:
    """Means over consecutive windows of `length`; the last, cut one is left out. From shape (n,) to (windows,)."""
    count = x.size // length
    return np.asarray(x[: count * length].reshape(count, length).mean(axis=1))


@dataclass(frozen=True)
class SensorNoise:
    """Noise of an angle sensor.

    Attributes
    ----------
    white : float
        Power of its white noise, its rounding included, in the median window [rad²].
    spread : float
        Variance of the logarithm of that power from window to window.
    step : float
        Power of the rounding [rad²].
    lsb : float
        Rounding step [rad]; 0 where none.
    """

    white: float
    spread: float
    step: float
    lsb: float

    @property
    def std(self) -> float:
        """Standard deviation without the rounding [rad]."""
        return float(np.sqrt(max(self.white - self.step, 0.0)))

    @property
    def resolved(self) -> bool:
        """Whether it is larger than the rounding step, so that a constant reading means something."""
        return self.std > 0.6 * self.lsb


def without_growth(axles: Sequence[SteeringBlocks]) -> list[SteeringBlocks]:
    """Axles with the power of the white part as it would be at rest, where that of all grows with their rates all through the mission.

    Stamps that jitter, and controllers that are slower than the log, make steps of every ramp; those are no noise of a sensor.
    """
    rates = [_rates(b) for b in axles]
    growths = [
        noise_growth(np.where(b.count > 0, b.power, np.nan), np.abs(r), b.dt) for b, r in zip(axles, rates, strict=True)
    ]
    if any(g is None or g.share == 0.0 or g.floor == 0.0 for g in growths):
        return list(axles)
    return [
        replace(b, power=b.power * g.floor**2 / g.variance(r))
        for b, r, g in zip(axles, rates, growths, strict=True)
        if g is not None
    ]


def _rates(blocks: SteeringBlocks) -> Array:
    """Steering rate in every block [rad/s]."""
    known = np.flatnonzero(blocks.count > 0)
    mean = np.interp(np.arange(blocks.mean.size), known, blocks.mean[known]) if known.size else blocks.mean
    reach = max(1, round(_RATE_S / blocks.dt))
    rate = np.zeros(mean.size)
    rate[reach:-reach] = (mean[2 * reach :] - mean[: -2 * reach]) / (2 * reach * blocks.dt)
    return rate


def sensor_noise(blocks: SteeringBlocks, values: Array, known: Noise, stop: float) -> SensorNoise:
    """Noise of an axle's sensor from its median window, or from the machine file.

    `values` of shape (k,).

    Parameters
    ----------
    blocks : SteeringBlocks
        The axle.
    values : Array
        New samples of the angle [rad].
    known : Noise
        From the machine file.
    stop : float
        Angle of the end stops [rad]; a millionth of it is the least noise.
    """
    lsb = known.lsb if known.lsb is not None else rounding_step(values)
    step = lsb * lsb / 12
    found = noise_of(*noise_windows(blocks), step, lsb, stop)
    return found if known.std is None else replace(found, white=max(known.std**2 + step, (1e-6 * stop) ** 2))


def noise_of(powers: Array, samples: float, step: float, lsb: float, stop: float) -> SensorNoise:
    """Noise of a sensor by its median window.

    Parameters
    ----------
    powers, samples
        As of `noise_windows`: powers in rad², shape (k,).
    step, lsb : float
        As of `SensorNoise`.
    stop : float
        Angle of the end stops [rad]; a millionth of it is the least noise.
    """
    white, spread = 0.0, 1.0
    if powers.size >= 4:
        low, middle, high = quantile_of(np.log(powers), (0.3, 0.5, 0.7))
        white = float(np.exp(middle))
        spread = (min(middle - low, high - middle) / 0.524) ** 2 - 2.0 / max(WHITE_DOF * samples, 1.0)
    return SensorNoise(max(white, step, (1e-6 * stop) ** 2), float(max(spread, 0.003)), step, lsb)


def noise_windows(blocks: SteeringBlocks) -> tuple[Array, float]:
    """Power of the white part in windows that have some [rad²], shape (k,), and the samples of a usual window."""
    length = max(2, round(_WINDOW_S / blocks.dt))
    counts = window_means(blocks.count, length)
    powers = window_means(blocks.power * blocks.count, length) / np.maximum(counts, 1e-9)
    powers = powers[(powers > 0) & (counts > 0)]
    samples = float(median_of(blocks.count[blocks.count > 0])) * length if powers.size else 0.0
    return powers, samples
