"""The steering rate per opening of every axle: beside its usual one, from one part of the mission to another, and beside the other axles'."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells, Frame
from diagnosis.clearing.responses import clear_change, growth, largest_change
from diagnosis.clearing.still import ALIKE, OVERLAP, beyond, dead_bands, stands
from diagnosis.clearing.valve_lag import in_time
from replay.arrays.quantiles import median_known, median_of

Flags = NDArray[np.bool_]

_RATE_S = 8.0
_LEAST_S = 0.5  # of a window, in which it is steered
_WRONG_WAY = 5.0  # for an axle that turns against its opening
_UNSURE, _EDGE = 0.02, 0.5  # by how much a dead band is not known: of full opening, and of itself
_LEAST_WINDOWS = 16  # for a change
_ALIKE_DEAD = 0.04  # of full opening: axles of one machine have valves of one kind
_SAME = 1e-6  # of a channel that the share of another one leaves, root mean square: two sensors differ by their noise
_FEW_S = 2.0  # in which an axle is steered, for its usual rate


class Rates(NamedTuple):
    """ln of the steering rate per opening.

    Attributes
    ----------
    frame : Frame
        Windows of `_RATE_S`.
    off : Array, shape (windows, axles)
        Against the axle's usual one, and no more than against that of each side where it is steered to both for a while in both halves of
        the mission.
    apart : list[float | None]
        How far that over the mission is from the other axle's, or, of the only one, from `planned`; None where an axle is hardly steered.
    planned : list[float | None]
        How far it is from what the machine file's [steering] lets expect; None without that, or where an axle is hardly steered.
    ahead : list[tuple[float, ...]]
        By how much each axle is ahead of its neighbours over the mission, as `apart` has it, but with its sign; empty of the only one.
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
    apart: list[float | None]
    planned: list[float | None]
    ahead: list[tuple[float, ...]]
    weight: Array
    changes: list[float | None]
    parted: list[float | None]


def rates_of(cells: Cells, rate: Array, opening: Array) -> Rates:
    """Steering rates per opening beyond what of it moves nothing, while no fault is stated; arrays (cells, axles).

    Off and changed by no more than with the opening as late as it is answered: of short strokes much is the valve's lag.
    """
    use = np.isfinite(rate) & np.isfinite(opening)
    for k, axle in enumerate(cells.machine.axles):
        use[:, k] &= np.asarray(~cells.told(axle) | cells.mostly_explained(axle), dtype=np.bool_)
    found = _rates(cells, rate, opening, use)
    late = in_time(rate, opening, use, cells.dt)
    answered = _rates(cells, rate, late, use & np.isfinite(late))
    told = np.isfinite(answered.off).any(axis=0)
    off = np.where(told, _nearest([found.off, answered.off]), found.off)
    changes, parted = (
        [a if b is None else b if a is None else min(a, b) for a, b in zip(*both, strict=True)]
        for both in ((found.changes, answered.changes), (found.parted, answered.parted))
    )
    return found._replace(off=off, changes=changes, parted=parted)


def _rates(cells: Cells, rate: Array, opening: Array, use: Flags) -> Rates:
    """The rates per these openings where they count, arrays (cells, axles)."""
    dead, frame = dead_bands(rate, opening), Frame(cells.size, max(1, round(_RATE_S / cells.dt)), cells.frame.hop)
    unsure = np.maximum(_UNSURE, _EDGE * dead)
    steered, turned, opened = beyond(rate, opening, use, dead)
    # at the edge of a dead band, what of an opening moves something is not known
    enough = frame.sums(opened) >= _EDGE * dead * frame.sums(steered.astype(np.float64))
    most = np.maximum(dead + unsure, min(ALIKE * stands(cells), OVERLAP))
    tried = [
        np.where(enough, _off(frame, cells.dt, rate, opening, use, band), np.nan)
        for band in (dead - unsure, dead, most)
    ]
    off = _nearest(tried)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        whole = np.log(np.maximum(turned.sum(axis=0) / opened.sum(axis=0), 1e-3))
    whole = np.where(steered.sum(axis=0) * cells.dt >= _FEW_S, whole, np.nan)
    apart: list[float | None] = [None] * len(whole)
    planned = _by_plants(cells, turned, np.where(steered, opening, 0.0))
    one = len(apart) == 1 or (len(apart) > 1 and one_joint(cells, 0, 1))
    if one:
        apart = planned[:1] * len(apart)
    for j in np.flatnonzero(np.isfinite(whole) & (turned.sum(axis=0) <= 0.0)):
        apart[j] = _WRONG_WAY
    ahead: list[tuple[float, ...]] = [()] * len(whole)
    for a, b in pairwise(range(len(whole))):
        if np.isfinite(whole[a]) and np.isfinite(whole[b]) and not one:
            between = _between(rate[:, [a, b]], opening[:, [a, b]], use[:, [a, b]], dead[[a, b]])
            apart[a], apart[b] = (max(apart[j] or 0.0, abs(between)) for j in (a, b))
            ahead[a], ahead[b] = (*ahead[a], between), (*ahead[b], -between)
    ways = [
        np.where(enough, _off(frame, cells.dt, rate, opening, use, band, by_way=True), np.nan)
        for band in (dead - unsure, dead, most)
    ]
    evened = np.where(_both_ways(opened, opening, cells.dt), _nearest(ways), off)
    changes, off = [_changes(cells, frame, evened, j) for j in range(len(whole))], _nearest([off, evened])
    as_they_are, by_side = _parted(tried), _parted(ways)
    parted = [a if b is None else b if a is None else min(a, b) for a, b in zip(as_they_are, by_side, strict=True)]
    return Rates(frame, off, apart, planned, ahead, turned, changes, parted)


def _between(rate: Array, opening: Array, use: Flags, dead: Array) -> float:
    """How far the first of two axles is ahead of the other in its rate per opening [ln], arrays (cells, 2); dead bands (2,) that are nearly alike are taken as one.

    A sensor's gain and a dead band take each other's place: an angle that reads 1.4 was found with a dead band of 0 beside one of 0.02.
    """
    if abs(float(dead[0] - dead[1])) <= _ALIKE_DEAD:
        dead = np.full_like(dead, dead.mean())
    _, ahead, opened = beyond(rate, opening, use, dead)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        log = np.log(np.maximum(ahead.sum(axis=0) / opened.sum(axis=0), 1e-3))
    return float(log[0] - log[1])


def _parted(tried: Sequence[Array]) -> list[float | None]:
    """By how much what lies between neighbouring axles changes at least [ln], for `Rates`.

    `tried` of shape (windows, axles), by dead bands, of which two of three must say so.
    Axles of one supply lose their oil together, so that a drift of one alone shows between them that its own rates hide.
    """
    out: list[float | None] = [None] * tried[0].shape[1]
    if len(out) == 1 and min(np.count_nonzero(np.isfinite(off)) for off in tried) >= _LEAST_WINDOWS:
        out[0] = float(median_of([clear_change(off[:, 0]) for off in tried]))
    for a, b in pairwise(range(len(out))):
        between = [off[:, a] - off[:, b] for off in tried]
        if min(np.count_nonzero(np.isfinite(x)) for x in between) >= _LEAST_WINDOWS:
            least = float(median_of([clear_change(x) for x in between]))  # one dead band in three may blur it
            out[a], out[b] = max(out[a] or 0.0, least), max(out[b] or 0.0, least)
    return out


def _changes(cells: Cells, frame: Frame, off: Array, j: int) -> float | None:
    """By how much an axle's rate per opening changes, and not that of all axles: their supply's doing [ln]."""
    name = cells.machine.axles[j]
    own = np.where(cells.explained(name, frame), np.nan, off[:, j])
    if np.count_nonzero(np.isfinite(own)) < _LEAST_WINDOWS:
        return None
    apart = [own, *(own - off[:, k] for k in range(off.shape[1]) if k != j and not one_joint(cells, j, k))]
    every = [np.ones(own.size, np.bool_)]
    return min(
        max(largest_change(x, every), growth(x, every))
        for x in apart
        if np.count_nonzero(np.isfinite(x)) >= _LEAST_WINDOWS
    )


def one_joint(cells: Cells, j: int, k: int) -> bool:
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
    return np.asarray(log - np.array([float(median_known(x)) if np.isfinite(x).any() else np.nan for x in log.T]))


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


def _both_ways(opened: Array, opening: Array, dt: float) -> Flags:
    """Whether each axle is steered to either side for a while in both halves of the time it is steered in, shape (axles,).

    Where it is steered to one side first and to the other later, what its usual rates hide may be a fault. Arrays (cells, axles).
    """
    out = np.zeros(opened.shape[1], dtype=np.bool_)
    for j in range(opened.shape[1]):
        at = np.flatnonzero(opened[:, j] > 0.0)
        left = opening[at, j] > 0.0
        half = np.searchsorted(at, at[0] + (at[-1] - at[0]) / 2.0) if at.size else 0
        times = [np.count_nonzero(part) * dt for x in (left[:half], left[half:]) for part in (x, ~x)]
        out[j] = min(times) >= _FEW_S
    return out


def _nearest(off: Sequence[Array]) -> Array:
    """The smallest deviation of those that different ways to take it give, 0 where they do not agree on its sign."""
    every = np.stack(off)
    low, high = every.min(axis=0), every.max(axis=0)
    return np.asarray(np.where(low > 0.0, low, np.where(high < 0.0, high, 0.0 * low)))


def _by_plants(cells: Cells, ahead: Array, opening: Array) -> list[float | None]:
    """How far the rates of each axle are off those that its plant gives at these openings, over the mission [ln].

    None without a plant, or where it is hardly steered. Rates ahead [rad/s] and openings [1] of shape (cells, axles).
    """
    found: list[float | None] = []
    for axle, turned, opened in zip(cells.machine.axles, ahead.T, opening.T, strict=True):
        plant, expected = cells.machine.steering.get(axle), 0.0
        if plant is not None and np.count_nonzero(opened) * cells.dt >= _FEW_S:
            size, up = np.abs(opened), opened > 0.0
            slope, dead = np.where(up, plant.slope_up, plant.slope_down), np.where(up, plant.dead_up, plant.dead_down)
            given = slope * np.maximum(size - dead, 0.0)
            for sign, most in ((up, plant.limit_up), (~up, plant.limit_down)):
                given = np.where(sign & (given > most), most, given) if most is not None else given
            expected = float(given[opened != 0.0].sum())
        found.append(abs(float(np.log(max(turned.sum() / expected, 1e-3)))) if expected > 0.0 else None)
    return found
