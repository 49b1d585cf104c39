"""A reading that repeats one value while its wheel drives, where the others tremble, or its second one goes on: it is stuck, however near both are.

What is compared with a second measurement alone is hardly off while the machine goes on at one speed, or comes back to it. Of a valve's position
nothing says whether the valve is stuck or its position's sensor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.one_value import TURNS, Frozen, frozen_of, trembling
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.sentence import lasting
from diagnosis.results.sizes import amount
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.signals.resolution import rounding_step

Array = NDArray[np.float64]

_OTHERS = 2  # sensors beside this one
_TREMBLES = 0.3  # of the readings of a wheel that turns, which are not the one before
_LEAST_S, _FAR = 1.0, 8.0  # of one value, and times its own longest other run
_STEPS = 1.0  # of the reading, by which all of them tremble: by less one value may be held between two steps
_INSIDE = 0.5  # of its time: said already
#: Of the value, and steps of the reading, by which the second sensor leaves it, for a part of its time, and goes on
_LEAVES, _LEAVES_STEPS, _MUCH = 0.05, 10.0, 0.3
_OTHERS_TREMBLE = {
    Side.SENSOR: "the other speed sensors go on trembling",
    Side.ACTUATOR: "the other {position}s go on trembling; it may be its sensor alone",
}
_P = 0.96  # as of frozen speeds that have no second one
_VALVE = 0.7  # of a position, that the valve is stuck rather than its position's sensor; set by hand
_OPEN = (CODE[State.HEALTHY], CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED])


def with_frozen_readings(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment]
) -> dict[str, Assessment]:
    """Assessments of speed sensors, or of valves, with those told as stuck that repeat one value while the others tremble, or their second one goes on.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Sensors beside their references, or positions beside their commands, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    """
    out = dict(assessments)
    held = {wheel: frozen_of(one.pair.y, one.pair.span, one.pair.dt) for wheel, one in found.items()}
    for wheel, one in found.items():
        dt = one.pair.dt
        for r in held[wheel]:
            if (r.stop - r.start) * dt < max(_LEAST_S, _FAR * r.usual_s) or _most_hold(held, wheel, r):
                continue
            why = _goes_on(one, r) or (_OTHERS_TREMBLE[one.pair.side] if _stands_out(found, held, wheel, r) else None)
            if why is not None:
                out[wheel] = _with(out[wheel], one, r, why)
    return out


def _goes_on(one: IdentifiedPair, r: Frozen) -> str | None:
    """That the second sensor leaves such a value far behind meanwhile; None where it does not."""
    if one.pair.side is Side.ACTUATOR:
        return None  # a command that goes on is what its rows are told by
    x = one.samples.x[r.start : r.stop]
    x = x[np.isfinite(x)]
    least = max(_LEAVES * abs(r.value), _LEAVES_STEPS * rounding_step(one.pair.y[one.pair.fresh]))
    if not x.size or float(np.mean(np.abs(x - r.value) >= least)) < _MUCH:
        return None
    low, high = float(x.min()), float(x.max())
    return (
        f"its second sensor reads {plain(low)} to {plain(high)} {{speed_unit}} meanwhile"
        if high - low >= least
        else None
    )


def _stands_out(
    found: Mapping[str, IdentifiedPair], held: Mapping[str, Sequence[Frozen]], wheel: str, r: Frozen
) -> bool:
    """Whether the wheel turns by its second sensor, the other speeds that are not held tremble meanwhile, and this one does elsewhere."""
    one = found[wheel]
    x = one.samples.x[r.start : r.stop]
    if not np.isfinite(x).any() or abs(float(np.nanmedian(x))) <= TURNS * one.pair.span:
        return False
    inside = np.zeros(one.pair.y.size, np.bool_)
    inside[r.start : r.stop] = True
    others = [_trembling(pair, inside) for name, pair in found.items() if name != wheel and not _holds(held[name], r)]
    known = [t for t in others if t is not None]
    own = _trembling(one, ~inside)
    if own is None or len(known) < _OTHERS:
        return False
    steps = min(size for _, size in known) / max(rounding_step(one.pair.y[one.pair.fresh]), 1e-12)
    return min(share for share, _ in (*known, own)) >= _TREMBLES and steps >= _STEPS


def _most_hold(held: Mapping[str, Sequence[Frozen]], wheel: str, r: Frozen) -> bool:
    """Whether most other sensors repeat one value meanwhile, too: their log does."""
    others = [_holds(runs, r) for name, runs in held.items() if name != wheel]
    return bool(others) and sum(others) >= len(others) / 2


def _holds(held: Sequence[Frozen], r: Frozen) -> bool:
    """Whether another sensor repeats one value for most of that time as well."""
    return sum(max(0, min(h.stop, r.stop) - max(h.start, r.start)) for h in held) > _INSIDE * (r.stop - r.start)


def _trembling(one: IdentifiedPair, where: NDArray[np.bool_]) -> tuple[float, float] | None:
    """`trembling` of new readings."""
    return trembling(one.pair.y[where & one.pair.fresh], TURNS * one.pair.span)


def _with(a: Assessment, one: IdentifiedPair, r: Frozen, why: str) -> Assessment:
    """An assessment with one more stuck reading, unless a fault of most of that time is said already."""
    told = sum(max(0, min(f.stop, r.stop) - max(f.start, r.start)) for f in a.findings)
    if told > _INSIDE * (r.stop - r.start):
        return a
    states = a.states.copy()
    inside = states[r.start : r.stop]
    inside[np.isin(inside, _OPEN)] = CODE[State.STUCK]
    return replace(a, states=states, findings=tuple(sorted((*a.findings, _told(one, r, why)), key=lambda f: f.start)))


def _told(one: IdentifiedPair, r: Frozen, why: str) -> Finding:
    length, pair = (r.stop - r.start) * one.pair.dt, one.pair
    p = _VALVE if pair.side is Side.ACTUATOR else _P
    stuck = Hypothesis(pair.side.value, FaultMode.STUCK.value, p)
    beside = [Hypothesis(pair.side.value, FaultMode.OUTSIDE_TABLE.value, _P - p)] if p < _P else []
    return Finding(
        start=r.start,
        stop=r.stop,
        side=pair.side,
        mode=FaultMode.STUCK,
        probability=p,
        hypotheses=(stuck, *beside, Hypothesis("none", State.HEALTHY.value, 1.0 - _P)),
        epsilon=Epsilon(1.0, 1.0, 1.0),
        sat=Sat(r.value, abs(r.value), r.value, r.value, pair.unit),
        evidence=(
            f"{pair.y_name} stays at {amount(r.value, pair.unit)} to the last digit for {lasting(length, 2)}; the longest that it stays at "
            f"another value is {r.usual_s:.2f} s, and {why}.",
        ),
        tier=Tier.DIRECT,
    )
