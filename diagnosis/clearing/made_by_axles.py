"""Gyro and wheels that contradict each other while an axle does nothing of what it is told: the axle makes that, and no second cause is told."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.machine_event import MachineEvent
from replay.arrays.runs import united

_MOSTLY = 0.8  # of the time of an event
_AFTER_S = 3.0  # that an axle takes, once it is free, to be where it is told


def without_made_by_axles(
    events: Sequence[MachineEvent],
    assessments: Mapping[tuple[str, str], Assessment],
    axles: Collection[str],
    dt: float,
) -> tuple[MachineEvent, ...]:
    """Events of the machine less those of its body's sensors that faults of its axles make.

    The wheels go as the commanded turn asks of them, which is not the turn that a dead axle, or one whose loop follows a frozen angle, makes: they slip, and
    the gyro has the turn that is really made. What is so throughout, or begins before the axle fails, is told still.

    Parameters
    ----------
    events : Sequence[MachineEvent]
        With the machine's own words.
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    axles : Collection[str]
        Steering axles.
    dt : float
        Step [s].
    """
    dead = {
        (f.start * dt, f.stop * dt + _AFTER_S)
        for (component, _), a in assessments.items()
        for f in a.findings
        if component in axles and _total(f)
    }
    return tuple(e for e in events if not (e.body and _within(e, dead)))


def _total(f: Finding) -> bool:
    return f.mode.total and f.probability >= 0.5


def _within(event: MachineEvent, dead: Collection[tuple[float, float]]) -> bool:
    """Whether an event lasts for a while, and for most of it a fault, both in s."""
    return bool(event.spans) and all(
        sum(max(0.0, min(b, stop) - max(a, start)) for start, stop in united(dead)) >= _MOSTLY * (b - a)
        for a, b in event.spans
    )
