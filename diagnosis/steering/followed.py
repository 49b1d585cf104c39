"""A steering axle of which only the angle and its command are known: whether it stays where it is while it is told to go elsewhere.

How fast a healthy one answers is not known, nor whether its angle is scaled, for its loop holds what it reads. One that stays at an angle
while its command goes to several others, each for longer than any steering takes to get there, does not answer. Where its readings go on
trembling the sensor lives, and its drive, or what lies between, does not turn it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import CODE, Assessment, Finding, Lack, Reason
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.sentence import lasting
from diagnosis.results.sizes import amount
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_CELL_S = 0.25
_ANSWER_S = 3.0  # steering answers within it
_LEAST = 0.03  # rad, of the commanded range
_NOISES = 8.0  # of a cell's mean, by which the commanded range exceeds them
_STAYS, _STAYS_NOISES = 0.05, 4.0  # of the commanded range; times the noise: no motion
_AWAY, _LEVELS = 0.12, 0.15  # of the commanded range: from the angle; that the command goes through meanwhile
_AWAY_RAD = 0.02  # from the angle at least: a loop may leave as much within its dead zone
_TOLD = 0.02  # of full opening, from which on a valve whose command is logged is told to turn the axle
_LEAST_S, _LONG_S = 8.0, 20.0  # of driving with the command elsewhere
_TREMBLES = 0.5  # of the usual trembling from sample to sample
_P, _LONG_P = 0.85, 0.95  # that the axle does not do what it is told
_BACK = 0.75  # of that, where it moves again by itself: the command may not have been in charge
_NEVER = 0.7  # of that, where it never followed
_SENSOR = 0.05  # that readings which tremble are a sensor's that hangs
_FOLLOWS = 0.3  # of the commanded range
_NOTHING = 1e-6  # rad, that a sensor without signal reads
_END = 0.9  # of the largest angle that is asked for: an axle beyond may be at the end of its way
WHY = Reason(
    "its command and its angle alone show whether it stays where it is, and neither a scaled angle nor a weak {valve} behind a loop",
    Lack.COMMAND,
)


class _Axle(NamedTuple):
    """Angle and command in cells [rad], where the machine drives, and the range that is asked for [rad]."""

    y: Array
    low: Array
    high: Array
    moves: Flags
    asked: float


def stays(timeline: Timeline, machine: Machine, axle: str) -> Finding | None:
    """The longest time in which an axle stays at an angle while its logged command goes elsewhere; None where there is none.

    Parameters
    ----------
    timeline : Timeline
        The aligned mission.
    machine : Machine
        Its wheels and limits.
    axle : str
        The axle.
    """
    names = f"steer.{axle}.phi", f"steer.{axle}.phi_ref"
    phi, told = (timeline.get(n) for n in names)
    if phi is None or told is None:
        return None
    width = max(1, round(_CELL_S / timeline.dt))
    one = _cells(timeline, machine, (phi, told), width)
    opening = timeline.get(f"steer.{axle}.u")
    if opening is not None:
        one = one._replace(moves=one.moves & ~(_means(np.abs(opening), width) < _TOLD))
    noise = _usual_change(one.y)
    if not one.asked > max(_LEAST, _NOISES * noise):
        return None
    still = max(_STAYS * one.asked, _STAYS_NOISES * noise)
    best: tuple[float, int, int] | None = None
    for start, stop in _still(one.y, still):
        seconds = _told_elsewhere(one, slice(start, stop), still) * width * timeline.dt
        if seconds >= _LEAST_S and (best is None or seconds > best[0]):
            best = seconds, start, stop
    return None if best is None else _finding(one, best, names, phi, timeline, width)


def assessed(finding: Finding, phi: Array, side: Side) -> Assessment:
    """One side of an axle that stays: open where it moves.

    Parameters
    ----------
    finding : Finding
        Of `stays`.
    phi : Array, shape (n,)
        Measured angle [rad].
    side : Side
        The side.
    """
    states = np.full(phi.size, CODE[State.NOT_ASSESSED], np.int8)
    states[~np.isfinite(phi)] = CODE[State.NO_DATA]
    mine = side in finding.side.sides
    if mine:
        states[finding.start : finding.stop] = CODE[State(finding.mode.value)]
    found = Assessment(states, {State.NO_DATA: "no samples"}, (finding,) if mine else (), {}, Tier.TRACKING)
    return found.reasoned(State.NOT_ASSESSED, WHY)


def _cells(timeline: Timeline, machine: Machine, both: tuple[Array, Array], width: int) -> _Axle:
    y, c = (_means(x, width) for x in both)
    speeds = [x for w in machine.wheels if (x := timeline.get(f"wheel.{w}.v")) is not None]
    least = machine.limits.driving_speed
    moves = (
        np.logical_or.reduce([np.abs(np.nan_to_num(_means(x, width))) > least for x in speeds])
        if speeds
        else np.ones(y.size, np.bool_)
    )
    back = max(1, round(_ANSWER_S / _CELL_S))
    held = np.where(np.isfinite(c), c, np.nan)
    recent = [np.r_[np.full(min(k, c.size), np.nan), held[: max(c.size - k, 0)]] for k in range(back + 1)]
    low, high = (pick.reduce(recent) for pick in (np.fmin, np.fmax))
    known = c[moves & np.isfinite(c)]
    asked = float(np.ptp(np.quantile(known, (0.02, 0.98)))) if known.size else 0.0
    return _Axle(y, low, high, moves, asked)


def _means(x: Array, width: int) -> Array:
    """Mean of the known values of each cell, NaN without one; shape (cells,)."""
    number = -(-x.size // width)
    known = np.isfinite(x)
    at = np.arange(x.size) // width
    count = np.bincount(at[known], minlength=number)
    total = np.bincount(at[known], weights=x[known], minlength=number)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _usual_change(y: Array) -> float:
    """How much the means of cells differ by noise [rad], as a standard deviation: by their second differences, of which motion makes little."""
    change = np.abs(np.diff(y, 2))
    change = change[np.isfinite(change)]
    return float(np.median(change)) * 1.48 / np.sqrt(6.0) if change.size else 0.0


def _still(y: Array, most: float) -> Iterator[tuple[int, int]]:
    """Cells [start, stop) in which the angle goes through no more than `most` [rad]."""
    start, low, high = 0, np.inf, -np.inf
    for k, value in enumerate(y.tolist()):
        if value != value:
            continue
        if max(high, value) - min(low, value) > most:
            yield start, k
            start, low, high = k, value, value
        low, high = min(low, value), max(high, value)
    yield start, y.size


def _told_elsewhere(one: _Axle, part: slice, still: float) -> float:
    """Cells of driving in which the command was elsewhere for longer than an answer takes; 0 where a stop of the steering may hold it."""
    y = one.y[part]
    level = float(np.nanmedian(y)) if np.isfinite(y).any() else np.nan
    least = max(_AWAY * one.asked, _AWAY_RAD, still)
    below, above = one.high[part] < level - least, one.low[part] > level + least
    away = one.moves[part] & (below | above)
    if not away.any():
        return 0.0
    told = np.r_[one.high[part][away & below], one.low[part][away & above]]
    if np.ptp(told) < _LEVELS * one.asked:
        return 0.0
    largest, smallest = float(np.nanmax(one.y)), float(np.nanmin(one.y))
    never = largest - smallest <= still
    above_only, below_only = not (away & below).any(), not (away & above).any()
    if not never and ((above_only and level > largest - still) or (below_only and level < smallest + still)):
        return 0.0  # it may not go any further
    return float(np.count_nonzero(away))


def _finding(
    one: _Axle, found: tuple[float, int, int], names: tuple[str, str], phi: Array, timeline: Timeline, width: int
) -> Finding:
    seconds, first, last = found
    start, stop = first * width, min(last * width, phi.size)
    apart = np.ones(one.y.size, np.bool_)
    apart[first:last] = False
    follows = np.isfinite(one.y) & apart
    moved = float(np.ptp(one.y[follows])) if follows.any() else 0.0
    p = _LONG_P if seconds >= _LONG_S else _P
    back = phi.size - stop > round(_ANSWER_S / timeline.dt)
    p *= (_BACK if back else 1.0) * (1.0 if moved > _FOLLOWS * one.asked else _NEVER)
    new = phi[timeline.fresh[names[0]] & np.isfinite(phi)]
    own = phi[start:stop][timeline.fresh[names[0]][start:stop] & np.isfinite(phi[start:stop])]
    lives = bool(own.size > 1 and np.mean(np.diff(own) != 0.0) > _TREMBLES * float(np.mean(np.diff(new) != 0.0)))
    level = float(np.median(own)) if own.size else 0.0
    low, high = float(np.nanmin(one.low[first:last])), float(np.nanmax(one.high[first:last]))
    side = Side.ACTUATOR if lives else Side.SENSOR_OR_ACTUATOR
    mode = _row(level, (low, high), lives)
    text = (
        f"{names[0]} stays at {amount(level, 'rad')} for {lasting((stop - start) * timeline.dt, 1)} while {names[1]} goes from {amount(low, 'rad')} to "
        f"{amount(high, 'rad')}; for {seconds:.1f} s of driving it was elsewhere for longer than {_ANSWER_S:g} s.",
        "Its readings go on trembling: the sensor lives, and the {valve}, or the linkage, does not turn the axle; or its command was not in charge."
        if lives
        else "Its readings do not even tremble: the sensor may hang, or nothing turns the axle; or its command was not in charge.",
    )
    sensor = _SENSOR * p if lives else 0.0
    hypotheses = (
        Hypothesis(side.value, mode.value, p - sensor),
        Hypothesis(Side.SENSOR.value, FaultMode.STUCK.value, sensor),
        Hypothesis("none", State.HEALTHY.value, 1.0 - p),
    )
    return Finding(
        start=start, stop=stop, side=side, mode=mode, probability=p - sensor,
        hypotheses=tuple(h for h in hypotheses if h.p > 0.0),
        epsilon=Epsilon(1.0, 1.0, 1.0),
        sat=Sat(level, abs(level), level, level, "rad") if mode is FaultMode.STUCK else None,
        evidence=text, tier=Tier.TRACKING,
    )  # fmt: skip


def _row(level: float, told: tuple[float, float], lives: bool) -> FaultMode:
    """L4 and L8 (7): a valve that is stuck open drives its axle to an end, so that one that stands within its way has no signal.

    A sensor without signal reads nothing; one that hangs reads where it was.
    """
    if lives:
        at_end = abs(level) > _END * max(map(abs, told))
        return FaultMode.STUCK if at_end else FaultMode.NO_SIGNAL
    return FaultMode.NO_SIGNAL if abs(level) < _NOTHING else FaultMode.STUCK
