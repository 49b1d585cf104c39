"""Openings of valves that are no evidence, since their unit is in doubt: neither looked at, nor is any valve judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from diagnosis.results.assessment import Assessment, Lack, unassessed
from diagnosis.results.machine_words import MachineWords
from replay.faults import Side, State
from replay.machine.config import Machine
from replay.signals.opening_doubts import openings
from replay.signals.timeline import Timeline

#: A component and its side.
Part = tuple[str, str]

_REASON = "the unit of the {valve} openings is in doubt"


def without_openings(timeline: Timeline, machine: Machine) -> Timeline:
    """A timeline without any opening, commanded or measured: what is left judges sensors."""
    left_out = set(openings(timeline, machine))
    return replace(
        timeline,
        signals={n: x for n, x in timeline.signals.items() if n not in left_out},
        fresh={n: x for n, x in timeline.fresh.items() if n not in left_out},
    )


def without_valves(assessments: Mapping[Part, Assessment], words: MachineWords) -> dict[Part, Assessment]:
    """The same with no drive judged."""
    return {
        part: unassessed(a.states.size, State.NOT_ASSESSED, words.fill(_REASON), Lack.OPENING_UNIT)
        if part[1] == Side.ACTUATOR
        else a
        for part, a in assessments.items()
    }
