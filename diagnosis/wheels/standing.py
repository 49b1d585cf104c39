"""A speed that reads nothing beside a command: a sensor that is dead, or a wheel that stands.

Sensors that time the edges of a wheel hold their last reading until they give up, and then read 0. What such a one shows of a wheel that
its drive no longer turns is what it shows when it dies; a dead sensor differs where its readings end, or begin again, at a speed that
the sensors of this machine do not leave, or come back to, when wheels stop and start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, is_about
from diagnosis.wheels.findings import WheelFindings
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

_STANDS_S, _STOPS = 0.3, 3  # of zeros that are a stop; fewer stops tell no habit
_NEARLY, _BEYOND = 0.9, 1.5  # quantile of the readings beside stops, and times it
_ZERO = 0.6  # of a time of zeros: a wheel that stands may creep now and then, which a dead sensor would not read
_NEAR_S, _STEADY = 0.3, 1.35  # around an end; times the first reading: a wheel that starts goes on to more than that
_EITHER = 0.85  # that it is one of both, of what the sensor was said to be
_DEAD, _STANDS, _HELD = 0.5, 0.3, 0.2  # sensor dead, drive dead, drive stuck near its middle: of that
_WHY = (
    "Its readings end, and come back, as they do when a {wheel} of this machine stops and starts: a {wheel} that stands, for its {valve} is dead "
    "or nearly closed, would read the same. The {valve}'s position, or a look at the {wheel}, tells."
)


class _Ends(NamedTuple):
    """Readings before and behind a time of zeros [m/s]: the last one, the first one, and the largest soon after; 0 at a log's end."""

    last: float
    first: float
    then: float


def or_standing(
    found: Mapping[int, WheelFindings], speeds: Mapping[int, Array], measured: Mapping[int, bool], dt: float
) -> dict[int, WheelFindings]:
    """Findings of dead speed sensors, of either side where nothing tells their wheel from one that stands.

    Parameters
    ----------
    found : Mapping[int, WheelFindings]
        By wheel.
    speeds : Mapping[int, Array]
        Readings of each wheel, shape (n,) [m/s].
    measured : Mapping[int, bool]
        Whether the position of each wheel's valve is measured.
    dt : float
        Step [s].
    """
    silent = [(i, f) for i, w in found.items() for f in w.findings if not measured[i] and _silent(f, speeds[i])]
    if not silent:
        return dict(found)
    stops = [ends for i, y in speeds.items() for ends in _stops(y, found[i].findings if i in found else [], dt)]
    if len(stops) < _STOPS:
        return dict(found)
    last, first = (
        _BEYOND * float(np.quantile(x, _NEARLY)) for x in zip(*((e.last, e.first) for e in stops), strict=True)
    )
    alike = {id(f) for i, f in silent if _as_usual(_ends(speeds[i], f.start, f.stop, dt), last, first)}
    return {
        i: replace(w, findings=[_of_either(f) if id(f) in alike else f for f in w.findings]) for i, w in found.items()
    }


def _silent(f: Finding, y: Array) -> bool:
    """Whether a sensor is said to give nothing, and reads exactly that for the most part."""
    if f.side is not Side.SENSOR or f.mode is not FaultMode.NO_SIGNAL:
        return False
    known = y[f.start : f.stop][np.isfinite(y[f.start : f.stop])]
    return known.size > 0 and float(np.mean(known == 0.0)) > _ZERO


def _stops(y: Array, findings: list[Finding], dt: float) -> Iterator[_Ends]:
    """What a sensor reads about every stop outside of its findings."""
    for start, stop in runs_of(y == 0.0):
        inside = start > 0 and stop < y.size and (stop - start) * dt >= _STANDS_S
        if inside and not any(f.start < stop and start < f.stop for f in findings):
            yield _ends(y, start, stop, dt)


def _ends(y: Array, start: int, stop: int, dt: float) -> _Ends:
    """Readings about a time of zeros, which may begin or end a little within [start, stop)."""
    near = max(1, round(_NEAR_S / dt))
    before, behind = (
        np.abs(np.nan_to_num(x)) for x in (y[max(0, start - near) : start + near], y[stop - 1 : stop + near])
    )
    shown, back = before[before > 0.0], behind[behind > 0.0]
    first = float(back[0]) if back.size else 0.0
    return _Ends(float(shown[-1]) if shown.size else 0.0, first, float(back.max()) if back.size else 0.0)


def _as_usual(ends: _Ends, last: float, first: float) -> bool:
    """Whether readings end and begin as about a stop: at usual ones, or, of a wheel that starts, such that they go on to more."""
    return ends.last <= last and (ends.first <= first or ends.then > _STEADY * ends.first)


def _of_either(f: Finding) -> Finding:
    """A dead sensor as one of the wheel's: the sensor is dead, or its drive is, or nearly closed."""
    claimed = {(Side.SENSOR.value, FaultMode.NO_SIGNAL.value)}
    rows = (
        (Side.SENSOR, FaultMode.NO_SIGNAL, _DEAD),
        (Side.ACTUATOR, FaultMode.NO_SIGNAL, _STANDS),
        (Side.ACTUATOR, FaultMode.STUCK, _HELD),
    )
    both = _EITHER * sum(h.p for h in f.hypotheses if (h.side, h.mode) in claimed)
    named = {(side.value, mode.value): share * both for side, mode, share in rows}
    kept = {(h.side, h.mode): h.p for h in f.hypotheses if (h.side, h.mode) not in claimed}
    p = {row: kept.pop(row, 0.0) + named[row] for row in named}
    rest = 1.0 - sum(p.values()) - sum(kept.values())
    kept[Side.SENSOR.value, FaultMode.STUCK.value] = kept.get((Side.SENSOR.value, FaultMode.STUCK.value), 0.0) + rest
    hypotheses = [Hypothesis(side, mode, x) for (side, mode), x in (p | kept).items()]
    return replace(
        f,
        side=Side.SENSOR_OR_ACTUATOR,
        probability=p[Side.SENSOR.value, FaultMode.NO_SIGNAL.value] + p[Side.ACTUATOR.value, FaultMode.NO_SIGNAL.value],
        hypotheses=tuple(sorted(hypotheses, key=lambda h: -h.p)),
        evidence=(_WHY, *(e for e in f.evidence if not is_about(e, About.ONSET))),
    )
