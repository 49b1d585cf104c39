"""The whole flow: files → signals → timeline → replayed loop → evidence → faults → result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from diagnosis.as_one_machine import as_one_machine, is_another
from diagnosis.assess import ComponentResult, assess_components
from diagnosis.channels.copied_rows import without_copied_rows
from diagnosis.channels.doubted_openings import without_openings, without_valves
from diagnosis.channels.doubted_speeds import rescaled
from diagnosis.channels.recording_gaps import recording_gaps, without_gaps
from diagnosis.channels.resting_position import with_zeroed_positions
from diagnosis.channels.shared_gain import without_shared_gain
from diagnosis.channels.silence import with_silent_sensors
from diagnosis.clearing.backwards import shown_alone
from diagnosis.decision import quality
from diagnosis.decision.changing_rows import with_chains_as_one
from diagnosis.decision.earlier_residuals import with_earlier_residuals
from diagnosis.decision.episodes import with_episodes
from diagnosis.decision.hardly_told import with_hardly_told
from diagnosis.decision.passing_rows import with_disturbances_as_one
from diagnosis.decision.second_onsets import with_second_onsets
from diagnosis.decision.stated_once import without_restated
from diagnosis.decision.valve_noise import with_doubted_noise
from diagnosis.decision.way import path_of
from diagnosis.recording_rows import machine_row
from diagnosis.report_document import Judged, report_of_mission
from diagnosis.response.body import witnesses_of
from diagnosis.results.assessment import Assessment
from diagnosis.results.closeups import closeups_of
from diagnosis.results.document import MachineRow, ReportDocument
from diagnosis.results.machine_event import openings_doubted, speeds_doubted
from diagnosis.results.machine_words import machine_words
from diagnosis.results.result import MissionResult
from diagnosis.results.stated_sizes import known_modes, known_probability, mode_columns, size_columns
from diagnosis.results.vocabulary import Tier
from replay.arrays.column_store import ColumnStore
from replay.arrays.envelope import bucket_of
from replay.control.loop import replay_loop
from replay.control.loop_columns import replay_columns
from replay.errors import ConfigError, NotJudged
from replay.faults import State
from replay.machine.config import Machine
from replay.mission import Mission, load_mission
from replay.progress import Progress, Stage, Subscriber, silent
from replay.signals.opening_doubts import OpeningDoubt, opening_doubt
from replay.signals.signal import Signals
from replay.signals.speed_doubts import SpeedDoubt, speed_doubt
from replay.signals.timeline import Timeline, align

Array = NDArray[np.float64] | NDArray[np.float32]


def diagnose(
    paths: Sequence[Path],
    machine: Machine,
    *,
    machine_source: str = "paper defaults",
    start_s: float | None = None,
    stop_s: float | None = None,
    wheels: Sequence[str] | None = None,
    machine_id: str | None = None,
    progress: Subscriber = silent,
    store: ColumnStore | None = None,
) -> MissionResult:
    """Diagnose one mission.

    Parameters
    ----------
    paths : Sequence[Path]
        The mission's files; several are put on one clock by their stamps.
    machine : Machine
        The machine.
    machine_source : str
        Where the machine's settings come from, for the report.
    start_s, stop_s : float or None
        Part of the mission to judge [s].
    wheels : Sequence[str] or None
        Wheels to judge; None: all.
    machine_id : str or None
        Identity for trends; None: what the logs' metadata state, else the machine file's.
    progress : Subscriber
        Called at the beginning of each stage.
    store : ColumnStore or None
        Where the mission's long columns stand; None: one of its own.

    Raises
    ------
    LogError
        Where a file cannot be read.
    NotJudged
        Where nothing in the log can be judged.
    ConfigError
        Where `wheels` names no wheel of the machine.
    """
    chosen = _chosen(wheels, machine)
    mission = load_mission(paths, machine, start_s=start_s, stop_s=stop_s, progress=progress, store=store)
    recorded = quality.recorded(mission.signals, mission.timeline, machine_words(machine, mission.signals.items))
    mission = replace(mission, signals=mission.signals.without_samples())  # which leaves their memory to the diagnosis
    return _walk(
        mission, recorded, machine, chosen, machine_row(machine, mission, machine_source, machine_id), progress
    )


def diagnose_signals(signals: Signals, machine: Machine) -> MissionResult:
    """Diagnose signals that are already in memory, without a log; see `diagnose`.

    Raises
    ------
    LogError
        Where no wheel signal has two samples.
    NotJudged
        Where nothing can be judged.
    """
    return diagnose_mission(Mission(files=(), signals=signals, timeline=align(signals)), machine)


def diagnose_mission(
    mission: Mission,
    machine: Machine,
    *,
    machine_source: str = "paper defaults",
    wheels: Sequence[str] | None = None,
    machine_id: str | None = None,
    progress: Subscriber = silent,
) -> MissionResult:
    """Diagnose a mission that is already aligned; see `diagnose`.

    Raises
    ------
    NotJudged
        Where nothing in the mission can be judged.
    ConfigError
        Where `wheels` names no wheel of the machine.
    """
    chosen = _chosen(wheels, machine)
    recorded = quality.recorded(mission.signals, mission.timeline, machine_words(machine, mission.signals.items))
    return _walk(
        mission, recorded, machine, chosen, machine_row(machine, mission, machine_source, machine_id), progress
    )


def _chosen(wheels: Sequence[str] | None, machine: Machine) -> tuple[str, ...]:
    chosen = tuple(machine.wheels if wheels is None else wheels)
    for wheel in chosen:
        if wheel not in machine.wheels:
            raise ConfigError(
                f"--wheel {wheel or repr(wheel)}: no such wheel; the machine has {', '.join(machine.wheels)}"
            )
    return chosen


def _walk(
    mission: Mission,
    recorded: quality.Recorded,
    machine: Machine,
    chosen: tuple[str, ...],
    identity: MachineRow,
    progress: Subscriber,
) -> MissionResult:
    """Replay → assess → decide → document; long columns leave memory at every stage until they are read again."""
    shown = without_copied_rows(mission.timeline)
    doubt = opening_doubt(shown, mission.signals.items, machine)
    used = shown if doubt is None else without_openings(shown, machine)
    scale = speed_doubt(used, mission.signals.items, machine, lambda: witnesses_of(used))
    timeline = without_shared_gain(with_zeroed_positions(rescaled(used, scale), machine), machine)
    mission = replace(mission, timeline=timeline)

    def publish(stage: Progress) -> None:
        timeline.store.end_stage()
        progress(stage)

    publish(Progress(Stage.REPLAYING_LOOP))
    replay = replay_loop(timeline, machine, bucket_of(timeline.size))
    found = _outside_gaps(
        assess_components(timeline, replay, machine, chosen, publish, mission.signals.items), machine.axles, timeline
    )
    found = found if doubt is None else _without_valves(found, doubt)
    found = found if scale is None else _with_scale(found, scale)
    if is_another(mission, machine):
        found = replace(found, assessments=shown_alone(found.assessments, timeline.dt))
    if not found.events:  # a machine that does not follow its commands has a report, though no part is judged
        _require_something(found.assessments, mission, machine)
    publish(Progress(Stage.DECIDING))
    factor = 1.0 if scale is None else scale.first_factor
    judged = as_one_machine(Judged(mission, recorded, machine, replay, found, factor=factor))
    found = judged.found
    report = report_of_mission(judged, identity)
    timeline.store.end_stage()
    windows = closeups_of(shown, replay, machine, found.assessments, judged.intervals)
    if windows is not None:
        near = {
            name: x
            for known in (known_probability, known_modes)
            for name, x in known(report, windows.step * timeline.dt, timeline.dt, windows.columns).items()
        }
        windows = replace(windows, columns={**windows.columns, **near})
    return MissionResult(report, _columns(judged, report, shown), windows)


def _without_valves(found: ComponentResult, doubt: OpeningDoubt) -> ComponentResult:
    """The same with no drive judged, and with the reason as what is wrong with the whole machine."""
    event = openings_doubted(doubt.text, doubt.act).worded(found.words)
    return replace(found, assessments=without_valves(found.assessments, found.words), events=(*found.events, event))


def _with_scale(found: ComponentResult, doubt: SpeedDoubt) -> ComponentResult:
    """The same with the scale that all wheels' speeds share as what is wrong with the whole machine."""
    return replace(found, events=(*found.events, speeds_doubted(doubt.text, doubt.act).worded(found.words)))


def _outside_gaps(found: ComponentResult, axles: tuple[str, ...], timeline: Timeline) -> ComponentResult:
    """Nothing is judged where nothing was recorded; findings that are one fault are one."""
    gaps = recording_gaps(timeline)
    told = with_silent_sensors(found.assessments, timeline)
    seen = {key: without_gaps(a, gaps, timeline) for key, a in told.items()}
    joined = with_doubted_noise(with_episodes(seen, timeline.dt), axles, timeline.dt)
    joined = with_hardly_told(joined, axles, timeline.dt)
    joined = with_disturbances_as_one(with_chains_as_one(joined, timeline.dt), timeline.dt)
    joined = without_restated(joined, timeline.dt)
    joined = with_earlier_residuals(joined, timeline.dt)
    return replace(found, assessments=with_second_onsets(joined, timeline.dt))


def _require_something(assessments: Mapping[tuple[str, str], Assessment], mission: Mission, machine: Machine) -> None:
    """Raise where no side of any component has any evidence."""
    if any(a.tier is not Tier.NONE for a in assessments.values()):
        return
    speeds = [w for w in machine.wheels if f"wheel.{w}.v" in mission.signals.items]
    names = ", ".join(str(f.path) for f in mission.files) or "the mission"
    if not speeds:
        raise NotJudged(
            f"{names}: no speed of a {machine.part} was found among its channels; run `mfhca channels` to see them, and name the {machine.part}s' "
            "signals in a machine file's [signals]"
        )
    timeline = mission.timeline
    raise NotJudged(
        f"{names}: its {timeline.size * timeline.dt:.3g} s hold too little driving to judge anything; choose a longer "
        "part of the log, or one in which the machine moves"
    )


def _without_modes(parts: frozenset[tuple[str, str]], columns: Mapping[str, Array]) -> frozenset[tuple[str, str]]:
    """Parts whose evidence gives no probability of each row over time."""
    return frozenset(p for p in parts if f"evidence.{p[0]}.{p[1]}.p_{State.HEALTHY}" not in columns)


def _columns(judged: Judged, report: ReportDocument, timeline: Timeline) -> dict[str, Array]:
    """Signals as recorded, replayed loop, evidence and path under their names."""
    columns: dict[str, Array] = dict(replay_columns(timeline, judged.replay, judged.machine))
    for (component, side), assessment in judged.found.assessments.items():
        columns.update({f"evidence.{component}.{side}.{leaf}": x for leaf, x in assessment.columns.items()})
    parts = frozenset(part for part, a in judged.found.assessments.items() if a.columns)
    columns.update(size_columns(report, columns["t"], timeline.dt, parts))
    columns.update(mode_columns(report, columns["t"], timeline.dt, _without_modes(parts, columns)))
    columns.update(known_probability(report, columns["t"], timeline.dt, columns))
    columns.update(known_modes(report, columns["t"], timeline.dt, columns))
    columns.update(path_of(timeline, judged.machine))
    return columns
