"""For every component and side: the assessment by the best evidence that the log offers."""

from __future__ import annotations

import threading
from collections.abc import Collection
from dataclasses import dataclass, replace

from diagnosis.channels.liveness import alive_sources
from diagnosis.efforts.assess import judged_by_efforts
from diagnosis.evidence import ACTUATOR, SENSOR, MissionView, Part
from diagnosis.families import AXLES, SINGLE, whole
from diagnosis.response.unquiet import left_open
from diagnosis.results.assessment import Assessment, unassessed
from diagnosis.results.free_wheels import only_rolls
from diagnosis.results.limited import believed
from diagnosis.results.machine_event import MachineEvent
from diagnosis.results.machine_words import HYDRAULIC, MachineWords, machine_words
from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.results.worded import worded
from replay.arrays.processors import beside
from replay.control.loop import Replay
from replay.faults import State
from replay.machine.config import Machine
from replay.progress import Progress, Subscriber
from replay.signals.timeline import Timeline


@dataclass(frozen=True)
class ComponentResult:
    """Assessments by (component, side), the wheel model behind them, what happened to the machine as a whole, and its words."""

    assessments: dict[Part, Assessment]
    wheel_model: WheelModelFit | None
    events: tuple[MachineEvent, ...] = ()
    words: MachineWords = HYDRAULIC


def assess_components(
    timeline: Timeline,
    replay: Replay,
    machine: Machine,
    wheels: tuple[str, ...],
    progress: Subscriber,
    logged: Collection[str] | None = None,
) -> ComponentResult:
    """Judge wheels and steering axles by the best evidence there is.

    Parameters
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    wheels : tuple[str, ...]
        Wheels to judge; the others only help.
    progress : Subscriber
        Called at the beginning of each stage.
    logged : Collection[str] or None
        Signals of the log, by which its parts are named; None: those of the timeline.
    """
    chosen = tuple(w for w in machine.wheels if w in wheels)
    mission = MissionView(timeline, replay, machine, chosen, alive_sources(timeline), progress)
    mission = _measured(mission)
    for family in whole(mission):
        timeline.store.release()
        mission = mission.after(family.assess(mission))
    parts = [
        (component, side)
        for component in (*chosen, *machine.axles)
        for side in (SENSOR, ACTUATOR)
        if side == SENSOR or component not in machine.unpowered
    ]
    found = {part: mission.known.get(part) or _without_evidence(mission, *part) for part in parts}
    found |= _no_louder(found, mission)
    found |= judged_by_efforts(found, mission)
    found = {part: only_rolls(a) if part[0] in machine.unpowered else a for part, a in found.items()}
    words = machine_words(machine, timeline.signals if logged is None else logged)
    return ComponentResult(
        {part: worded(believed(a), words) for part, a in found.items()},
        None if mission.model is None else replace(mission.model, note=words.fill(mission.model.note)),
        tuple(event.worded(words) for event in mission.events),
        words,
    )


def _no_louder(found: dict[Part, Assessment], mission: MissionView) -> dict[Part, Assessment]:
    """Speed sensors as found, but for times in which they are rough as no other wheel's is."""
    sensors = {w: a for (w, side), a in found.items() if side == SENSOR and w in mission.machine.wheels}
    names = {w: f"wheel.{w}.v" for w in mission.machine.wheels if mission.logged(f"wheel.{w}.v")}
    speeds = {w: (mission.values(n), mission.timeline.fresh[n]) for w, n in names.items()}
    return {(w, SENSOR): a for w, a in left_open(sensors, speeds, mission.timeline.dt).items()}


def _measured(mission: MissionView) -> MissionView:
    """The view after the axles, and after what single wheels show, which is found meanwhile on another processor."""
    told: list[Progress] = []
    here = threading.get_ident()

    def say(stage: Progress) -> None:
        mission.progress(stage) if threading.get_ident() == here else told.append(stage)

    def single() -> MissionView:
        view = replace(mission, progress=say)
        for family in SINGLE:
            view.timeline.store.release()
            view = view.after(family.assess(view))
        return view

    with beside(single, mission.timeline.size) as found:
        axles = mission
        for family in AXLES:
            axles = axles.after(family.assess(axles))
        wheels = found()
    for stage in told:
        mission.progress(stage)
    return replace(axles, known={**axles.known, **wheels.known})


def _without_evidence(mission: MissionView, wheel: str, side: str) -> Assessment:
    """A wheel's part that no family could judge, with what the log lacks."""
    size = mission.timeline.size
    if side == SENSOR:
        if not mission.logged(f"wheel.{wheel}.v"):
            return unassessed(size, State.NO_DATA, "the speed of the {wheel} is not in the log")
        why = "neither a {valve} command, a second speed nor a commanded speed is in the log"
        return unassessed(size, State.NOT_ASSESSED, why)
    if mission.logged(f"wheel.{wheel}.u"):
        why = "the {valve} command is logged, but no speed to compare with it"
        return unassessed(size, State.NOT_ASSESSED, why)
    return unassessed(size, State.NO_DATA, "the command of the {wheel.actuator} is not in the log")
