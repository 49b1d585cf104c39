"""What a speed sensor that is said to be stuck or silent shows, and what a healthy one shows as well: such a claim is less sure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.one_value import TURNS
from diagnosis.estimation.valve_map import effective
from diagnosis.results.alike import or_shifted
from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.slowing import or_held
from replay.arrays.blocks import blocks
from replay.arrays.quantiles import median_known, median_of, quantile_known, quantile_of
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

_CHANGING, _CERTAIN, _TREMBLING = 0.1, 0.9, 0.45  # of the readings; a finding as sure stays, others are no surer
_TREMBLES = "Its last digits go on changing, which those of a stuck sensor rarely do."
_LEAST_READ, _CREEPS, _MANY = 0.01, 3.0, 200_000  # quantile of so many readings that are none of 0; times it
_STEPS_OF_NONE = 10.0  # of the reading
_CREEP = "Its valve gives hardly the least speed that this sensor ever reads: it may read 0 because the wheel creeps."
_BEFORE_S, _AT_ONCE_S, _OTHERS = 0.6, 0.1, 2  # about the onset; wheels beside this one
_FAR_OFF, _ALREADY = 3.0, 0.5  # times what the others are off each other; of how far off it is, before it falls silent
_OFF_BEFORE = "Its wheel was as far off the others before the reading fell to zero: the wheel may stand, and its sensor read that."
_FOLLOWS_S, _AS_OTHERS = 0.3, 0.02  # behind its valve a wheel is; of a speed, by which healthy wheels differ
_ALL_STAY = "Nothing else moves meanwhile, and the others read the same: a speed that stays is what a healthy sensor shows, too."
_STANDING, _SHUT = 0.9, 0.02  # of the time; of full opening
_RESTS = "The machine stood nine tenths of that time: a sensor that is off by a constant would read the same."
_STEADY_S, _REPEATS = 0.5, 0.3  # before; of the readings of a wheel that turns
_GOES_ON = "Nothing else moves meanwhile, and it reads on what it read before, as its rounding lets it at one speed: a healthy sensor does, too."
_OPENED, _MOVED = 0.1, 0.05  # of full opening, of the largest speed: something else changes meanwhile
_ABOUT = 0.15  # of a speed: about it
_STEPS = 4.0  # of the reading, by which others move at least


def as_shown(data: WheelsData, i: int, f: Finding, told: Sequence[Finding]) -> Finding:
    """A finding on a wheel, no surer than it shows.

    Parameters
    ----------
    data : WheelsData
        Channels.
    i : int
        The wheel.
    f : Finding
        The finding.
    told : Sequence[Finding]
        All of the wheel.
    """
    if f.side is not Side.SENSOR or not f.mode.total:
        return f
    if not np.isfinite(data.y[f.start : f.stop, i]).any():
        return f  # it gives no readings, whatever its wheel does
    f = _may_creep(data, i, _alive(f, data.y[:, i]))
    return _with_company(data, i, or_held(data, i, _off_before(data, i, f, told), told))


def _alive(f: Finding, y: Array) -> Finding:
    """A stuck sensor is less sure where its last digits go on changing."""
    if f.mode is not FaultMode.STUCK or f.probability >= _CERTAIN:
        return f
    known = y[f.start : f.stop]
    changes = np.diff(known[np.isfinite(known)]) != 0.0
    return limited(f, _TREMBLING, _TREMBLES) if changes.size and float(np.mean(changes)) > _CHANGING else f


def _may_creep(data: WheelsData, i: int, f: Finding) -> Finding:
    """A silent sensor is less sure where its valve gives no more speed than the least that it ever reads: counters read 0 below that."""
    plant, part = data.plants[i], slice(f.start, f.stop)
    if f.mode is not FaultMode.NO_SIGNAL or plant is None:
        return f
    read, opening = np.abs(data.y[:: -(-len(data.y) // _MANY), i]), np.abs(data.u[part, i])
    read = read[read > 0.0]
    if not read.size or not np.isfinite(opening).any():
        return f
    least = float(quantile_of(read, _LEAST_READ))
    given, unseen, _ = effective(np.full(1, median_known(opening)), plant, float(median_known(opening)))
    counts = least > _STEPS_OF_NONE * _least_step(data.y[:, i])  # it reads nothing between 0 and that
    creeps = counts and plant.K * float(given[0] + unseen[0]) < _CREEPS * least
    return limited(f, _TREMBLING, _CREEP) if creeps else f


def _off_before(data: WheelsData, i: int, f: Finding, told: Sequence[Finding]) -> Finding:
    """A silent sensor is less sure where its wheel was off the others before it fell silent, by no other fault of the sensor: it may stand."""
    reach, gap = round(_BEFORE_S / data.dt), round(_AT_ONCE_S / data.dt)
    before, after = slice(max(0, f.start - reach), max(0, f.start - gap)), slice(f.start, min(f.stop, f.start + reach))
    said = any(g is not f and g.side is Side.SENSOR and g.start < before.stop and g.stop > before.start for g in told)
    if f.mode is not FaultMode.NO_SIGNAL or said or data.y.shape[1] <= _OTHERS:
        return f

    def off(part: slice) -> tuple[float, float]:
        """How far the wheel is off the others, and these off each other [m/s]."""
        y = data.y[part]
        y = y[np.isfinite(y).all(axis=1)]
        others = np.delete(y, i, axis=1)
        if not len(y):
            return 0.0, np.inf
        return float(median_of(np.abs(y[:, i] - median_of(others, axis=1)))), float(median_of(np.ptp(others, axis=1)))

    (early, _), (late, apart) = off(before), off(after)
    return limited(f, _TREMBLING, _OFF_BEFORE) if late > _FAR_OFF * apart and early > _ALREADY * late else f


def _with_company(data: WheelsData, i: int, f: Finding) -> Finding:
    """A stuck sensor is less sure where nothing else moves either, and it reads what the others do."""
    part = followed(data, f.start, f.stop)
    others = np.delete(data.y[part], i, axis=1)
    own = data.y[part, i]
    if f.mode is not FaultMode.STUCK or not np.isfinite(own).any() or not np.isfinite(others).any():
        return f
    level = float(median_known(own))
    if _rests(data, i, part):
        return or_shifted(f, _RESTS)
    if moves_on(data, i, part):
        return f
    step = _step_at(data.y[:, i], level)
    near = max(_STEPS * step if np.isfinite(step) else 0.0, _AS_OTHERS * abs(level))
    if abs(level - float(median_known(others))) <= near:
        return limited(f, _TREMBLING, _ALL_STAY)
    return limited(f, _TREMBLING, _GOES_ON) if _goes_on(data, i, f, near) else f


def _goes_on(data: WheelsData, i: int, f: Finding, near: float) -> bool:
    """Whether a reading whose rounding hides its noise stays at what it was, beside a command that does."""
    before = slice(max(0, f.start - round(_STEADY_S / data.dt)), f.start)
    y, u = data.y[:, i], data.u[:, i]
    outside = np.abs(np.r_[y[: f.start], np.nan, y[f.stop :]])
    moving = outside[:-1][np.isfinite(np.diff(outside)) & (outside[:-1] > TURNS * data.span)]
    repeats = np.count_nonzero((np.diff(outside) == 0.0) & (outside[:-1] > TURNS * data.span))
    if not np.isfinite(y[before]).any() or not moving.size or repeats < _REPEATS * moving.size:
        return False
    inside = slice(f.start, f.stop)
    same = abs(float(median_known(y[before]) - median_known(y[inside]))) <= near
    asked = [float(median_known(u[part])) if np.isfinite(u[part]).any() else np.nan for part in (before, inside)]
    return bool(same and abs(asked[0] - asked[1]) <= _SHUT)


def _rests(data: WheelsData, i: int, part: slice) -> bool:
    """Whether the machine stands but for a tenth of the time, its valve shut, while the sensor reads a speed."""
    others, opening = np.abs(np.delete(data.y[part], i, axis=1)), np.abs(data.u[part, i])
    known = np.isfinite(others).any(axis=1)
    fastest = np.max(others[known], axis=1, where=np.isfinite(others[known]), initial=0.0)
    stands = known.any() and float(quantile_of(fastest, _STANDING)) <= TURNS * data.span
    opening = opening[np.isfinite(opening)]
    shut = opening.size > 0 and float(quantile_of(opening, _STANDING)) <= _SHUT
    return bool(stands and shut and abs(float(median_known(data.y[part, i]))) > TURNS * data.span)


def followed(data: WheelsData, start: int, stop: int) -> slice:
    """Of samples [start, stop), those whose valve's doings a healthy wheel shows before they end."""
    return slice(start, max(start + 1, stop - round(_FOLLOWS_S / data.dt)))


def moves_on(data: WheelsData, i: int, part: slice) -> bool:
    """Whether the valve's opening, or the speed of most other wheels, which turn, changes meanwhile."""
    step = _least_step(data.y[:, i])
    others = np.delete(data.y[part], i, axis=1)
    if others.size and np.isfinite(others).any() and float(median_known(np.abs(others))) <= TURNS * data.span:
        return False  # all others stand: a wheel that stands reads one value, its offset too
    with np.errstate(invalid="ignore"):
        moved = [float(quantile_known(c, 0.95) - quantile_known(c, 0.05)) for c in others.T if np.isfinite(c).any()]
    opening = data.u[part, i]
    opening = opening[np.isfinite(opening)]
    opened = float(quantile_of(opening, 0.95) - quantile_of(opening, 0.05)) if opening.size else 0.0
    far = max(_MOVED * data.span, _STEPS * step if np.isfinite(step) else 0.0)
    return opened > _OPENED or bool(moved and float(median_of(moved)) > far)


def _step_at(y: Array, level: float) -> float:
    """Smallest distance of values about a level [m/s], which grows with the speed where times are counted; infinite where there are few.

    A channel whose noise moves it at every reading has as many values as readings, and no steps that matter.
    """
    every = y[:: -(-len(y) // _MANY)]
    values = np.unique(every[np.abs(np.abs(every) - abs(level)) < _ABOUT * abs(level)])
    return float(np.min(np.diff(np.abs(values[np.sign(values) == np.sign(level)])), initial=np.inf))


def _least_step(y: Array) -> float:
    """Smallest size by which a value changes, block by block; infinite where none does."""
    least = np.inf
    for part in blocks(y.size):
        steps = np.abs(np.diff(y[part.start : part.stop + 1]))
        least = min(least, float(np.min(steps[steps > 0.0], initial=np.inf)))
    return least
