"""A run of `mfhca diagnose`: check what was asked, diagnose, write, show, and give the exit code."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cli.tables.clips import FOLDER, show_clips
from cli.terminal.browser import show_page
from cli.terminal.collecting import all_loaded
from cli.terminal.console import Terminal
from cli.terminal.options import FailOn
from diagnosis.api.inputs import check_output, check_times, check_wheels, machine_of, mission_paths
from diagnosis.api.saved_results import previous_result
from diagnosis.own_files import check_replaced
from replay.arrays.freed_memory import keep_freed_memory
from replay.arrays.linear_algebra import load_addresses
from replay.progress import Progress, Stage, Subscriber

if TYPE_CHECKING:
    from diagnosis.results.document import MachineIdentity, ReportDocument
    from diagnosis.results.result import MissionResult
    from replay.machine.config import Machine
    from replay.mission import Mission

_OUTPUTS = ("report.html", "report.json", "report.parquet")


@dataclass(frozen=True)
class DiagnoseRequest:
    """What the command line asks for; names and defaults as there."""

    logs: list[Path]
    output: Path | None
    machine: Path | None
    start_s: float | None
    end_s: float | None
    wheels: list[str] | None
    fail_on: FailOn
    machine_id: str | None
    previous: Path | None
    json: bool
    dry_run: bool
    open_page: bool
    clips: bool
    clip_margin_s: float
    max_size_mb: float
    verify: bool = False


@dataclass(frozen=True)
class _Checked:
    """What the words of a request stand for.

    Attributes
    ----------
    machine_source : str
        Where the machine's settings come from.
    wheels : tuple[str, ...] or None
        Wheels to judge; None: all.
    previous : ReportDocument or None
        Result to compare with.
    """

    paths: list[Path]
    machine: Machine
    machine_source: str
    wheels: tuple[str, ...] | None
    folder: Path
    outputs: list[Path]
    previous: ReportDocument | None


def run_diagnosis(terminal: Terminal, request: DiagnoseRequest) -> int:
    """Diagnose a mission, or say what would be read and written; give the exit code."""
    checked = _checked(request)
    if request.dry_run:
        _show_plan(terminal, checked, request.json)
        return 0
    mission, result, written = _diagnosed(terminal, request, checked)
    page = next((p for p in written if p.name == "report.html"), written[0])
    if request.json:
        terminal.show_json(result.report)
    else:
        from cli.tables.verdict import verdict_parts

        terminal.show(*verdict_parts(result.report))
    if request.verify:
        _verify(terminal, result)
    terminal.show(f"Report: {page}")
    if mission is not None:
        _cut_clips(terminal, mission, result, checked, request.clip_margin_s)
    if request.open_page:
        show_page(terminal, page)
    from diagnosis.api.verdict import exit_code

    return exit_code(result.report, request.fail_on.value)


def _checked(request: DiagnoseRequest) -> _Checked:
    """The request, where it can be done.

    Raises
    ------
    LogError
        Where a log or the result to compare with cannot be read.
    ConfigError
        Where the machine file or an option is wrong.
    """
    paths = mission_paths(request.logs)
    check_times(request.start_s, request.end_s)
    machine, source = machine_of(request.machine)
    wheels = check_wheels(request.wheels, machine)
    folder = request.output if request.output is not None else _default_folder(paths[0])
    outputs = [folder / name for name in (*_OUTPUTS, *((FOLDER,) if request.clips else ()))]
    check_output(outputs, paths)
    check_replaced(folder)
    previous = previous_result(request.previous)
    if previous is not None:
        from diagnosis.comparison.previous import require_same_machine

        identity: MachineIdentity = {"id": request.machine_id or machine.id, "wheels": list(machine.wheels)}
        require_same_machine(identity, previous, str(request.previous))
    return _Checked(paths, machine, source, wheels, folder, outputs, previous)


def _diagnosed(
    terminal: Terminal, request: DiagnoseRequest, checked: _Checked
) -> tuple[Mission | None, MissionResult, tuple[Path, ...]]:
    """The mission where clips are to be cut from it, its result, and the files that were written."""
    from cli.terminal.progress import diagnosis_plan

    keep_freed_memory()
    load_addresses()
    machine = checked.machine
    plan = diagnosis_plan(checked.paths, checked.wheels or machine.wheels, machine.axles)
    with terminal.progress(Stage.STARTING, plan=plan) as progress:
        from diagnosis.output import write_result

        mission, result = _judged(request, checked, progress)
        if checked.previous is not None:
            from diagnosis.comparison.previous import with_previous

            result = replace(result, report=with_previous(result.report, checked.previous, str(request.previous)))
        progress(Progress(Stage.WRITING_REPORT))
        return mission, result, write_result(result, checked.folder, max_size_mb=request.max_size_mb)


def _judged(request: DiagnoseRequest, checked: _Checked, progress: Subscriber) -> tuple[Mission | None, MissionResult]:
    from diagnosis import pipeline

    all_loaded()
    machine, source, wheels, name = checked.machine, checked.machine_source, checked.wheels, request.machine_id
    start, stop = request.start_s, request.end_s
    if not request.clips:
        return None, pipeline.diagnose(
            checked.paths,
            machine,
            machine_source=source,
            start_s=start,
            stop_s=stop,
            wheels=wheels,
            machine_id=name,
            progress=progress,
        )
    from replay.mission import load_mission

    mission = load_mission(checked.paths, machine, start_s=start, stop_s=stop, progress=progress)
    return mission, pipeline.diagnose_mission(
        mission, machine, machine_source=source, wheels=wheels, machine_id=name, progress=progress
    )


def _verify(terminal: Terminal, result: MissionResult) -> None:
    """Show each fault beside what filterpy makes of it; on stderr where stdout holds the document."""
    with terminal.progress(Stage.VERIFYING) as progress:
        from diagnosis.decision.verified import verified

        found = verified(result, lambda done, of: progress(Progress(Stage.VERIFYING, f"{done} of {of} faults")))
    from cli.tables.verified import verified_parts

    terminal.show(*verified_parts(result.report, found))


def _cut_clips(terminal: Terminal, mission: Mission, result: MissionResult, checked: _Checked, margin_s: float) -> None:
    folder = checked.folder / FOLDER
    with terminal.progress(Stage.CUTTING_CLIPS) as progress:
        from diagnosis.clips.write import write_clips

        clips = write_clips(mission, result, checked.machine, folder, margin_s=margin_s, progress=progress)
    show_clips(terminal, clips, folder)


def _default_folder(log: Path) -> Path:
    """``<stem>-report`` in the current folder; a compressed table loses both endings."""
    stem = log.resolve().name if log.is_dir() else log.name.removesuffix(".gz").rsplit(".", 1)[0]
    return Path(f"{stem or log.name}-report")


def _show_plan(terminal: Terminal, checked: _Checked, json: bool) -> None:
    """Show what a run would read and write."""
    from replay.mission import source_options
    from replay.readers.registry import summarise_log

    machine, source = checked.machine, checked.machine_source
    summaries = [(path, summarise_log(path, source_options(path, machine))) for path in checked.paths]
    found = [(path, s.format, (s.stop_ns - s.start_ns) * 1e-9) for path, s in summaries]
    written = [str(path) for path in checked.outputs]
    if json:
        read = [{"path": str(path), "format": form, "duration_s": seconds} for path, form, seconds in found]
        machine_part = {"name": machine.name, "source": source}
        terminal.show_json({"would_read": read, "machine": machine_part, "would_write": written})
        return
    from cli.tables.layout import key_values

    rows = [("read", f"{path}  ({form}, {seconds:.1f} s)") for path, form, seconds in found]
    rows += [("machine", f"{machine.name} ({source})"), *(("write", name) for name in written)]
    terminal.show(key_values(rows))
