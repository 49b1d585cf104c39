"""A speed sensor that repeats one value while its wheel turns, where all others tremble: it is stuck, however near it is to the second one.

What is compared with a second measurement alone is hardly off while the machine goes on at one speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.one_value import TURNS, Frozen, frozen_of, trembling
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.sentence import lasting
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.signals.resolution import rounding_step

Array = NDArray[np.float64]

_OTHERS = 2  # sensors beside this one
_TREMBLES = 0.3  # of the readings of a wheel that turns, which are not the one before
_LEAST_S, _FAR = 1.0, 8.0  # of one value, and times its own longest other run
_STEPS = 1.0  # of the reading, by which all of them tremble: by less one value may be held between two steps
_INSIDE = 0.5  # of its time: said already
_P = 0.96  # as of frozen speeds that have no second one
_OPEN = (CODE[State.HEALTHY], CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED])


def with_frozen_readings(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment]
) -> dict[str, Assessment]:
    """Assessments of speed sensors with those told as stuck that repeat one value while all others go on trembling.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Sensors beside their references, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    """
    out = dict(assessments)
    if len(found) <= _OTHERS:
        return out
    for wheel, one in found.items():
        span, dt = one.pair.span, one.pair.dt
        runs = [
            r
            for r in frozen_of(one.pair.y, span, dt)
            if (r.stop - r.start) * dt >= max(_LEAST_S, _FAR * r.usual_s) and _alone(found, wheel, r)
        ]
        for r in runs:
            out[wheel] = _with(out[wheel], one, r)
    return out


def _alone(found: Mapping[str, IdentifiedPair], wheel: str, r: Frozen) -> bool:
    """Whether the wheel turns by its second sensor, all other speeds tremble meanwhile, and this one does elsewhere."""
    one = found[wheel]
    x = one.samples.x[r.start : r.stop]
    if not np.isfinite(x).any() or abs(float(np.nanmedian(x))) <= TURNS * one.pair.span:
        return False
    inside = np.zeros(one.pair.y.size, np.bool_)
    inside[r.start : r.stop] = True
    others = [_trembling(pair, inside) for name, pair in found.items() if name != wheel]
    known = [t for t in others if t is not None]
    own = _trembling(one, ~inside)
    if own is None or len(known) < _OTHERS:
        return False
    steps = min(size for _, size in known) / max(rounding_step(one.pair.y[one.pair.fresh]), 1e-12)
    return min(share for share, _ in (*known, own)) >= _TREMBLES and steps >= _STEPS


def _trembling(one: IdentifiedPair, where: NDArray[np.bool_]) -> tuple[float, float] | None:
    """`trembling` of new readings."""
    return trembling(one.pair.y[where & one.pair.fresh], TURNS * one.pair.span)


def _with(a: Assessment, one: IdentifiedPair, r: Frozen) -> Assessment:
    """An assessment with one more stuck reading, unless a fault of most of that time is said already."""
    told = sum(max(0, min(f.stop, r.stop) - max(f.start, r.start)) for f in a.findings)
    if told > _INSIDE * (r.stop - r.start):
        return a
    states = a.states.copy()
    inside = states[r.start : r.stop]
    inside[np.isin(inside, _OPEN)] = CODE[State.STUCK]
    return replace(a, states=states, findings=tuple(sorted((*a.findings, _told(one, r)), key=lambda f: f.start)))


def _told(one: IdentifiedPair, r: Frozen) -> Finding:
    length = (r.stop - r.start) * one.pair.dt
    stuck = Hypothesis(Side.SENSOR.value, FaultMode.STUCK.value, _P)
    return Finding(
        start=r.start,
        stop=r.stop,
        side=Side.SENSOR,
        mode=FaultMode.STUCK,
        probability=_P,
        hypotheses=(stuck, Hypothesis("none", State.HEALTHY.value, 1.0 - _P)),
        epsilon=Epsilon(1.0, 1.0, 1.0),
        sat=Sat(r.value, abs(r.value), r.value, r.value, "m/s"),
        evidence=(
            f"{one.pair.y_name} stays at {plain(r.value)} {{speed_unit}} to the last digit for {lasting(length, 2)}; the longest that it stays at "
            f"another value is {r.usual_s:.2f} s, and all other speed sensors go on trembling.",
        ),
        tier=Tier.DIRECT,
    )
