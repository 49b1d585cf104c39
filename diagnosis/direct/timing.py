"""Deviations that a delay between a channel and its reference, or the rounding of the channel, explains."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import white_part
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.isolation import run_samples
from diagnosis.estimation.segments import Run
from replay.arrays.quantiles import median_known, median_of, quantile_of
from replay.arrays.sliding import largest_within, smallest_within
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

_SPOOL_DELAY_S = 0.005
_SENSOR_DELAY_S, _SENSOR_SAMPLES = 0.01, 1.5
_JUMPY = 0.6  # share of a command's size that jumps between samples, where there is nothing else to it
_FALSE_RESTS = 1e-6  # expected number of such runs in a healthy mission, at most
_ROUNDED = 0.8  # of the rounding step: by as much is a coarse reading off what it shows
_LEAST_SHOWN = 0.02  # quantile of what a channel shows beside 0
_ALIKE, _HOLDS = 1.5, 20  # speeds that are alike; holds that make a habit
_STEPS, _OF_VALUE, _FURTHER = (
    4.0,
    0.2,
    6.0,
)  # rounding steps, share of a reading, times the usual way in a hold: no habit beyond
_LONG_HOLDS, _BEYOND_HOLDS = 0.98, 2.0  # quantile of holds that is long; times as long as that is no habit
_SETTLING_LAGS, _OVERSHOOT, _NOISES = 6.0, 0.3, 3.0  # of a valve of higher order; share of its move; times the noise
_AT_REST = 0.02  # of the largest plausible speed
_FIRST_EDGE_S = 0.02  # of driving at the largest plausible speed: as far may be from edge to edge
_ECHO = 2.0  # times a command's jumps: as large may be those of its answer
_BRIEF_S = 0.5  # a shorter deviation may be of timing, or of a wheel that stops or starts
_OF_LAG = 0.4  # of what a lag does: as far off is its model
_FEW_READINGS, _SETTLED_LAGS = 3, 3.0  # in which a valve answers; and of its lags
_READING, _LATE = 1, 0.3  # readings to either side; of a deviation, that lies beyond them all
_OF_SHARE, _HOLDS_OFTEN = (
    0.1,
    0.2,
)  # of a deviation, that a share leaves of it; of the readings, that follow one of their sign
_FLIPS = 25  # samples in a row on one side of a command that switches to and fro between samples


def timing_explains(found: IdentifiedPair, run: Run, mode: FaultMode) -> bool:
    """Whether a deviation may be nothing but a delay between y and its reference, or its rounding.

    Shorter than a spool sensor's delay; or an overshoot that settles; or noise of an opening that stays within what is
    expected a reading sooner and later; or, where a log is too slow for its commands: what changes from sample to
    sample is as large, or y is x with its sign at other moments, or a constant y is as far off as a healthy one may be. For a
    speed: shorter than half a second and no more than 10 ms, or one and a half samples, of the reference's slope, or as short near rest, or a reading that rests beside a
    reference that hardly moves, no longer than its noise allows. Whatever the rate, the answer to a command of which
    nothing is left but jumps between samples depends on the valve's lag, unless, in a log that is
    not too slow for it, it rests beside what the command holds for a few readings.
    """
    pair, part = found.pair, slice(run.start, run.stop)
    x = found.samples.x
    y, ref = pair.y[part], x[part]
    seconds = (run.stop - run.start) * pair.dt
    size = np.abs(y - ref)
    deviation = float(np.sqrt(np.nanmean(size**2))) if np.isfinite(size).any() else np.inf
    if pair.side is Side.SENSOR:
        slope = np.gradient(np.nan_to_num(x[max(0, run.start - 1) : run.stop + 1]), pair.dt)
        moves = float(np.sqrt(np.mean(slope**2))) * max(_SENSOR_DELAY_S, _SENSOR_SAMPLES * pair.dt)
        if _before_first_edge(found, run) or (seconds < _BRIEF_S and _near_rest(found, run)):
            return True
        if mode.total:
            return _rests_by_chance(found, run, deviation) or _held_by_habit(found, run)
        return mode.varying and ((seconds < _BRIEF_S and deviation < moves) or _lags(found, run, deviation))
    if seconds <= _SPOOL_DELAY_S or (mode.varying and _settles(found, run)):
        return True
    if mode.varying and _read_late(found, run, deviation, _READING):
        return True
    jumps = _sudden(found, pair.x, run)
    jumpy = deviation < 2 * jumps and jumps > _JUMPY * float(np.sqrt(np.nanmean(ref**2)))
    late = jumpy and not mode.total
    if late and (
        found.coarse or (_read_late(found, run, deviation, _settled(found)) and not _is_share(y, ref, deviation))
    ):
        return True
    if not found.coarse:
        return False
    if mode.total:
        return _readings(found, run).size < _FLIPS or (
            np.isfinite(deviation) and deviation < 2.5 * run_samples(run, found).noise
        )
    if not mode.varying:
        return False
    of_command, of_answer = (_sudden(found, z, run) for z in (pair.x, pair.y))
    sudden = max(of_command, min(of_answer, _ECHO * of_command))  # jumps that nothing commands are of no timing
    unsigned = np.sqrt(np.nanmean((np.abs(y) - np.abs(pair.x[part])) ** 2))
    return bool(sudden > 0.3 * deviation or unsigned < 0.3 * deviation)


def _lags(found: IdentifiedPair, run: Run, deviation: float) -> bool:
    """Whether the lag that was found of a sensor makes nearly all of how far its readings are off the wheel's own motion."""
    pair, part = found.pair, slice(run.start, run.stop)
    off = (pair.y - pair.x)[part]
    return bool(np.isfinite(off).any() and deviation < _OF_LAG * float(np.sqrt(np.nanmean(off**2))))


def _settles(found: IdentifiedPair, run: Run) -> bool:
    """Whether a spool swings about its command no longer and no further than one of second order does after a move.

    The relation is of first order. A healthy spool of second order overshoots by at most `_OVERSHOOT` of what its command
    moved within the last few lags, and rests when the command has rested for as long.
    """
    pair = found.pair
    reach = max(3, round(_SETTLING_LAGS * (found.relation.lag / pair.dt + max(0.0, found.relation.delay) + 1.0)))
    first = max(0, run.start - reach)
    x = np.nan_to_num(pair.x[first : run.stop])
    moved = (largest_within(x, reach - 1, 0) - smallest_within(x, reach - 1, 0))[run.start - first :]
    part = slice(run.start, run.stop)
    size = np.abs(pair.y[part] - found.samples.x[part])
    known = np.isfinite(size)
    return bool(known.any() and (size <= _OVERSHOOT * moved + _NOISES * found.model.noise)[known].all())


def _readings(found: IdentifiedPair, run: Run) -> NDArray[np.intp]:
    """Samples of a run that bring something new."""
    at = found.news
    if isinstance(at, slice):
        return np.arange(run.start, run.stop)
    return at[np.searchsorted(at, run.start) : np.searchsorted(at, run.stop)]


def _settled(found: IdentifiedPair) -> int:
    """Readings after which a valve has done what it was told, whatever its lag is to a few of them."""
    return _FEW_READINGS + math.ceil(_SETTLED_LAGS * found.relation.lag / found.pair.dt)


def _read_late(found: IdentifiedPair, run: Run, deviation: float, reach: int) -> bool:
    """Whether nearly all of a deviation, root mean square [unit], lies within what is expected `reach` readings sooner and later."""
    at = _readings(found, run)
    if at.size < 2 * reach + 1:
        return True
    y, x = found.pair.y[at], found.samples.x[at]
    low, high = smallest_within(x, reach, reach), largest_within(x, reach, reach)
    beyond = np.maximum(y - high, low - y).clip(0.0)
    return bool(np.isfinite(beyond).any() and float(np.sqrt(np.nanmean(beyond**2))) <= _LATE * deviation)


def _is_share(y: Array, x: Array, deviation: float) -> bool:
    """Whether a share of what is expected leaves hardly anything of a deviation, root mean square [unit]: at other moments none does.

    Beside a command that flips at every sample, a lag leaves a share as well.
    """
    known = np.isfinite(y) & np.isfinite(x)
    y, x = y[known], x[known]
    power = float(x @ x)
    if power <= 0.0:
        return False
    holds = np.mean(np.abs(np.diff(x)) < np.abs(x[1:]))
    left = float(np.sqrt(np.mean((y - float(x @ y) / power * x) ** 2)))
    return bool(holds > _HOLDS_OFTEN) and left <= _OF_SHARE * deviation


def _sudden(found: IdentifiedPair, x: Array, run: Run) -> float:
    """Root mean square of what changes from reading to reading in a run."""
    at = found.news
    if isinstance(at, slice):
        start, stop, values = run.start, run.stop, x
    else:
        start, stop = int(np.searchsorted(at, run.start)), int(np.searchsorted(at, run.stop))
        values = x[at[max(0, start - 1) : stop + 1]]
        start, stop = min(start, 1), min(start, 1) + stop - start
    first = max(0, start - 1)
    inside = white_part(values[first : stop + 1])[start - first :][: stop - start]
    return float(np.sqrt(np.mean(inside**2))) if inside.size else 0.0


def _held_by_habit(found: IdentifiedPair, run: Run) -> bool:
    """Whether a reading rests no longer than it does elsewhere at such speeds, or shows 0 where it never shows so little.

    Sensors that count poles or their time hold a value until the next one comes, and read 0 below their least speed.
    """
    pair = found.pair
    y, part = pair.y, slice(run.start, run.stop)
    inside = y[part][np.isfinite(y[part])]
    if not inside.size:
        return False
    value = float(median_of(np.abs(inside)))
    if value == 0.0:
        shown = np.abs(y[np.isfinite(y) & (y != 0.0)])
        least = float(quantile_of(shown, _LEAST_SHOWN)) if shown.size else 0.0
        return bool(np.nanmax(np.abs(found.samples.x[part]), initial=0.0) <= _ALIKE * least)
    start, length = found.holds
    apart = (start + length <= run.start) | (start >= run.stop)
    size = np.abs(y[start])
    near = length[apart & (size > value / _ALIKE) & (size < value * _ALIKE)]
    if near.size < _HOLDS or _further(found, run, value, apart):
        return False
    return bool((run.stop - run.start) < _BEYOND_HOLDS * float(quantile_of(near, _LONG_HOLDS)))


def _further(found: IdentifiedPair, run: Run, value: float, apart: NDArray[np.bool_]) -> bool:
    """Whether a wheel turns further, at another speed than its held reading says, than from one reading to the next.

    `value` is that reading, `apart` the other holds: at steady speed a coarse sensor repeats its reading, but that is right.
    """
    start, length = found.holds
    way = found.way
    others = (way[start + length] - way[start])[apart]
    moved = others[others > 0.0]
    off = float(median_known(np.abs(found.pair.y - found.samples.x)[run.start : run.stop]))
    away = off > max(_STEPS * found.texture.lsb, _OF_VALUE * value)
    return away and bool(moved.size) and way[run.stop] - way[run.start] > _FURTHER * float(median_of(moved))


def _near_rest(found: IdentifiedPair, run: Run) -> bool:
    """Whether a wheel stops, starts or turns back near a run: sensors that time their edges are late there, and wild at the first."""
    near = round(_BRIEF_S / found.pair.dt)
    x = np.abs(found.samples.x[max(0, run.start - near) : run.stop + near])
    return bool(np.nanmin(x, initial=np.inf) <= _AT_REST * found.pair.span)


def _before_first_edge(found: IdentifiedPair, run: Run) -> bool:
    """Whether a wheel that rested moved on by so little that a sensor which counts edges has not seen one yet."""
    pair, x = found.pair, np.abs(np.nan_to_num(found.samples.x[run.start : run.stop]))
    if not np.isfinite(pair.y[run.start : run.stop]).all() or np.any(pair.y[run.start : run.stop] != 0.0):
        return False
    noise = 3.0 * found.texture.reference_white
    if min(x[0], x[-1]) > max(noise, _AT_REST * pair.span):
        return False
    return float(np.sum(np.where(x > noise, x, 0.0))) * pair.dt <= _FIRST_EDGE_S * pair.span


def _rests_by_chance(found: IdentifiedPair, run: Run, deviation: float) -> bool:
    """Whether a healthy sensor's noise may keep its readings as close as they are, beside a reference that explains them.

    A reading of a living sensor is its value plus noise, rounded. Within w = ptp(y) + lsb one is with probability
    p = erf(w / (√8·noise)) at most, and m readings in a row are with p^(m−1). The run is a fault where that is below
    `_FALSE_RESTS` for all readings of the mission together.
    """
    pair = found.pair
    if not np.isfinite(pair.y[run.start : run.stop]).all():
        return False  # a silent channel does not rest
    y = pair.y[run.start : run.stop][pair.fresh[run.start : run.stop]]
    texture = found.texture
    if not y.size or deviation > max(2.5 * math.hypot(texture.white, texture.reference_white), _ROUNDED * texture.lsb):
        return False
    noise = math.sqrt(max(texture.white**2 - pair.habit.rounding_noise(texture.lsb), 0.0))
    close = math.erf((float(np.ptp(y)) + texture.lsb) / (math.sqrt(8.0) * noise)) if noise else 1.0
    return bool(texture.readings * close ** (y.size - 1) > _FALSE_RESTS)
