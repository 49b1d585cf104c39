"""Checks of steering axles: second measurements, a command that moves nothing, and the steering rate per opening."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.axle_rates import Rates, one_joint, rates_of
from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.commanded_angles import commanded_angle
from diagnosis.clearing.measure import alone, compared, lasts, times, worst
from diagnosis.clearing.responses import largest
from diagnosis.clearing.seconds import slope_off
from diagnosis.clearing.still import (
    STILL_S,
    answered,
    commanded_still,
    rate_of,
    still_frame,
)
from diagnosis.clearing.turned_as_read import read_as_before, turned_as_read
from diagnosis.clearing.unsteered import unsteered
from diagnosis.clearing.valves import valve_checks
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

Flags = NDArray[np.bool_]

FLOOR_RAD = 0.06  # deviations are shares of at least this angle
_SMALL = 0.1  # of that angle: an axle that is steered by less, root mean square, shows nothing
#: Limits of the rate in windows and over the mission, as multiples of the loss that counts.
RATE = 1.1, 0.6
#: Of the loss that counts, and times the other axle's: a change of one axle alone. Dead bands that are not known hide half of one.
_CHANGED, _ALONE = 0.25, 1.5
_CHANGED_TWICE = (
    0.6  # the same where both sides are measured twice, so that what lies behind the valve alone is asked for
)
#: Likewise, a difference between parts of the mission where a gyro is the second angle: it shows tyres that give way as well.
_BY_GYRO = 0.65
_ONE_AXLE = 0.75  # of the loss that counts: a change of the only axle, whose oil warms
#: Of the loss that counts, and times the other axle's: a deviation of one axle alone in windows. Of 36 healthy tuning missions of nine machines
#: the axles' largest ones were alike within a factor of 2.6.
_BRIEF, _BRIEF_ALONE = 0.9, 3.0
#: Axles of which the others' median is a measure; of the loss that counts, and times the others': what one alone is off it by in windows. Of five
#: healthy tuning missions of four steered wheels they were alike within a factor of 1.4.
_SEVERAL, _APART, _APART_ALONE = 3, 0.75, 1.5


def axle_checks(cells: Cells, clear_at: float) -> Iterator[Checked]:
    """Checks of all steering axles; `clear_at` is the loss that counts [1]."""
    angle, second, command, opening = (cells.axles(leaf) for leaf in ("phi", "phi_true", "u", "u_applied"))
    either, share = Side.SENSOR_OR_ACTUATOR, -float(np.log1p(-clear_at))
    used = np.where(np.isfinite(opening), opening, command)
    rate = rate_of(angle, cells.dt)
    rates = rates_of(cells, rate, used)
    apart = np.column_stack([cells.apart(axle) for axle in cells.machine.axles]) if cells.machine.axles else True
    angle, second, opening = (np.where(apart, x, np.nan) for x in (angle, second, opening))
    yield from valve_checks(cells, Kind.STEER, clear_at)
    beside = beside_others(rates.off)
    place = np.minimum(np.arange(cells.frame.starts.size), len(rates.off) - 1)
    limit = answered(cells)
    joint = len(cells.machine.axles) > 1 and one_joint(cells, 0, 1)
    turned = [
        read_as_before(x, of)
        for x, *of in zip(turned_as_read(cells, np.isfinite(rates.off)), rates.changes, rates.parted, strict=True)
    ]
    seconds = [bool(np.isfinite(second[:, j]).any()) for j in range(angle.shape[1])]
    opened = [bool(np.isfinite(opening[:, j]).any()) for j in range(angle.shape[1])]
    both = [a and b for a, b in zip(seconds, opened, strict=True)]
    # a gyro that shows one share of an angle all the time is its second measurement for what changes
    steady = [b and (a or c) for a, b, c in zip(seconds, opened, turned, strict=True)]
    changes = [
        _ONE_AXLE * share
        if joint
        else alone(rates.changes, j, share, (_CHANGED_TWICE if steady[j] else _CHANGED) * share, _ALONE, others=1)
        for j in range(len(rates.changes))
    ]
    told = any((x or 0.0) > most for x, most in zip(rates.changes, changes, strict=True))  # which of them changes
    for j, axle in enumerate(cells.machine.axles):
        about = (Kind.STEER, axle)
        if not np.isfinite(angle[:, j]).any():
            continue
        if np.isfinite(second[:, j]).any():
            yield _beside_second(cells, axle, angle[:, j], second[:, j], clear_at)
        if not np.isfinite(np.column_stack([second[:, j], used[:, j], cells.means("imu.yaw_rate")])).any():
            yield Checked(*about, Side.SENSOR, Check.ANGLE_SCALE, None, clear_at)
        if (asked := commanded_angle(cells, j)).worst is not None:
            yield asked
        yield unsteered(cells, j)
        if np.isfinite(command[:, j]).any():
            yield _still(cells, j, limit)
            twice = both[j]
            off = _alone(rates.off, j) if steady[j] else np.abs(rates.off[:, j])
            most = brief_limit(rates, j, share)
            deviates = worst(cells, (*about, either, Check.RATE), off[place], most)
            # what all axles lose together is rather of their supply or their load, which takes no more than that of a healthy machine
            common = worst(cells, (*about, either, Check.RATE), np.abs(rates.off[place, j]), RATE[0] * share)
            alone_off = worst(cells, (*about, either, Check.RATE), beside[place, j], alone_limit(beside, j, share))
            changed = lasts(cells, (*about, either, Check.RATE), rates.changes[j], changes[j])
            once = _CHANGED if len(cells.machine.axles) > 1 and not joint else _ONE_AXLE
            between = (1.0 if both[j] else _BY_GYRO if steady[j] else once) * share
            parted = lasts(cells, (*about, either, Check.RATE), None if told else rates.parted[j], between)
            yield max([deviates, common, alone_off, *(c for c in (changed, parted) if c.worst is not None)], key=times)
            against = Check.LASTING_RATE if len(cells.machine.axles) > 1 and not joint else Check.PLANT_RATE
            # both sides of which are measured twice needs nothing to compare with
            if not twice or (against is Check.LASTING_RATE and rates.apart[j] is not None):
                yield lasts(cells, (*about, either, against), rates.apart[j], RATE[1] * share)
            if against is Check.LASTING_RATE and rates.planned[j] is not None:  # what all axles lose no other one shows
                yield lasts(cells, (*about, either, Check.PLANT_RATE), rates.planned[j], share)


def _beside_second(cells: Cells, axle: str, angle: Array, second: Array, clear_at: float) -> Checked:
    """An angle beside its second measurement [rad], of shape (cells,): in windows, or by its changes over the mission where it stays small."""
    about = (Kind.STEER, axle, Side.SENSOR, Check.SECOND_MEASUREMENT)
    off = compared(cells, angle, second, FLOOR_RAD).off
    if np.isfinite(off).any():
        return worst(cells, about, off, clear_at, apart=True)
    return lasts(cells, about, slope_off(angle, second, cells.dt, _SMALL * FLOOR_RAD), clear_at)


def _alone(off: Array, j: int) -> Array:
    """How far an axle, of which both sides are measured twice, is off its usual rate while the other axle is not, shape (windows,).

    What all axles do together is of their supply or their load. `off` of shape (windows, axles) [ln].
    """
    own = off[:, [j]]
    beside = np.abs(np.where(np.isfinite(off), own - off, own))
    beside[:, j] = np.abs(own[:, 0])
    return np.asarray(beside.min(axis=1))


def beside_others(off: Array) -> Array:
    """How far axles are off the others' median in windows, of three or more [ln]; NaN of fewer. Both of shape (windows, axles)."""
    out = np.full(off.shape, np.nan)
    for j in range(off.shape[1]):
        others = np.delete(off, j, axis=1)
        known = np.isfinite(others).sum(axis=1) >= _SEVERAL - 1
        out[known, j] = np.abs(off[known, j] - np.nanmedian(others[known], axis=1))
    return out


def alone_limit(beside: Array, j: int, share: float) -> float:
    """From which on axle `j` counts by `beside_others`, of shape (windows, axles) [ln]; `share` is the loss that counts [ln]."""
    return alone([float(x) for x in largest(beside)], j, np.inf, _APART * share, _APART_ALONE)


def brief_limit(rates: Rates, j: int, share: float) -> float:
    """Deviation of an axle's rate in windows that counts [ln]: less of it where the other axle hardly deviates; `share` is the loss that counts [ln]."""
    most = [float(x) for x in largest(np.abs(rates.off))]
    return alone(most, j, RATE[0] * share, _BRIEF * share, _BRIEF_ALONE, others=1)


def _still(cells: Cells, j: int, limit: float) -> Checked:
    """Largest mean command while an axle stands still for a second, and no fault of it is stated."""
    axle = cells.machine.axles[j]
    part = (Kind.STEER, axle, Side.SENSOR_OR_ACTUATOR, Check.STILL)
    values, frame = commanded_still(cells, j), still_frame(cells)
    if not np.isfinite(values).any():
        return Checked(*part, None, limit)
    values = np.where(cells.explained(axle, frame), 0.0, values)
    k = int(np.nanargmax(values))
    start = float(frame.starts[k] * cells.dt)
    return Checked(*part, float(values[k]), limit, start, start + STILL_S)
