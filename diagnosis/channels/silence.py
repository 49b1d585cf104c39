"""A sensor that delivers nothing while its source does has no signal, whatever a model makes of the time without it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.liveness import alive, alive_sources
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import lasting
from diagnosis.results.vocabulary import Tier
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side, State
from replay.signals.timeline import Timeline

_LEAST_S = 3.0  # a shorter while may be a disturbed bus
_AS_USUAL = 0.7  # of how often its source delivers elsewhere
_MOSTLY = 0.5  # of a stretch
_P, _SAID = 0.95, 0.5  # probability; of what is told already
Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Span = tuple[int, int]
Part = tuple[str, str]


def with_silent_sensors(assessments: Mapping[Part, Assessment], timeline: Timeline) -> dict[Part, Assessment]:
    """Assessments with sensors that are silent for long, each alone, while other signals of their source come.

    What several sensors lack at the same time is their recorder's or their bus's loss, and no fault of each.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    timeline : Timeline
        The mission.
    """
    gapped: dict[Part, tuple[str, Array]] = {}
    for (component, side), a in assessments.items():
        names = [n for n in (f"wheel.{component}.v", f"steer.{component}.phi") if n in timeline.fresh]
        values = timeline.get(names[0]) if names else None
        if side != Side.SENSOR.value or values is None or a.tier is Tier.NONE:
            continue
        if _long_gaps(np.isfinite(values), timeline.dt):
            gapped[component, side] = names[0], values
    out = dict(assessments)
    if not gapped:  # as in most missions, which need not be searched for what else comes
        return out
    counts = alive_sources(timeline)
    spans = {
        part: (name, silences(values, alive(timeline, counts, name), timeline.dt))
        for part, (name, values) in gapped.items()
    }
    for part, (name, own) in spans.items():
        others = [s for other, (_, of) in spans.items() if other != part for s in of]
        out[part] = with_silence(out[part], [s for s in own if not _shared(s, others)], name, timeline.dt)
    return out


def _shared(span: Span, others: Sequence[Span]) -> bool:
    """Whether another one covers most of a stretch."""
    return any(min(span[1], b) - max(span[0], a) > _MOSTLY * (span[1] - span[0]) for a, b in others)


def silences(y: Array, delivers: Flags, dt: float) -> tuple[Span, ...]:
    """Samples [start, stop) in which a channel has no value for long, while its source goes on as usual.

    Parameters
    ----------
    y : Array, shape (n,)
        The channel; NaN where it has no value.
    delivers : NDArray[np.bool_], shape (n,)
        Steps at which other signals of its source come.
    dt : float
        Step [s].
    """
    known = np.isfinite(y)
    if not known.any():
        return ()
    usual = float(np.mean(delivers[known]))
    spans = _long_gaps(known, dt)
    return tuple((a, b) for a, b in spans if usual > 0.0 and float(np.mean(delivers[a:b])) >= _AS_USUAL * usual)


def _long_gaps(known: Flags, dt: float) -> list[Span]:
    """Samples [start, stop) without a value for long, after the first value; none where there is no value at all."""
    if known.all() or not known.any():
        return []
    missing = ~known
    missing[: int(np.argmax(known))] = False  # what has not begun yet may be late
    return [(a, b) for a, b in runs_of(missing) if (b - a) * dt >= _LEAST_S]


def with_silence(assessment: Assessment, spans: Sequence[Span], name: str, dt: float) -> Assessment:
    """An assessment of a sensor with what it leaves out: that the sensor was silent for long.

    Parameters
    ----------
    assessment : Assessment
        By the model.
    spans : Sequence[tuple[int, int]]
        From `silences`.
    name : str
        The channel.
    dt : float
        Step [s].
    """
    told = [f for f in assessment.findings if not f.mode.total or f.probability >= _SAID]
    left = [(a, b) for a, b in spans if not any(f.start < b and f.stop > a for f in told)]
    if not left:
        return assessment
    unsure = [f for f in assessment.findings if f not in told]
    told += [f for f in unsure if not any(f.start < b and f.stop > a for a, b in left)]
    states = assessment.states.copy()
    for a, b in left:
        states[a:b] = CODE[State.NO_SIGNAL]
    text = "{name} delivered nothing for {time} while other signals of its source came."
    more = [_finding(a, b, text.format(name=name, time=lasting((b - a) * dt, 1))) for a, b in left]
    return replace(assessment, states=states, findings=tuple(sorted([*told, *more], key=lambda f: f.start)))


def _finding(start: int, stop: int, text: str) -> Finding:
    mode, side = FaultMode.NO_SIGNAL, Side.SENSOR.value
    rows = (Hypothesis(side, mode.value, _P), Hypothesis("none", State.HEALTHY.value, 1.0 - _P))
    return Finding(start, stop, Side.SENSOR, mode, _P, rows, Epsilon(1.0, 1.0, 1.0), None, (text,), Tier.SIGNAL)
