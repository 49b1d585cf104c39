"""Checks of steering axles: second measurements, a command that moves nothing, and the steering rate per opening."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells, Frame
from diagnosis.clearing.measure import alone, compared, lasts, off_commands, times, worst
from diagnosis.clearing.responses import clear_change, growth, largest, largest_change
from diagnosis.clearing.seconds import slope_off
from diagnosis.clearing.still import (
    ALIKE,
    OVERLAP,
    STILL_S,
    answered,
    beyond,
    commanded_still,
    dead_bands,
    rate_of,
    stands,
    still_frame,
)
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

Flags = NDArray[np.bool_]

FLOOR_RAD, OPENING = 0.06, 0.03  # deviations are shares of at least this angle and opening
_SMALL = 0.1  # of that angle: an axle that is steered by less, root mean square, shows nothing
_RATE_S = 8.0
_LEAST_S = 0.5  # of a window, in which it is steered
_WRONG_WAY = 5.0  # for an axle that turns against its opening
_UNSURE, _EDGE = 0.02, 0.5  # by how much a dead band is not known: of full opening, and of itself
VALVE = 1.4  # dead band and hysteresis of a healthy valve: its limit, likewise
#: Limits of the rate in windows and over the mission, as multiples of the loss that counts, by whether angle and opening are measured twice.
RATE = {False: (2.0, 0.6), True: (1.6, 1.0)}
_LEAST_WINDOWS = 16  # for a change
#: Of the loss that counts, and times the other axle's: a change of one axle alone. Dead bands that are not known hide half of one.
_CHANGED, _ALONE = 0.3, 1.5
_CHANGED_TWICE = (
    0.6  # the same where both sides are measured twice, so that what lies behind the valve alone is asked for
)
_ONE_AXLE = 0.75  # of the loss that counts: a change of the only axle, whose oil warms
#: Of the loss that counts, and times the other axle's: a deviation of one axle alone in windows. Of 36 healthy tuning missions of nine machines
#: the axles' largest ones were alike within a factor of 2.6.
_BRIEF, _BRIEF_ALONE = 0.9, 3.0
_ALIKE_DEAD = 0.04  # of full opening: axles of one machine have valves of one kind
_SAME = 1e-6  # of a channel that the share of another one leaves, root mean square: two sensors differ by their noise
_FEW_S = 2.0  # in which an axle is steered, for its usual rate


def axle_checks(cells: Cells, clear_at: float) -> Iterator[Checked]:
    """Checks of all steering axles; `clear_at` is the loss that counts [1]."""
    angle, second, command, opening = (cells.axles(leaf) for leaf in ("phi", "phi_true", "u", "u_applied"))
    either, share = Side.SENSOR_OR_ACTUATOR, -float(np.log1p(-clear_at))
    used = np.where(np.isfinite(opening), opening, command)
    rate = rate_of(angle, cells.dt)
    rates = rates_of(cells, rate, used)
    apart = np.column_stack([cells.apart(axle) for axle in cells.machine.axles]) if cells.machine.axles else True
    angle, second, opening = (np.where(apart, x, np.nan) for x in (angle, second, opening))
    behind = off_commands(cells, opening, command, OPENING)
    place = np.minimum(np.arange(cells.frame.starts.size), len(rates.off) - 1)
    limit = answered(cells)
    joint = len(cells.machine.axles) > 1 and _one_joint(cells, 0, 1)
    both = [bool(np.isfinite(second[:, j]).any() and np.isfinite(opening[:, j]).any()) for j in range(angle.shape[1])]
    changes = [
        _ONE_AXLE * share
        if joint
        else alone(rates.changes, j, share, (_CHANGED_TWICE if both[j] else _CHANGED) * share, _ALONE, others=1)
        for j in range(len(rates.changes))
    ]
    told = any((x or 0.0) > most for x, most in zip(rates.changes, changes, strict=True))  # which of them changes
    for j, axle in enumerate(cells.machine.axles):
        about = (Kind.STEER, axle)
        if not np.isfinite(angle[:, j]).any():
            continue
        if np.isfinite(second[:, j]).any():
            yield _beside_second(cells, axle, angle[:, j], second[:, j], clear_at)
        if np.isfinite(opening[:, j]).any() and np.isfinite(command[:, j]).any():
            yield worst(
                cells, (*about, Side.ACTUATOR, Check.SECOND_MEASUREMENT), behind[:, j], VALVE * clear_at, apart=True
            )
        if not np.isfinite(np.column_stack([second[:, j], used[:, j], cells.means("imu.yaw_rate")])).any():
            yield Checked(*about, Side.SENSOR, Check.ANGLE_SCALE, None, clear_at)
        if np.isfinite(command[:, j]).any():
            yield _still(cells, j, limit)
            twice = both[j]
            off = _alone(rates.off, j) if twice else np.abs(rates.off[:, j])
            deviates = worst(cells, (*about, either, Check.RATE), off[place], brief_limit(rates, j, share, twice=twice))
            changed = lasts(cells, (*about, either, Check.RATE), rates.changes[j], changes[j])
            between = (1.0 if twice else _CHANGED if len(cells.machine.axles) > 1 and not joint else _ONE_AXLE) * share
            parted = lasts(cells, (*about, either, Check.RATE), None if told else rates.parted[j], between)
            yield max([deviates, *(c for c in (changed, parted) if c.worst is not None)], key=times)
            if len(cells.machine.axles) > 1 and not joint:
                yield lasts(cells, (*about, either, Check.LASTING_RATE), rates.apart[j], RATE[twice][1] * share)
            elif not twice:  # both sides of which are measured twice needs nothing to compare with
                yield lasts(cells, (*about, either, Check.PLANT_RATE), rates.apart[j], RATE[twice][1] * share)


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


def brief_limit(rates: Rates, j: int, share: float, *, twice: bool) -> float:
    """Deviation of an axle's rate in windows that counts [ln]: less of it where the other axle hardly deviates.

    `share` is the loss that counts [ln]; `twice`: both sides of the axle are measured twice.
    """
    most = RATE[twice][0] * share
    if twice:
        return most
    return alone([float(x) for x in largest(np.abs(rates.off))], j, most, _BRIEF * share, _BRIEF_ALONE, others=1)


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


class Rates(NamedTuple):
    """ln of the steering rate per opening.

    Attributes
    ----------
    frame : Frame
        Windows of `_RATE_S`.
    off : Array, shape (windows, axles)
        Against the axle's usual one.
    whole : Array, shape (axles,)
        Over the mission; NaN where an axle is hardly steered.
    apart : list[float | None]
        How far that is from the other axle's, or, of the only one, from what the machine file's [steering] lets expect.
    weight : Array, shape (cells, axles)
        Rate that counts in a window, 0 where none does [rad/s].
    changes : list[float | None]
        By how much each axle's usual one changes in the mission at most, alone and beside the other axle's; None where few
        windows tell.
    parted : list[float | None]
        By how much what lies between an axle and the other one changes at least, whatever their dead bands are, where that is
        clear of its scatter, else 0; None where few windows tell.
    """

    frame: Frame
    off: Array
    whole: Array
    apart: list[float | None]
    weight: Array
    changes: list[float | None]
    parted: list[float | None]


def rates_of(cells: Cells, rate: Array, opening: Array) -> Rates:
    """Steering rates per opening beyond what of it moves nothing, while no fault is stated; arrays (cells, axles)."""
    dead, frame = dead_bands(rate, opening), Frame(cells.size, max(1, round(_RATE_S / cells.dt)), cells.frame.hop)
    use = np.isfinite(rate) & np.isfinite(opening)
    for k, axle in enumerate(cells.machine.axles):
        use[:, k] &= np.asarray(~cells.told(axle) | cells.mostly_explained(axle), dtype=np.bool_)
    unsure = np.maximum(_UNSURE, _EDGE * dead)
    steered, ahead, opened = beyond(rate, opening, use, dead)
    # at the edge of a dead band, what of an opening moves something is not known
    enough = frame.sums(opened) >= _EDGE * dead * frame.sums(steered.astype(np.float64))
    most = np.maximum(dead + unsure, min(ALIKE * stands(cells), OVERLAP))
    tried = [
        np.where(enough, _off(frame, cells.dt, rate, opening, use, band), np.nan)
        for band in (dead - unsure, dead, most)
    ]
    off = _nearest(tried)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        whole = np.log(np.maximum(ahead.sum(axis=0) / opened.sum(axis=0), 1e-3))
    whole = np.where(steered.sum(axis=0) * cells.dt >= _FEW_S, whole, np.nan)
    apart: list[float | None] = [None] * len(whole)
    one = len(apart) == 1 or (len(apart) > 1 and _one_joint(cells, 0, 1))
    if one:
        apart = [_by_plant(cells, ahead[:, 0], np.where(steered, opening, 0.0)[:, 0])] * len(apart)
    for j in np.flatnonzero(np.isfinite(whole) & (ahead.sum(axis=0) <= 0.0)):
        apart[j] = _WRONG_WAY
    for a, b in pairwise(range(len(whole))):
        if np.isfinite(whole[a]) and np.isfinite(whole[b]) and not one:
            between = _between(rate[:, [a, b]], opening[:, [a, b]], use[:, [a, b]], dead[[a, b]])
            apart[a], apart[b] = max(apart[a] or 0.0, between), max(apart[b] or 0.0, between)
    changes = [_changes(cells, frame, off, j) for j in range(len(whole))]
    ways = [
        np.where(enough, _off(frame, cells.dt, rate, opening, use, band, by_way=True), np.nan)
        for band in (dead - unsure, dead, most)
    ]
    as_they_are, by_side = _parted(tried), _parted(ways)
    parted = [a if b is None else b if a is None else min(a, b) for a, b in zip(as_they_are, by_side, strict=True)]
    return Rates(frame, off, whole, apart, ahead, changes, parted)


def _between(rate: Array, opening: Array, use: Flags, dead: Array) -> float:
    """How far the rates per opening of two axles are apart [ln], arrays (cells, 2); dead bands (2,) that are nearly alike are taken as one.

    A sensor's gain and a dead band take each other's place: an angle that reads 1.4 was found with a dead band of 0 beside one of 0.02.
    """
    if abs(float(dead[0] - dead[1])) <= _ALIKE_DEAD:
        dead = np.full_like(dead, dead.mean())
    _, ahead, opened = beyond(rate, opening, use, dead)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        log = np.log(np.maximum(ahead.sum(axis=0) / opened.sum(axis=0), 1e-3))
    return float(abs(log[0] - log[1]))


def _parted(tried: Sequence[Array]) -> list[float | None]:
    """By how much what lies between neighbouring axles changes at least [ln], for `Rates`.

    `tried` of shape (windows, axles), by dead bands, of which two of three must say so.
    Axles of one supply lose their oil together, so that a drift of one alone shows between them that its own rates hide.
    """
    out: list[float | None] = [None] * tried[0].shape[1]
    if len(out) == 1 and min(np.count_nonzero(np.isfinite(off)) for off in tried) >= _LEAST_WINDOWS:
        out[0] = float(np.median([clear_change(off[:, 0]) for off in tried]))
    for a, b in pairwise(range(len(out))):
        between = [off[:, a] - off[:, b] for off in tried]
        if min(np.count_nonzero(np.isfinite(x)) for x in between) >= _LEAST_WINDOWS:
            least = float(np.median([clear_change(x) for x in between]))  # one dead band in three may blur it
            out[a], out[b] = max(out[a] or 0.0, least), max(out[b] or 0.0, least)
    return out


def _changes(cells: Cells, frame: Frame, off: Array, j: int) -> float | None:
    """By how much an axle's rate per opening changes, and not that of all axles: their supply's doing [ln]."""
    name = cells.machine.axles[j]
    own = np.where(cells.explained(name, frame), np.nan, off[:, j])
    if np.count_nonzero(np.isfinite(own)) < _LEAST_WINDOWS:
        return None
    apart = [own, *(own - off[:, k] for k in range(off.shape[1]) if k != j and not _one_joint(cells, j, k))]
    every = [np.ones(own.size, np.bool_)]
    return min(
        max(largest_change(x, every), growth(x, every))
        for x in apart
        if np.count_nonzero(np.isfinite(x)) >= _LEAST_WINDOWS
    )


def _one_joint(cells: Cells, j: int, k: int) -> bool:
    """Whether two axles have one angle and one command, each a share of the other's: a joint in the middle of the machine is both, and no witness of itself."""
    return all(_share_of(x[:, j], x[:, k]) for x in (cells.axles("phi"), cells.axles("u")))


def _share_of(x: Array, y: Array) -> bool:
    """Whether one channel is a share of another one, each of shape (cells,)."""
    known = np.isfinite(x) & np.isfinite(y)
    power = float(x[known] @ x[known])
    if power <= 0.0:
        return False
    rest = y[known] - float(x[known] @ y[known]) / power * x[known]
    return float(rest @ rest) <= _SAME**2 * float(y[known] @ y[known])


def _off(
    frame: Frame, dt: float, rate: Array, opening: Array, use: Flags, dead: Array, *, by_way: bool = False
) -> Array:
    """ln of the steering rate per opening beyond such dead bands against its usual one, `by_way`: of that side, (windows, axles)."""
    steered, ahead, opened = beyond(rate, opening, use, dead)
    if by_way:
        opened = _evened(ahead, opened, opening, dt)
    time = frame.sums(steered.astype(np.float64)) * dt
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        log = np.where(time >= _LEAST_S, np.log(np.maximum(frame.sums(ahead) / frame.sums(opened), 1e-3)), np.nan)
    return np.asarray(log - np.array([float(np.nanmedian(x)) if np.isfinite(x).any() else np.nan for x in log.T]))


def _evened(ahead: Array, opened: Array, opening: Array, dt: float) -> Array:
    """Openings that turn an axle to either side as quickly as it usually turns, of its openings beyond dead bands; all (cells, axles).

    A cylinder is slower to the side of its rod, so that an axle that is steered to one side first and to the other later seems to change.
    """
    out = opened.copy()
    for j in range(opened.shape[1]):
        sides = [(opened[:, j] > 0.0) & (sign * opening[:, j] > 0.0) for sign in (1.0, -1.0)]
        moved = [float(ahead[some, j].sum()) for some in sides]
        if min(np.count_nonzero(some) for some in sides) * dt >= _FEW_S and min(moved) > 0.0:
            usual = sum(moved) / float(opened[:, j].sum())
            for some, way in zip(sides, moved, strict=True):
                out[some, j] *= way / (float(opened[some, j].sum()) * usual)
    return out


def _nearest(off: Sequence[Array]) -> Array:
    """The smallest deviation of those that different dead bands give, 0 where they do not agree on its sign."""
    every = np.stack(off)
    low, high = every.min(axis=0), every.max(axis=0)
    return np.asarray(np.where(low > 0.0, low, np.where(high < 0.0, high, 0.0 * low)))


def _by_plant(cells: Cells, ahead: Array, opening: Array) -> float | None:
    """How far the rates of the only steered axle are off those that its plant gives at these openings, over the mission [ln].

    None without a plant, or where it is hardly steered. Rates ahead [rad/s] and openings [1] of shape (cells,).
    """
    plant = cells.machine.steering.get(cells.machine.axles[0])
    if plant is None or np.count_nonzero(opening) * cells.dt < _FEW_S:
        return None
    size, up = np.abs(opening), opening > 0.0
    given = np.where(up, plant.slope_up, plant.slope_down) * np.maximum(
        size - np.where(up, plant.dead_up, plant.dead_down), 0.0
    )
    for sign, most in ((up, plant.limit_up), (~up, plant.limit_down)):
        given = np.where(sign & (given > most), most, given) if most is not None else given
    expected = float(given[opening != 0.0].sum())
    return abs(float(np.log(max(ahead.sum() / expected, 1e-3)))) if expected > 0.0 else None
