"""Findings of all parts beside one another: what one of them, or the whole machine, makes of the others'."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.clearing.added_findings import with_findings
from diagnosis.clearing.backwards import without_claims
from diagnosis.clearing.beside import (
    less_sure_beside_dead_sensors,
    less_sure_beside_dead_valves,
    less_sure_beside_wrong_angles,
)
from diagnosis.clearing.contradicted import without_contradicted
from diagnosis.clearing.dragged import less_sure_beside_backwards
from diagnosis.clearing.made_by_axles import without_made_by_axles
from diagnosis.clearing.nothing_moves import supply_gone
from diagnosis.clearing.one_supply import less_sure_beside_supply
from diagnosis.clearing.standing_out import what_stands_out, without_explained, without_followers
from diagnosis.decision.as_a_whole import as_a_whole
from diagnosis.decision.late_axles import as_late_axles
from diagnosis.decision.mirrored import all_mirrored, axles_in_doubt, without_mirrored
from diagnosis.report_document import Judged
from replay.machine.config import Machine
from replay.mission import Mission


def as_one_machine(judged: Judged) -> Judged:
    """What the parts' own evidence comes to for the machine: less of what others explain, more of what checks leave no doubt about, its events."""
    return _with_machine_events(_with_what_stands_out(_without_contradicted(_without_backwards(judged))))


def is_another(mission: Mission, machine: Machine) -> bool:
    """Whether a log is not of the machine that stands in for its own, for it names other wheels."""
    return bool(mission.signals.other_wheels) and "geometry" in machine.assumed


def _without_backwards(judged: Judged) -> Judged:
    """The same without what models claim of parts whose channel counts backwards, or is another one's."""
    found, axles, dt = judged.found, judged.machine.axles, judged.mission.timeline.dt
    named = {component for (component, _), a in found.assessments.items() if a.findings}
    wrong = named & {h.component for h in judged.hints if h.backwards}
    exchanged = named & {component for h in judged.hints for component in h.exchanged}
    every = "" if axles_in_doubt(judged.places, axles) else all_mirrored(found.assessments, axles)
    turned = named & ({*axles} if every else axles_in_doubt(judged.places, axles))
    if not wrong | exchanged | turned:
        return judged
    told = without_claims(found.assessments, wrong, exchanged, dt)
    return Judged(
        judged.mission,
        judged.recorded,
        judged.machine,
        judged.replay,
        replace(found, assessments=without_mirrored(told, turned, dt)),
        factor=judged.factor,
        mirrored=every,
    )


def _without_contradicted(judged: Judged) -> Judged:
    """The same without losses of a speed that nothing but a wheel's model shows, and without faults of wheels that drag another one."""
    told = without_contradicted(judged.found.assessments, judged.cells)
    told = without_followers(told, judged.checks, judged.cells)
    told = less_sure_beside_wrong_angles(told, judged.machine.wheels, judged.machine.axles)
    told = less_sure_beside_dead_valves(told, judged.machine.wheels, judged.found.words)
    told = less_sure_beside_dead_sensors(told, judged.machine.wheels, judged.found.words)
    told = less_sure_beside_backwards(told, judged.cells, judged.found.words)
    if all(told[part] is a for part, a in judged.found.assessments.items()):
        return judged
    return replace(judged, found=replace(judged.found, assessments=told))


def _with_what_stands_out(judged: Judged) -> Judged:
    """The same with parts named that the checks of the all-clear leave no doubt about, unless the whole machine explains them."""
    found = judged.found
    if judged.hints or judged.places or is_another(judged.mission, judged.machine):
        return judged
    more = as_late_axles(what_stands_out(judged.checks, judged.cells, found.words), judged.cells, found.words)
    if not (more := without_explained(more, found.events, judged.machine.axles)):
        return judged
    machine, dt = judged.machine, judged.mission.timeline.dt
    seen = with_findings(found.assessments, more, dt)
    seen = less_sure_beside_wrong_angles(seen, machine.wheels, machine.axles)
    seen = less_sure_beside_dead_sensors(seen, machine.wheels, found.words)
    events = without_made_by_axles(found.events, seen, machine.axles, dt)
    told = replace(found, assessments=seen, events=events)
    open_ = tuple(c for c in judged.checks if c.component in more and not c.passed)
    return replace(judged, found=told, named_by=open_)


def _with_machine_events(judged: Judged) -> Judged:
    """The same with what stopped the whole machine, whose drives were open, or what it does as a whole that no part explains."""
    stopped = supply_gone(judged.cells)
    events = [] if stopped is None else [stopped]
    if not judged.found.events and not judged.hints and not judged.places:
        events += as_a_whole(judged.cells)
    if not events:
        return judged
    found = judged.found
    all_events = (*found.events, *(e.worded(found.words) for e in events))
    told = less_sure_beside_supply(
        found.assessments, all_events, judged.machine.axles, found.words, judged.mission.timeline.dt
    )
    return replace(judged, found=replace(found, assessments=told, events=all_events))
