"""The mode that an isolated run is stated with, or none: what lies below the limits, or what no row of the tables has."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.zero_level import APART
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.isolation import Isolated, RunSamples
from diagnosis.results.fault_rows import ROWS
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_CLEAR = 3.0  # times the noise
_LEFT_S = (
    0.03  # for which a command must leave the opening of a valve that is said to be stuck there, beside the valve's lag
)
_AS_TRUE = 0.03  # of what a sensor measures: as far off may a healthy one be
_ALIVE, _SLOW_S = (
    0.05,
    1.0,
)  # of what a sensor measures: a living one that is off by less in the mean of a second is not stuck
_LOST = 0.03  # of the span: as far from its command a healthy valve rests within its dead band
_TRAVEL, _STANDS = (
    0.08,
    0.015,
)  # of the span: a command that moves by more takes a healthy valve along; not in its middle
_FEW, _EVEN = 10, 0.5  # samples; probability of a row
_NOISE = 0.01  # of the span: by less a reading varies beside its reference on a machine that is fast
_MOST_PROBABLY = 0.75  # that a gain is more than any row has


def mode_of(isolated: Isolated, found: IdentifiedPair, limits: Limits) -> FaultMode | None:
    """Mode of an isolated run; None where it lies below the limits or may be noise."""
    seen, noise = isolated.seen, isolated.seen.noise
    mode = FaultMode(ROWS[isolated.run.row])
    if mode.scaled:
        p = float(isolated.p[isolated.run.row])  # no majority: as a valve that is stuck, or off by a constant
        alike = found.pair.side is Side.ACTUATOR and seen.still and p < _EVEN
        if alike and seen.deviation < _least_off(noise, found, limits):
            return None
        return _mode_of_gain(isolated, noise, found, limits)
    if mode.varying:
        sensor = found.pair.side is Side.SENSOR
        counts = max(limits.min_sat / 2, _NOISE * found.pair.span) if sensor else least_constant(found, limits)
        least = max(2.5 * found.model.noise, 1.5 * noise, counts)
        epsilon = isolated.estimate[0]
        outside = epsilon is not None and epsilon.exceeds_table(limits.min_epsilon) > _MOST_PROBABLY
        return None if seen.deviation < least else FaultMode.OUTSIDE_TABLE if outside else mode
    # a reference that hardly moves is as constant
    away = np.count_nonzero(np.abs(seen.y - seen.x)[seen.use] > _CLEAR * noise) * found.model.dt
    if found.pair.side is Side.ACTUATOR:
        relation = found.relation
        returns = _LEFT_S + 2.0 * (relation.lag + max(0.0, relation.delay * found.pair.dt))
        least = _least_off(noise, found, limits)
        return mode if away >= returns and (seen.deviation >= least or _left_behind(seen, found)) else None
    # what leaves its place for a sample now and then, as a noisy reference does at rest, moves nothing
    lasts = _longest(np.abs(seen.y - seen.x)[seen.use] > _CLEAR * noise) * found.pair.dt
    if np.isfinite(seen.y).any() and lasts < min(_LEFT_S, 0.5 * isolated.run.size * found.pair.dt):
        return None
    known = seen.x[seen.use]
    size = float(np.sqrt(np.mean(known**2))) if known.size else 0.0
    if seen.deviation < _AS_TRUE * size:
        return None
    if isolated.restless and slowly_off(seen.y[seen.use], known, found.model.dt) < _ALIVE * size:
        return None  # it lives, at a speed that stays: the noise is its reference's
    at_rest = known.size and max(seen.deviation, float(np.max(np.abs(known)))) < limits.min_sat / 2
    return None if at_rest else mode  # it repeats what it had, which is true


def slowly_off(y: Array, x: Array, dt: float) -> float:
    """Root mean square of what a channel is off its reference, both of shape (n,) and finite, in the mean of a second [unit]."""
    count = max(1, round(_SLOW_S / dt))
    starts = np.arange(0, max(1, y.size - count // 2), count)
    means = np.add.reduceat(y - x, starts) / np.diff(np.r_[starts, y.size])
    return float(np.sqrt(np.mean(means**2)))


def _least_off(noise: float, found: IdentifiedPair, limits: Limits) -> float:
    """What a valve that stands still is off by at least to be told: a relation found in the mission is no truer than half a saturation term."""
    return max(_CLEAR * noise, _LOST * found.pair.span, limits.min_sat / 2)


def least_constant(found: IdentifiedPair, limits: Limits) -> float:
    """Smallest constant that counts [unit of y]."""
    return limits.min_sat if found.pair.side is Side.SENSOR else limits.min_opening * found.pair.span


def _mode_of_gain(isolated: Isolated, noise: float, found: IdentifiedPair, limits: Limits) -> FaultMode | None:
    """Inefficient, or outside the table where the gain is; None where ε is too small or nothing moves."""
    epsilon, _, delta = isolated.estimate
    outside = delta > 1.0 + limits.min_epsilon or delta < -limits.min_epsilon
    if not outside and epsilon is not None and epsilon.value < limits.min_epsilon:
        return None
    reference = isolated.seen.x[isolated.seen.use]
    if abs(1.0 - delta) * math.sqrt(float((reference**2).mean())) < max(0.5 * noise, APART * found.pair.span):
        return None  # what is lost of hardly anything is the reference's own noise, or where both have their zero
    return FaultMode.OUTSIDE_TABLE if outside else FaultMode.INEFFICIENT


def _left_behind(seen: RunSamples, found: IdentifiedPair) -> bool:
    """Whether a valve stands still away from its middle while its command moves by more than hysteresis lets it.

    About its middle a dead band would do the same.
    """
    span, y, x = found.pair.span, seen.y[seen.use], seen.x[seen.use]
    if y.size < _FEW or abs(float(np.mean(y))) < max(_STANDS * span, _CLEAR * found.model.constant_noise):
        return False
    low, high = np.quantile(x, (0.02, 0.98))
    return bool(high - low > _TRAVEL * span + 2.0 * found.relation.play and np.std(y) < 2.0 * seen.noise)


def _longest(there: Flags) -> int:
    """Length of the longest stretch."""
    return max((b - a for a, b in runs_of(there)), default=0)
