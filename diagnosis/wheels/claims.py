"""What a row that a wheel's model finds is worth on machines of other structure than those that it learned from.

The trees state how often a row was right on simulated machines. On tuning missions of nine others, of which some have motors, load
sensing or gears instead of its valves, these claims were right less often than stated: by command and speed alone, that a valve is
stuck, where the sensor was off instead, or answers less or roughly, where another wheel failed; a small loss of a sensor, where
the machine's own ground or geometry makes as much.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.alike import hardly_moves, is_held, or_shifted
from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, is_about
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.isolation import NOT_PREFERRED
from diagnosis.wheels.onset import only_a_sensor
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

_STUCK_AT_ALL, _SURELY_STUCK = 0.8, 0.95  # right were 2 of 14 below the one, 10 of 15 up to the other, 7 of 7 above
#: Of any fault, below the first: the valve is stuck, loses, or is in no row, and the sensor is in none.
_SHARES = (0.32, 0.25, 0.15, 0.28)
_MOST_STUCK = 0.7
_SURE, _MOST_SMALL = 0.9, 0.5  # of a small loss of a sensor: right were 6 of 6 beyond the one, 8 of 18 below
_PARTLY, _MOST_PARTLY = 0.75, 0.4  # a valve that answers, but less or roughly, right in 5 of 26 below the first
_LOSS_SURE = 0.9  # of a loss of a sensor: below, right were 15 of 28, and its wheel 24 of 28
#: Of such a loss that no second speed shows: on machines of other build right were 54 of 88 from 0.7 to 0.9 beside a measured position, and 60 of 73
#: surer ones, with it or without. What lies behind a valve, a motor, gear or brake that gives less, looks the same.
_MOST_LOST, _MOST_SURELY_LOST = 0.7, 0.85
_BEHIND = (
    "What lies behind the {valve} and gives less, such as a brake that drags, looks nearly the same: a second speed sensor, or a hand "
    "tachometer, would tell."
)
_UNTOLD = (
    "The {wheel} does not follow its command, but whether its {valve} is stuck, or its sensor is off by an offset or a share, "
    "command and speed do not tell: log the {valve}'s position."
)
_LESS_SURE = (
    "By command and speed alone, what seemed a stuck {valve} was something else of the same {wheel} in one of three."
)
_MOST_EITHER = 0.8  # of a loss of either side: right were 63 of 77 on machines of other build, 88 of 98 on the simulator's and `foreign`
_EITHER = (
    "By command and speed alone, a {wheel.sensor} that shows less and a {wheel.actuator} that gives less look alike here; on machines of other "
    "build it was as often the one as the other, and one of both in eight of ten cases. The {position} would tell."
)
_JUMPED = (
    "Such a jump at the onset is the sensor's, not the {valve}'s. That it reads a share is no surer than 80 %: by command and speed alone an offset, or "
    "another {wheel}, looked like it on machines of other build."
)
_MOST_UNPREFERRED = (
    0.6  # of a stuck or silent sensor: all of 58 right claims from 0.85 on were preferred by it (tuning, 15 machines)
)
_BY_NO_MODEL = "The filter of a sensor that gives one value has always said so as well, which makes this less probable."
_ANSWERING = (FaultMode.INEFFICIENT, FaultMode.NOISY)
_OTHERS = "By command and speed alone, another {wheel} or the ground was the cause in four of five such cases."
_SMALL = "Machines of other build differ by as much where nothing is wrong with this sensor."


def as_claimed(found: WheelFindings, clear_at: float, *, measured: bool, swings: bool = False) -> WheelFindings:
    """Findings as sure as they turned out to be.

    Parameters
    ----------
    found : WheelFindings
        Of one wheel.
    clear_at : float
        The loss that counts [1].
    measured : bool
        Whether the valve's position is measured.
    swings : bool
        Whether the machine's wheels swing together: what then hardly seems stuck is left open.
    """
    left_open = [f for f in found.findings if swings and _hardly_stuck(f, measured=measured)]
    for f in left_open:
        for flags in (*found.opened.values(), *found.unexplained.values()):
            flags[f.start : f.stop] = True
    kept = [f for f in found.findings if not any(f is x for x in left_open)]
    return replace(found, findings=[_claimed(f, clear_at, measured=measured) for f in kept])


def or_off(found: WheelFindings, y: Array, expected: Array) -> WheelFindings:
    """Findings of a sensor that is stuck while its wheel should show one speed as what an offset makes of it as well.

    Parameters
    ----------
    found : WheelFindings
        Of one wheel.
    y, expected : Array, shape (n,)
        Measured speed, and that of a healthy wheel [m/s].
    """
    return replace(found, findings=[_or_off(f, y, expected) for f in found.findings])


def _or_off(f: Finding, y: Array, expected: Array) -> Finding:
    part = slice(f.start, f.stop)
    use = np.isfinite(y[part]) & np.isfinite(expected[part])
    stuck = f.side is Side.SENSOR and f.mode is FaultMode.STUCK
    alike = stuck and hardly_moves(y[part][use], expected[part][use]) and not is_held(y, expected, (f.start, f.stop))
    return or_shifted(f) if alike else f


def _hardly_stuck(f: Finding, *, measured: bool) -> bool:
    stuck = f.side is Side.ACTUATOR and f.mode is FaultMode.STUCK
    return stuck and not measured and f.probability < _STUCK_AT_ALL


def _claimed(f: Finding, clear_at: float, *, measured: bool) -> Finding:
    if _hardly_stuck(f, measured=measured):
        return _untold(f)
    if f.side is Side.ACTUATOR and not measured:
        if f.mode is FaultMode.STUCK and f.probability < _SURELY_STUCK:
            return limited(f, _MOST_STUCK, _LESS_SURE)
        if f.mode in _ANSWERING and f.probability < _PARTLY:
            return limited(f, _MOST_PARTLY, _OTHERS)
    if f.side is Side.SENSOR and f.mode.total and NOT_PREFERRED in f.evidence:
        return limited(f, _MOST_UNPREFERRED, _BY_NO_MODEL)
    small = f.mode is FaultMode.INEFFICIENT and f.epsilon is not None and f.epsilon.value < clear_at
    if small and f.side is not Side.ACTUATOR and f.probability < _SURE:
        return limited(f, _MOST_SMALL, _SMALL)
    lost = f.side is Side.SENSOR and f.mode is FaultMode.INEFFICIENT
    if not lost:
        return f
    jumped = only_a_sensor(f.evidence)
    if measured or f.probability >= _LOSS_SURE:
        return f if jumped else _or_behind(f)
    return _of_sensor(f) if jumped else _of_either(f)


def _or_behind(f: Finding) -> Finding:
    """A sensor's loss as one that lies behind its valve as well, which no row of the tables has."""
    most = _MOST_LOST if f.probability < _LOSS_SURE else _MOST_SURELY_LOST
    if f.probability <= most:
        return f
    own, about = (f.side.value, f.mode.value), (Side.ACTUATOR.value, FaultMode.OUTSIDE_TABLE.value)
    p = {(h.side, h.mode): h.p for h in f.hypotheses}
    p |= {own: most, about: p.get(about, 0.0) + f.probability - most}
    named = sorted((Hypothesis(*row, share) for row, share in p.items()), key=lambda h: -h.p)
    return replace(f, probability=most, hypotheses=tuple(named), evidence=(*f.evidence, _BEHIND))


def _of_sensor(f: Finding) -> Finding:
    """A loss that begins with what no wheel can do: the valve has no share in it, an offset of the sensor has."""
    own, valves = (f.side.value, f.mode.value), {(Side.ACTUATOR.value, f.mode.value)}
    off = (f.side.value, FaultMode.OUTSIDE_TABLE.value)
    p = {(h.side, h.mode): h.p for h in f.hypotheses}
    lost = p[own] + sum(p.pop(row, 0.0) for row in valves)
    kept = min(lost, _MOST_EITHER)
    p[own] = kept
    if lost > kept:
        p[off] = p.get(off, 0.0) + lost - kept
    hypotheses = tuple(sorted((Hypothesis(side, mode, x) for (side, mode), x in p.items()), key=lambda h: -h.p))
    said = tuple(t for t in f.evidence if not is_about(t, About.CASES, About.RIVAL))
    return replace(f, probability=kept, hypotheses=hypotheses, evidence=(*said, _JUMPED))


def _of_either(f: Finding) -> Finding:
    """A sensor's loss as one of its wheel: of the sensor, or of the valve."""
    rows = {(side.value, f.mode.value) for side in f.side.sides} | {(Side.ACTUATOR.value, f.mode.value)}
    claimed = sum(h.p for h in f.hypotheses if (h.side, h.mode) in rows)
    both = min(claimed, _MOST_EITHER)
    halves = [Hypothesis(side, mode, both / 2) for side, mode in sorted(rows, reverse=True)]
    others = [h for h in f.hypotheses if (h.side, h.mode) not in rows]
    for about in ((Side.ACTUATOR.value, FaultMode.STUCK.value), (Side.SENSOR.value, FaultMode.OUTSIDE_TABLE.value)):
        had = sum(h.p for h in others if (h.side, h.mode) == about)
        others = [h for h in others if (h.side, h.mode) != about]
        others += [Hypothesis(*about, had + (claimed - both) / 2)] if had or claimed > both else []
    hypotheses = tuple(sorted([*halves, *others], key=lambda h: -h.p))
    said = tuple(t for t in f.evidence if not is_about(t, About.CASES, About.RIVAL))
    return replace(f, side=Side.SENSOR_OR_ACTUATOR, probability=both, hypotheses=hypotheses, evidence=(_EITHER, *said))


def _untold(f: Finding) -> Finding:
    """A valve that is probably not stuck, but whose wheel does not follow: no row has the majority."""
    none = next(
        (h for h in f.hypotheses if h.mode == State.HEALTHY.value), Hypothesis("none", State.HEALTHY.value, 0.0)
    )
    rows = (
        (Side.ACTUATOR, FaultMode.STUCK),
        (Side.ACTUATOR, FaultMode.INEFFICIENT),
        (Side.ACTUATOR, FaultMode.OUTSIDE_TABLE),
        (Side.SENSOR, FaultMode.OUTSIDE_TABLE),
    )
    faults = [Hypothesis(s.value, m.value, x * (1.0 - none.p)) for (s, m), x in zip(rows, _SHARES, strict=True)]
    hypotheses = tuple(sorted([*faults, none], key=lambda h: -h.p))
    return replace(f, probability=faults[0].p, hypotheses=hypotheses, evidence=(_UNTOLD, *f.evidence))
