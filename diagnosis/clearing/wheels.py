"""Checks of wheels: second measurements, speed per opening and tracking beside the other wheels, quick changes, delay."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import as_followed, compared, lasts, late, lowest_passed, worst
from diagnosis.clearing.wild import wild_readings
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

_LAG_S = 0.15  # of a valve and its drive
_SETTLED_S, _SETTLED = 0.6, 0.03  # a command that has changed by less than this [m/s] over this time
MOVING = 0.08  # m/s, for a machine of .36 m/s
_LEAST_CELLS = 0.5  # of a window
_LEAST_WINDOWS, _PART = 8, 0.2  # before and after a change, at least
_FOLLOWS = 0.45  # of the power of a speed: openings explain 0.56 and more on tuning machines, torques 0.31 and less
_CHANGED = 0.88  # a change counts by its limit in windows, not over the mission
OTHERS = 2
FLOOR = 0.16  # of the top speed: a deviation is a share of at least this
OPENING = 0.03  # of full opening: likewise
ROUGH, _ROUGHER = 0.15, 5.0  # quick changes: share of the speed, times those of the other wheels
LATE_S = 0.2
_TRACKING = 0.35
VALVE = 1.4  # dead band and hysteresis of a healthy valve: the limit as a multiple of the loss that counts
#: Limits of speed per opening below and above the other wheels', in windows and over the mission, as multiples of the loss
#: that counts, by whether opening and speed are measured twice. What measurements judge need not be judged by its likeness to
#: others as strictly; what reads too much is in no row of the tables, so that nothing else would tell it.
RESPONSE = {
    (False, False): ((0.75, 0.65), (0.9, 0.7)),
    (True, False): ((1.4, 1.15), (1.25, 0.95)),
    (False, True): ((1.15, 1.0), (1.4, 1.2)),
    (True, True): ((2.0, 1.4), (2.0, 1.4)),
}


def wheel_checks(cells: Cells, clear_at: float) -> Iterator[Checked]:
    """Checks of all wheels; `clear_at` is the loss that counts [1]."""
    speed, command, opening, second = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied", "v_true"))
    reference = cells.reference
    twice = [(_known(opening[:, i]) and _known(command[:, i]), _known(second[:, i])) for i in range(speed.shape[1])]
    used = np.where(np.isfinite(opening), opening, command)
    followed = as_followed(cells, opening, command, OPENING)
    follows = speeds_follow_openings(cells)
    responses = responses_of(cells, speed, used, reference)
    windows, lasting = responses.windows, responses.usual
    tracking, rough = _tracking(cells, speed, reference), _rough_beside_others(roughness_of(cells, speed))
    rough = np.fmax(rough, wild_readings(cells, speed, FLOOR * cells.machine.max_speed))
    delays = late(speed, reference, cells.dt)
    either, share = Side.SENSOR_OR_ACTUATOR, -np.log1p(-clear_at)
    top = cells.machine.max_speed
    for i, wheel in enumerate(cells.machine.wheels):
        about = (Kind.WHEEL, wheel)
        if not _known(speed[:, i]):
            continue
        if twice[i][1]:
            off = compared(cells, speed[:, i], second[:, i], FLOOR * top).off
            yield worst(cells, (*about, Side.SENSOR, Check.SECOND_MEASUREMENT), off, clear_at)
        if twice[i][0]:
            off = compared(cells, opening[:, i], followed[:, i], OPENING).off
            yield worst(cells, (*about, Side.ACTUATOR, Check.SECOND_MEASUREMENT), off, VALVE * clear_at)
        # where an opening is no speed, nothing of it is asked of a wheel that is measured twice on either side
        if _known(used[:, i]) and speed.shape[1] > OTHERS and (follows or not all(twice[i])):
            below, above = RESPONSE[twice[i]]
            yield worst(cells, (*about, either, Check.RESPONSE), -windows[:, i], below[0] * share)
            yield lasts(cells, (*about, either, Check.LASTING_RESPONSE), lasting[i].below, below[1] * share)
            yield worst(cells, (*about, either, Check.EXCESS), windows[:, i], above[0] * share)
            yield lasts(cells, (*about, either, Check.LASTING_EXCESS), lasting[i].above, above[1] * share)
        if _known(reference[:, i]):
            if (
                _known(used[:, i]) or twice[i][1]
            ):  # a drive with a command alone is judged by how it answers it, not by its lag
                yield worst(cells, (*about, either, Check.TRACKING), tracking[:, i], _TRACKING)
            if delays[i] is not None:
                yield lasts(cells, (*about, Side.SENSOR, Check.DELAY), delays[i], LATE_S)
        yield worst(cells, (*about, Side.SENSOR, Check.ROUGHNESS), rough[:, i], ROUGH)


def _known(x: Array) -> bool:
    return bool(np.isfinite(x).any())


def speeds_follow_openings(cells: Cells) -> bool:
    """Whether any wheel's speed is a multiple of its opening, as a valve's is and a torque's is not."""
    speed, command, opening = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied"))
    used = lowest_passed(np.where(np.isfinite(opening), opening, command), cells.dt, _LAG_S)
    explained = []
    for v, u in zip(speed.T, used.T, strict=True):
        moves = np.isfinite(v) & np.isfinite(u) & (np.abs(np.nan_to_num(v)) > MOVING * cells.machine.max_speed / 0.36)
        v, u = v[moves], u[moves]
        power = float(u @ u) * float(v @ v)
        explained.append(float(u @ v) ** 2 / power if power > 0.0 else 1.0)
    return max(explained, default=1.0) > _FOLLOWS


def _others(x: Array) -> Array:
    """Median of the other wheels at the same time, shape (windows, wheels)."""
    columns = range(x.shape[1])
    out = np.full(x.shape, np.nan)
    for i in columns:
        rest = x[:, [j for j in columns if j != i]]
        enough = np.isfinite(rest).sum(axis=1) >= min(OTHERS, rest.shape[1])
        out[enough, i] = np.nanmedian(rest[enough], axis=1)
    return out


class Usual(NamedTuple):
    """By how much a wheel's usual speed per opening is below and above the other wheels'; None where it is not known.

    `least` and `most` are the lower and the higher one of forward and reverse, signed [ln], `ways` both.
    """

    below: float | None = None
    above: float | None = None
    least: float | None = None
    most: float | None = None
    ways: tuple[float | None, float | None] = (None, None)


class Responses(NamedTuple):
    """ln of speed per opening over that of the other wheels.

    Attributes
    ----------
    windows : Array, shape (windows, wheels)
        Against the wheel's usual one.
    beside : Array, shape (windows, wheels)
        As they are.
    usual : list[Usual]
        The usual ones.
    weight : Array, shape (cells, wheels)
        Speed that counts in a window, 0 where none does [m/s].
    ahead : NDArray[np.bool_], shape (windows, wheels)
        Windows whose usual one is that of driving forward.
    """

    windows: Array
    beside: Array
    usual: list[Usual]
    weight: Array
    ahead: NDArray[np.bool_]


def responses_of(cells: Cells, speed: Array, opening: Array, reference: Array) -> Responses:
    """Speed per opening beside the other wheels', arrays (cells, wheels).

    Only where a command (without one: the wheel) has settled; forward and reverse have usual ones of their own.
    """
    frame = cells.frame
    scale = cells.machine.max_speed / 0.36
    known = np.isfinite(reference)
    motion = np.where(known, reference, speed)
    back = max(1, round(_SETTLED_S / cells.dt))
    before = np.concatenate([np.full((min(back, len(motion)), motion.shape[1]), np.nan), motion[:-back]])
    with np.errstate(invalid="ignore"):
        settled = (np.abs(motion) > MOVING * scale) & (np.abs(motion - before) < _SETTLED * scale)
    settled &= np.isfinite(speed) & np.isfinite(opening)
    passed = lowest_passed(opening, cells.dt, _LAG_S)
    moved, opened = (frame.sums(np.where(settled, np.abs(x), 0.0)) for x in (speed, passed))
    enough = frame.sums(settled.astype(np.float64)) >= _LEAST_CELLS * min(frame.length, frame.cells)
    ratio = np.where(enough, moved / np.maximum(opened, 1e-3 * frame.length), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.log(np.maximum(ratio, 1e-3) / _others(ratio))
    ahead = frame.mean(np.sign(np.nan_to_num(motion))) >= 0.0
    off = np.full(log.shape, np.nan)
    lasting: list[Usual] = []
    for i, wheel in enumerate(cells.machine.wheels):
        told = cells.explained(wheel) if not cells.mostly_explained(wheel) else np.zeros(len(log), dtype=np.bool_)
        own = np.where(told, np.nan, log[:, i])  # what a stated fault makes of the wheel is not what is usual
        usual: list[float] = []
        ways: list[float | None] = []
        for way in (ahead[:, i], ~ahead[:, i]):
            ways.append(None)
            here = way & np.isfinite(own)
            if here.any():
                middle = float(np.median(own[here]))
                off[way, i] = log[way, i] - middle
                if np.count_nonzero(here) * frame.hop * cells.dt >= 3.0:
                    usual.append(middle)
                    ways[-1] = middle
        changed = _CHANGED * _change(own, [ahead[:, i], ~ahead[:, i]])
        below = max(0.0, -min(usual), changed) if usual else None
        lasting.append(Usual(below, max(0.0, *usual), min(usual), max(usual), (ways[0], ways[1])) if usual else Usual())
    return Responses(off, log, lasting, np.where(settled, np.abs(speed), 0.0), ahead)


def _change(log: Array, ways: list[NDArray[np.bool_]]) -> float:
    """Largest difference between the medians before and after any moment, of forward or of reverse [ln].

    A loss that lasts about half of the mission is half of what is usual.
    """
    largest = 0.0
    for way in ways:
        x = log[way & np.isfinite(log)]
        least = max(_LEAST_WINDOWS, round(_PART * x.size))
        for k in range(least, x.size - least + 1, max(1, x.size // 40)):
            largest = max(largest, abs(_median(x[:k]) - _median(x[k:])))
    return largest


def _median(x: Array) -> float:
    """Median of finite values; `np.median` looks for NaN and axes first, which takes most of its time here."""
    half = x.size // 2
    if x.size % 2:
        return float(np.partition(x, half)[half])
    low, high = np.partition(x, [half - 1, half])[half - 1 : half + 1]
    return float((low + high) / 2.0)


def _tracking(cells: Cells, speed: Array, reference: Array) -> Array:
    """Mean |v − v_c| by mean |v_c|, less that of the other wheels, shape (windows, wheels)."""
    frame, floor = cells.frame, FLOOR * cells.machine.max_speed
    share = frame.mean(np.abs(speed - reference)) / np.maximum(frame.mean(np.abs(reference)), floor)
    others = _others(share)
    return np.asarray(share - np.where(np.isfinite(others), others, 0.0))


class Roughness(NamedTuple):
    """Quick changes [m/s], what they are a share of [m/s], and the limit of the share, each of shape (windows, wheels)."""

    quick: Array
    size: Array
    limit: Array


def roughness_of(cells: Cells, speed: Array) -> Roughness:
    """Quick changes of speeds (cells, wheels)."""
    frame, floor = cells.frame, FLOOR * cells.machine.max_speed
    quick = np.full(speed.shape, np.nan)
    quick[1:-1] = speed[1:-1] - (speed[:-2] + speed[1:-1] + speed[2:]) / 3.0
    much, size = frame.rms(quick), np.maximum(frame.rms(speed), floor)
    others = _others(much / size)
    return Roughness(much, size, np.maximum(ROUGH, np.where(np.isfinite(others), _ROUGHER * others, 0.0)))


def _rough_beside_others(r: Roughness) -> Array:
    """Quick changes as a share of the speed, 0 unless they are much more than other wheels', shape (windows, wheels)."""
    share = r.quick / r.size
    return np.asarray(np.where((share < r.limit) & (r.limit > ROUGH), 0.0, share))
