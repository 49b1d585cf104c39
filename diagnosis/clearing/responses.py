"""Speed per opening of each wheel beside the other wheels', in windows, over the mission, and as it changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.dead_openings import beyond, dead_opening
from diagnosis.clearing.measure import lowest_passed
from diagnosis.clearing.turn_slope import turn_slope
from replay.arrays.quantiles import median_known, median_of

LAG_S = 0.15  #: Of a valve and its drive [s].
SETTLED_S, SETTLED = 0.6, 0.03  #: a command that has changed by less than this [m/s] over this time
USUAL_TOP = 0.36  # m/s, of the machine for which speeds here are
MOVING = 0.08  # m/s, for such a machine
_LEAST_CELLS = 0.5  # of a window
_USUAL_S = 3.0  # of one way, from which on there is a usual one
_LEAST_WINDOWS, _PART = 8, 0.2  # before and after a change, at least
_GROWS = 40  # windows, for what grows
OTHERS = 2
#: Times the scatter about its trend by which something changes, where it is no scatter: on tuning machines what lies between two healthy
#: steering axles reached 1.5, a sensor that comes to read 1.4 mostly 1.8 to 18.
_CLEARLY, _NORMAL = 1.75, 1.4826


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
    changes, grown : list[float | None]
        By how much each wheel's usual one changes in the mission at most, and over half of it at its usual pace; None where it is not
        known.
    own, evened : Array, shape (windows, wheels)
        ln of the speed per opening itself, and less what turns make of it [ln of m/s].
    """

    windows: Array
    beside: Array
    usual: list[Usual]
    weight: Array
    ahead: NDArray[np.bool_]
    changes: list[float | None]
    grown: list[float | None]
    own: Array
    evened: Array


def responses_of(
    cells: Cells,
    speed: Array,
    opening: Array,
    reference: Array,
    moving: float = MOVING,
    *,
    over_time: bool = True,
    beyond_dead: bool = False,
) -> Responses:
    """Speed per opening beside the other wheels', arrays (cells, wheels).

    Only where a command (without one: the wheel) has settled beyond `moving` [m/s, for a machine of `USUAL_TOP`]; forward and reverse
    have usual ones of their own. Without `over_time` it is not asked how they change in the mission: `changes` and `grown` are None.
    With `beyond_dead` `windows` are no further off than beyond what of an opening moves no drive of the machine, where its wheels agree better so.
    They are no further off, and change no more, than beside what turns make of all wheels alike (`turn_slope`).
    """
    sums = _sums(cells, speed, opening, reference, moving)
    found = _beside(cells, sums, sums.opened, over_time=over_time)
    stated = np.column_stack([cells.explained(wheel) for wheel in cells.machine.wheels])
    slope = turn_slope(np.where(stated, np.nan, found.beside), sums.turn, sums.ahead)
    if slope != 0.0:
        found = _in_turns(found, _beside(cells, sums, sums.opened, over_time=over_time, slope=slope))
    if beyond_dead:
        some = np.where(sums.enough, sums.moved, np.nan), np.where(sums.enough, sums.opened, np.nan)
        dead = dead_opening(cells, *some, sums.settled, sums.ahead)
        if dead > 0.0:
            windows = _beside(cells, sums, beyond(sums.opened, sums.settled, dead), over_time=False).windows
            found = found._replace(windows=_nearer(found.windows, windows))
    return found


def wheel_responses(cells: Cells) -> Responses:
    """Those of all wheels outside their stated faults, by measured openings where there are any, else by commands: what is checked, and what would show."""

    def found() -> Responses:
        command, opening = cells.wheels("u"), cells.wheels("u_applied")
        apart = np.column_stack([cells.apart(wheel) for wheel in cells.machine.wheels])
        speed = np.where(apart, cells.wheels("v"), np.nan)
        used = np.where(np.isfinite(opening), opening, command)
        return responses_of(cells, speed, used, cells.reference, beyond_dead=True)

    return cells.once_beside("responses of wheels", found)


def _in_turns(found: Responses, evened: Responses) -> Responses:
    """What deviates and changes as it is and with turns evened out: a wheel that turns far, or is on its way there, follows no straight line."""
    changes = [
        None if a is None or b is None else min(a, b) for a, b in zip(found.changes, evened.changes, strict=True)
    ]
    windows = _nearer(found.windows, evened.windows)
    return found._replace(windows=windows, changes=changes, evened=evened.evened)


def _nearer(a: Array, b: Array) -> Array:
    """Whichever of two deviations is smaller, 0 where they do not agree on its sign: neither what is dead nor what turns make is known well."""
    return np.asarray(np.where(np.sign(a) * np.sign(b) < 0.0, 0.0, np.where(np.abs(a) < np.abs(b), a, b)))


class _Sums(NamedTuple):
    """What wheels do in windows, shape (windows, wheels), but for `weight`, of which a window has the sums: (cells, wheels).

    Speed [m/s] and opening [1] over settled cells, how many these are and whether they are enough, whether it drives forward, and ln of its
    commanded speed over that of the other wheels there, NaN where a command is not known.
    """

    weight: Array
    moved: Array
    opened: Array
    settled: Array
    enough: NDArray[np.bool_]
    ahead: NDArray[np.bool_]
    turn: Array


def _sums(cells: Cells, speed: Array, opening: Array, reference: Array, moving: float) -> _Sums:
    frame = cells.frame
    scale = cells.machine.max_speed / USUAL_TOP
    known = np.isfinite(reference)
    motion = np.where(known, reference, speed)
    back = max(1, round(SETTLED_S / cells.dt))
    before = np.concatenate([np.full((min(back, len(motion)), motion.shape[1]), np.nan), motion[:-back]])
    with np.errstate(invalid="ignore"):
        settled = (np.abs(motion) > moving * scale) & (np.abs(motion - before) < SETTLED * scale)
    settled &= np.isfinite(speed) & np.isfinite(opening)
    passed = lowest_passed(opening, cells.dt, LAG_S)
    weight = np.where(settled, np.abs(speed), 0.0)
    moved, opened = frame.sums(weight), frame.sums(np.where(settled, np.abs(passed), 0.0))
    count = frame.sums(settled.astype(np.float64))
    enough = count >= _LEAST_CELLS * min(frame.length, frame.cells)
    asked = frame.sums(np.where(settled & known, np.abs(motion), 0.0)) / np.maximum(count, 1.0)
    asked = np.where(enough & (frame.sums((settled & ~known).astype(np.float64)) == 0.0), asked, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.log(asked / others_at(asked, cells.driven))
    ahead = frame.mean(np.sign(np.nan_to_num(motion))) >= 0.0
    return _Sums(weight, moved, opened, count, enough, ahead, turn)


def _beside(cells: Cells, sums: _Sums, opened: Array, *, over_time: bool, slope: float = 0.0) -> Responses:
    """Of sums of openings (windows, wheels), of which some may be left out; less what turns make of them by such a slope."""
    frame, ahead = cells.frame, sums.ahead
    ratio = np.where(sums.enough, sums.moved / np.maximum(opened, 1e-3 * frame.length), np.nan)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        log = np.log(np.maximum(ratio, 1e-3) / others_at(ratio, cells.driven))
        alone = np.log(np.maximum(ratio, 1e-3))
    by_turn = slope * np.nan_to_num(sums.turn)
    log = log - by_turn
    off = np.full(log.shape, np.nan)
    lasting: list[Usual] = []
    changes: list[float | None] = []
    grown: list[float | None] = []
    for i, wheel in enumerate(cells.machine.wheels):
        ways_apart = [ahead[:, i], ~ahead[:, i]]
        own = np.where(cells.explained(wheel), np.nan, log[:, i])  # a stated fault is not what is usual
        if np.count_nonzero(np.isfinite(own)) < _LEAST_WINDOWS:  # it is nearly all that there is
            own = log[:, i]
        usual: list[float] = []
        ways: list[float | None] = []
        for way in ways_apart:
            here = way & np.isfinite(own)
            lasts = np.count_nonzero(here) * frame.hop * cells.dt >= _USUAL_S
            ways.append(float(median_of(own[here])) if lasts else None)
        for k, middle in enumerate(ways):
            here = ways_apart[k] & np.isfinite(own)
            usual += [] if middle is None else [middle]
            if here.any():  # what is too short to be usual is held to the other way's usual one: it may be all fault
                either = [x for x in (middle, ways[1 - k]) if x is not None]
                expected = either[0] if either else float(median_of(own[here]))
                off[ways_apart[k], i] = log[ways_apart[k], i] - expected
        asked = over_time and bool(usual)
        changes.append(largest_change(own, ways_apart) if asked else None)
        grown.append(growth(own, ways_apart) if asked else None)
        lasting.append(
            Usual(max(0.0, -min(usual)), max(0.0, *usual), min(usual), max(usual), (ways[0], ways[1]))
            if usual
            else Usual()
        )
    return Responses(off, log, lasting, sums.weight, ahead, changes, grown, alone, alone - by_turn)


def largest_change(log: Array, ways: Sequence[NDArray[np.bool_]]) -> float:
    """Largest difference between the medians before and after any moment, of each of some sorts of windows alone [ln]; shape (windows,).

    A loss that lasts about half of the mission is half of what is usual.
    """
    largest = 0.0
    for way in ways:
        x = log[way & np.isfinite(log)]
        least = max(_LEAST_WINDOWS, round(_PART * x.size))
        for k in range(least, x.size - least + 1, max(1, x.size // 40)):
            largest = max(largest, abs(median_of(x[:k]) - median_of(x[k:])))
    return float(largest)


def growth(log: Array, ways: Sequence[NDArray[np.bool_]]) -> float:
    """Change over half of the mission at the median pace between windows a third to two thirds apart, of each sort alone [ln]; shape (windows,).

    By as much halves differ of what grows all the time; what merely comes and goes has no pace, and is not in the way.
    """
    largest = 0.0
    for way in ways:
        at = np.flatnonzero(way & np.isfinite(log))
        n = at.size
        if n < _GROWS:
            continue
        apart = [(at[:-k], at[k:]) for k in range(n // 3, 2 * n // 3 + 1, max(1, n // 24))]
        pace = median_of(np.concatenate([(log[b] - log[a]) / (b - a) for a, b in apart]))
        largest = max(largest, 0.5 * abs(pace) * float(at[-1] - at[0]))
    return largest


def clear_change(log: Array) -> float:
    """Change of some windows, shape (windows,), in the mission [ln]; 0 where it may be their scatter about their trend."""
    every, at = [np.ones(log.size, np.bool_)], np.flatnonzero(np.isfinite(log))
    change = max(largest_change(log, every), growth(log, every))
    about = log[at] - np.polyval(np.polyfit(at, log[at], 1), at)
    scatter = _NORMAL * float(median_of(np.abs(about - median_of(about))))
    return change if change >= _CLEARLY * scatter else 0.0


def largest(windows: Array) -> Array:
    """Largest value of each wheel; NaN where none is known. From shape (windows, wheels) to (wheels,)."""
    most = np.max(np.where(np.isfinite(windows), windows, -np.inf), axis=0, initial=-np.inf)
    return np.where(np.isfinite(most), np.maximum(most, 0.0), np.nan)


def others_at(x: Array, among: Sequence[int] | None = None) -> Array:
    """Median of the other wheels at the same time, shape (windows, wheels); `among`: wheels that can be compared, None: all."""
    columns = range(x.shape[1])
    out = np.full(x.shape, np.nan)
    for i in columns:
        rest = x[:, [j for j in (columns if among is None else among) if j != i]]
        enough = np.isfinite(rest).sum(axis=1) >= min(OTHERS, rest.shape[1])
        out[enough, i] = median_known(rest[enough], axis=1)
    return out
