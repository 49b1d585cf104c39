"""Openings of valves that are no evidence, since their unit is in doubt: neither looked at, nor is any valve judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding, Lack, unassessed
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.machine.config import Machine
from replay.signals.opening_doubts import openings
from replay.signals.timeline import Timeline

#: A component and its side.
Part = tuple[str, str]

_REASON = "the unit of the {valve} openings is in doubt"
#: A speed that departs from its command: how often it is the sensor's, or the valve's that was not looked at, set by hand.
_ROWS = (
    (Side.SENSOR, None, 0.5),
    (Side.ACTUATOR, FaultMode.STUCK, 0.25),
    (Side.ACTUATOR, FaultMode.INEFFICIENT, 0.25),
)
_BESIDE = "The {valve}'s opening was left out, for its unit is in doubt: a {valve} that does not do as it is told looks the same."


def without_openings(timeline: Timeline, machine: Machine) -> Timeline:
    """A timeline without any opening, commanded or measured: what is left judges sensors."""
    left_out = set(openings(timeline, machine))
    return replace(
        timeline,
        signals={n: x for n, x in timeline.signals.items() if n not in left_out},
        fresh={n: x for n, x in timeline.fresh.items() if n not in left_out},
    )


def without_valves(assessments: Mapping[Part, Assessment], words: MachineWords) -> dict[Part, Assessment]:
    """The same with no drive judged; a speed that departs from its command, without a second one, is of either side."""
    return {
        part: unassessed(a.states.size, State.NOT_ASSESSED, words.fill(_REASON), Lack.OPENING_UNIT)
        if part[1] == Side.ACTUATOR
        else replace(a, findings=tuple(_of_either(f, words) for f in a.findings))
        for part, a in assessments.items()
    }


def _of_either(found: Finding, words: MachineWords) -> Finding:
    """A finding on a sensor that its valve would explain as well, as one of either side; any other as it is."""
    if found.tier is Tier.DIRECT or found.side is not Side.SENSOR or not _departs(found.mode):
        return found
    rows = [
        Hypothesis(side.value, (mode or found.mode).value, share * found.probability) for side, mode, share in _ROWS
    ]
    rest = Hypothesis("none", State.HEALTHY.value, 1.0 - found.probability)
    return replace(
        found,
        side=Side.SENSOR_OR_ACTUATOR,
        probability=_ROWS[0][2] * found.probability,
        hypotheses=(*rows, rest),
        evidence=(*found.evidence, words.fill(_BESIDE)),
    )


def _departs(mode: FaultMode) -> bool:
    """Whether a speed of this row goes on, by another size than its command."""
    return mode.scaled or mode is FaultMode.OUTSIDE_TABLE
