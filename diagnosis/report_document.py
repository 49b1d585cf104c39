"""The document of a judged mission: everything of ``report.json`` but the comparison with another mission."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from diagnosis.assess import ComponentResult
from diagnosis.clearing.cells import Cells
from diagnosis.clearing.checks import cells_of, checks_of
from diagnosis.clearing.detectable import detectable
from diagnosis.clearing.mapping import Hint, mapping_hints
from diagnosis.decision import metrics, quality
from diagnosis.decision.decide import decide
from diagnosis.decision.decided import Decision
from diagnosis.decision.intervals import intervals_of, spans_of
from diagnosis.decision.log_caveats import more_caveats, without_speed
from diagnosis.decision.missing import is_commanded
from diagnosis.decision.scale import Scale, scale_of
from diagnosis.decision.severity import advised
from diagnosis.decision.wording import join_words
from diagnosis.recording_rows import log_row
from diagnosis.results.assessed import Cut, CutKind
from diagnosis.results.assessment import CODE
from diagnosis.results.clearing import Checked, clearing_rows
from diagnosis.results.detectability import Detectability, detectability_table
from diagnosis.results.document import SCHEMA, CoverageRow, MachineRow, ReportDocument
from diagnosis.results.event_rows import event_rows
from diagnosis.results.loss import loss_rows
from diagnosis.results.machine_event import GYRO_OTHERWISE, MachineEvent
from diagnosis.results.result import FaultInterval, to_json
from diagnosis.results.vocabulary import Kind, Tier
from replay.control.loop import Replay
from replay.faults import Side, State
from replay.machine.config import Machine
from replay.machine.unpowered import is_contradicted
from replay.mission import Mission
from replay.setup.places import place_doubts
from replay.signals.like_wheels import WHICH
from replay.signals.publishing import on_change_hint_in
from replay.signals.unit_conflicts import unit_conflict
from replay.version import __version__

_CUT_S = 0.5  # of a log, not judged
_EMPTY_S = 10.0  # without any speed of a wheel: a fault may have come and gone
_MISSING = 0.2  # of a mission, in which a part of the steering may have no data


@dataclass(frozen=True)
class Judged:
    """A mission with all that was found in it.

    Attributes
    ----------
    mission : Mission
        Files, signals, timeline.
    recorded : quality.Recorded
        What is said of signals as they were recorded.
    machine : Machine
        The machine.
    replay : Replay
        The replayed loop.
    found : ComponentResult
        Assessments of all parts.
    named_by : tuple[Checked, ...]
        Checks that alone name a fault of `found`: which part of it fails is not known, so that they stay open.
    factor : float
        By what the speeds of all wheels were multiplied before they were judged [1].
    mirrored : str
        What is wrong with the settings where every steering angle reads −1 times what it should; may be empty.
    kept : dict[str, Any]
        What the checks computed of the mission, whatever is found in it.
    """

    mission: Mission
    recorded: quality.Recorded
    machine: Machine
    replay: Replay
    found: ComponentResult
    named_by: tuple[Checked, ...] = ()
    factor: float = 1.0
    mirrored: str = ""
    kept: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def intervals(self) -> tuple[FaultInterval, ...]:
        """Faults, worst first."""
        line = self.mission.timeline
        return intervals_of(self.found.assessments, self.machine, self.found.words, line.start_ns, line.step_ns)

    @cached_property
    def cells(self) -> Cells:
        """The mission in cells, with what is stated."""
        line, model = self.mission.timeline, self.found.wheel_model
        return cells_of(line, self.replay, self.machine, self.intervals, model, self.kept)

    @cached_property
    def checks(self) -> tuple[Checked, ...]:
        """What stands behind an all-clear."""
        told = {(c.component, c.side, c.check): c for c in self.named_by}
        return tuple(told.get((c.component, c.side, c.check), c) for c in checks_of(self.cells, self.found.words))

    @cached_property
    def hints(self) -> tuple[Hint, ...]:
        """Signals that the machine file may have wrong."""
        return mapping_hints(self.cells)

    @cached_property
    def places(self) -> tuple[str, ...]:
        """What the turns contradict of the places of wheels and axles, and signs that all angles have wrong."""
        return (*place_doubts(self.mission.timeline, self.machine), *filter(None, [self.mirrored]))

    @cached_property
    def scale(self) -> Scale | None:
        """What is known of the scale of the wheels' speeds."""
        names = {f"wheel.{w}.v" for w in self.machine.wheels}
        units = {row["recorded_unit"] for row in self.recorded.rows if row["name"] in names}
        return scale_of(self.cells, units, factor=self.factor)

    @cached_property
    def detectable(self) -> Detectability:
        """What the mission would have shown."""
        own = {part: a.powers for part, a in self.found.assessments.items() if a.powers is not None}
        return detectable(self.cells, own)

    @property
    def damage(self) -> list[str]:
        """What the files lost."""
        return [text for f in self.mission.files for text in f.summary.damage]


def report_of_mission(judged: Judged, identity: MachineRow) -> ReportDocument:
    """The report of a mission, rounded to nine digits and without NaN.

    Parameters
    ----------
    judged : Judged
        The mission and what was found in it.
    identity : MachineRow
        From `machine_row`.
    """
    mission, machine, replay, found = judged.mission, judged.machine, judged.replay, judged.found
    timeline = mission.timeline
    moving = metrics.driving(replay, timeline, machine)
    timeline.store.release()
    coverage, decided_s = metrics.coverage(found.assessments, moving, machine, timeline.dt)
    decision = _decision(judged, coverage, decided_s, metrics.open_states(found.assessments, moving, machine))
    report: ReportDocument = {
        "schema": SCHEMA,
        "tool": {"name": "mfhca-replay", "version": __version__},
        "log": log_row(mission, moving, machine),
        "machine": identity,
        "readings": to_json(replay.readings),
        "verdict": decision.row([*more_caveats(mission, judged.recorded.first_ns, machine), *_told_scale(judged)]),
        "intervals": to_json(advised(judged.intervals, decision.status, cleared=decision.cleared)),
        "states": to_json(spans_of(found.assessments, timeline.step_ns)),
        "phases": metrics.phases(timeline, replay, machine),
        "coverage": coverage,
        "clearing": clearing_rows(judged.checks),
        "detectability": detectability_table(judged.detectable, found.words),
        "loss": loss_rows({key: a.loss for key, a in found.assessments.items()}),
        "metrics": metrics.loop_metrics(timeline, replay, machine, moving),
        "signals": list(judged.recorded.rows),
        "missing": quality.missing_rows(mission.signals, machine, found.words),
        "quality": quality.checks(
            mission.signals,
            judged.recorded,
            timeline,
            judged.damage,
            [text for f in mission.files for text in f.summary.notes],
            found.assessments,
            found.wheel_model,
            found.words,
            [f.clock for f in mission.files if f.clock is not None],
            judged.scale,
            judged.places,
        ),
        "limits": to_json(machine.limits),
    }
    if events := _events(judged):
        report["events"] = event_rows(events, timeline.size * timeline.dt)
    plain: ReportDocument = to_json(report)
    return plain


def _told_scale(judged: Judged) -> list[str]:
    """A scale that is contradicted, unless it stands among the reasons of the verdict already, or a speed that reads a share for long makes it."""
    scale, length = judged.scale, judged.mission.timeline.size * judged.mission.timeline.dt
    for f in judged.intervals:
        if f.kind is Kind.WHEEL and f.side is Side.SENSOR and f.mode.scaled and 2.0 * (f.stop_s - f.start_s) > length:
            return []
    told = scale is None or scale.gross or scale.event is not None or scale.explained
    return [scale.sentence] if scale is not None and scale.sentence and not told else []


def _of_units(judged: Judged) -> tuple[str, ...]:
    """That units of the machine file contradict those that the channels' own names state; empty where none does."""
    text = unit_conflict((name, s.origin) for name, s in judged.mission.signals.items.items() if not s.guessed)
    return (f"{text[0].upper()}{text[1:]}: correct the unit, or give a gain.",) if text else ()


def _events(judged: Judged) -> tuple[MachineEvent, ...]:
    """What happened to the whole machine; what contradicts the turns by a factor throughout is said once, with what it may be."""
    scale, events = judged.scale, judged.found.events
    if scale is None or not (scale.gross or scale.event is not None):
        return events
    events = tuple(e for e in events if e.title != GYRO_OTHERWISE)
    return events if scale.event is None else (*events, scale.event.worded(judged.found.words))


def _decision(
    judged: Judged,
    coverage: list[CoverageRow],
    decided_s: dict[tuple[str, str], float],
    open_state: dict[tuple[str, str], State],
) -> Decision:
    return decide(
        judged.intervals,
        judged.found.assessments,
        decided_s,
        judged.machine.axles,
        judged.machine.limits,
        judged.damage,
        judged.found.words,
        driving_s={(row["component"], row["side"]): row["driving_s"] for row in coverage},
        model=judged.found.wheel_model,
        checks=judged.checks,
        scope=_scope(judged),
        events=_events(judged),
        hints=(
            *_of_units(judged),
            *(f"{note}." for note in judged.mission.signals.notes if is_contradicted(note)),
            *(h.text for h in judged.hints),
            *([s.gross] if (s := judged.scale) is not None and s.gross else []),
        ),
        misplaced=judged.places,
        open_state=open_state,
        shown=judged.detectable.rows,
        end_s=judged.mission.timeline.size * judged.mission.timeline.dt,
        commanded=is_commanded(judged.mission.signals.items, judged.machine.wheels),
        rarely_sent=on_change_hint_in(judged.mission.signals.notes),
    )


def _scope(judged: Judged) -> tuple[Cut, ...]:
    """Why the mission that was judged is not the whole one."""
    line, machine = judged.mission.timeline, judged.machine
    out: list[Cut] = []
    left_out = [w for w in machine.wheels if not any(component == w for component, _ in judged.found.assessments)]
    if left_out:
        many = len(left_out) > 1
        text = f"the {machine.part}{'s' if many else ''} {', '.join(left_out)} {'were' if many else 'was'} not judged"
        out.append(Cut(CutKind.WHEELS, tuple(left_out), text))
    if more := judged.mission.signals.other_wheels:
        text = f"the log names {len(more)} more {machine.part}s than this machine has ({', '.join(more)}), which were not judged"
        out.append(Cut(CutKind.OTHERS, (), text))
    if asked := next((q for q in machine.questions if q.startswith(WHICH)), ""):
        text = f"the machine file still asks {asked.rstrip('?')}: not judged"
        out.append(Cut(CutKind.OTHERS, (), text))
    unjudged = [axle for axle in machine.axles if _unjudged(judged.found, axle)]
    if unjudged:
        names = join_words([axle.removesuffix("_steer") for axle in unjudged])
        out.append(Cut(CutKind.STEERING, tuple(unjudged), f"the {names} steering was not judged"))
    for missing, axles in _axles_without_data(judged).items():
        names = join_words([axle.removesuffix("_steer") for axle in axles])
        text = f"for {missing} s of {line.size * line.dt:.1f} s, without data, the {names} steering was not judged"
        out.append(Cut(CutKind.DATA, axles, text))
    empty, whole_s = without_speed(line, machine), line.size * line.dt
    if empty > min(_MISSING * whole_s, _EMPTY_S):
        out.append(
            Cut(CutKind.DATA, (), f"for {empty:.1f} s of {whole_s:.1f} s no speed of any {machine.part} was recorded")
        )
    cut = (line.start_ns - judged.recorded.first_ns) * 1e-9
    rest = (judged.recorded.last_ns - line.start_ns) * 1e-9 - line.size * line.dt
    if max(cut, rest) > _CUT_S:
        whole = (judged.recorded.last_ns - judged.recorded.first_ns) * 1e-9
        out.append(Cut(CutKind.LOG, (), f"only {line.size * line.dt:.1f} s of {whole:.1f} s of the log were judged"))
    return tuple(out)


def _axles_without_data(judged: Judged) -> dict[str, tuple[str, ...]]:
    """Axles whose steering has no data for much of the mission, by how long that is [s] as it is written."""
    line, out = judged.mission.timeline, dict[str, tuple[str, ...]]()
    for axle in judged.machine.axles:
        missing = 0 if _unjudged(judged.found, axle) else _without_data(judged.found, axle)
        if missing > _MISSING * line.size:
            said = f"{missing * line.dt:.1f}"
            out[said] = (*out.get(said, ()), axle)
    return out


def _unjudged(found: ComponentResult, component: str) -> bool:
    """Whether neither side of a component was judged by anything."""
    return all(a.tier is Tier.NONE for (who, _), a in found.assessments.items() if who == component)


def _without_data(found: ComponentResult, component: str) -> int:
    """In how many samples a side of a component that was judged had no data while another component had some, at most."""
    none = {part: a.states == CODE[State.NO_DATA] for part, a in found.assessments.items() if a.tier is not Tier.NONE}
    gap = np.logical_and.reduce([x for (who, _), x in none.items() if who != component] or [np.zeros(1, np.bool_)])
    return max((int(np.count_nonzero(x & ~gap)) for (who, _), x in none.items() if who == component), default=0)
