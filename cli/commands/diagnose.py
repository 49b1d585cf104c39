"""`mfhca diagnose` and `mfhca report`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.commands.saved_results import result_file
from cli.tables.clips import FOLDER, show_clips
from cli.terminal.browser import open_page as show_page
from cli.terminal.command import command
from cli.terminal.console import Terminal
from cli.terminal.inputs import check_output, check_times, check_wheels, machine_of, mission_paths
from cli.terminal.options import End, FailOn, Json, Logs, MachineFile, MaxSize, Start
from replay.progress import Progress, Stage

if TYPE_CHECKING:
    from diagnosis.results.document import MachineIdentity, ReportDocument

DIAGNOSE_EXAMPLES = """\b
Examples:
  mfhca diagnose mission.mcap
  mfhca diagnose drive.bag plc-export.csv -m machine.toml -o reports/monday
  mfhca diagnose mission.mcap --start 100 --end 160 --wheel FR --fail-on high
  mfhca diagnose mission.mcap --clips --open        # each fault cut out for Foxglove and PlotJuggler
  mfhca diagnose tuesday.mcap --previous monday-report   # what is new, resolved, changed
  mfhca diagnose mission.mcap --json | jq .verdict"""
REPORT_EXAMPLES = """\b
Examples:
  mfhca report mission-report
  mfhca report tuesday-report --previous monday-report
  mfhca report mission-report/report.json --max-size 5"""

_FAULTS, _NOT_JUDGED = 1, 3
Previous = Annotated[
    Path | None,
    typer.Option(
        "--previous",
        metavar="RESULT",
        help="Earlier result of the same machine (folder or report.json) to compare with.",
        show_default=False,
    ),
]
_OUTPUTS = ("report.html", "report.json", "report.parquet")


@command
def diagnose(
    terminal: Terminal,
    logs: Logs,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Folder of the report. Default: <log>-report."),
    ] = None,
    machine: MachineFile = None,
    start: Start = None,
    end: End = None,
    wheel: Annotated[
        list[str] | None,
        typer.Option("--wheel", "-w", metavar="W", help="Only this wheel; may be given again.", show_default=False),
    ] = None,
    fail_on: Annotated[
        FailOn,
        typer.Option(
            "--fail-on",
            help="Lowest severity that ends with code 1; with never, a log that could not be judged ends with 0 too.",
        ),
    ] = FailOn.LOW,
    machine_id: Annotated[
        str | None,
        typer.Option("--machine-id", metavar="ID", help="Machine that the mission belongs to.", show_default=False),
    ] = None,
    previous: Previous = None,
    json: Json = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be read and written, and stop.")] = False,
    open_page: Annotated[bool, typer.Option("--open", help="Open the report in the browser.")] = False,
    clips: Annotated[
        bool, typer.Option("--clips", help="Cut each fault of at least low severity into an MCAP file of its own.")
    ] = False,
    clip_margin: Annotated[
        float,
        typer.Option("--clip-margin", metavar="S", min=0.0, max=3600.0, help="Time before and behind each clip [s]."),
    ] = 5.0,
    max_size: MaxSize = 15.0,
) -> None:
    """Diagnose one mission: report.html, report.json, and a verdict as exit code."""
    paths = mission_paths(logs)
    check_times(start, end)
    the_machine, source = machine_of(machine)
    wheels = check_wheels(wheel, the_machine)
    folder = output if output is not None else _default_folder(paths[0])
    outputs = [folder / name for name in (*_OUTPUTS, *((FOLDER,) if clips else ()))]
    check_output(outputs, paths)
    other = _previous(previous)
    if previous is not None and other is not None:
        from diagnosis.comparison.previous import require_same_machine

        identity: MachineIdentity = {"id": machine_id or the_machine.id, "wheels": list(the_machine.wheels)}
        require_same_machine(identity, other, str(previous))
    if dry_run:
        _plan(terminal, paths, the_machine, source, outputs, json)
        return
    from cli.terminal.progress import diagnosis_plan

    plan = diagnosis_plan(paths, wheels or the_machine.wheels, the_machine.axles)
    with terminal.progress(Stage.STARTING, plan=plan) as progress:
        from diagnosis import pipeline
        from diagnosis.output import write_result

        judged: dict[str, Any] = {"machine_source": source, "wheels": wheels, "machine_id": machine_id}
        judged["progress"] = progress
        mission = None
        if clips:  # cut from the same mission
            from replay.mission import load_mission

            mission = load_mission(paths, the_machine, start_s=start, stop_s=end, progress=progress)
            result = pipeline.diagnose_mission(mission, the_machine, **judged)
        else:
            result = pipeline.diagnose(paths, the_machine, start_s=start, stop_s=end, **judged)
        if other is not None:
            from diagnosis.comparison.previous import with_previous

            result = replace(result, report=with_previous(result.report, other, str(previous)))
        progress(Progress(Stage.WRITING_REPORT))
        written = write_result(result, folder, max_size_mb=max_size)
    page = next((p for p in written if p.name == "report.html"), written[0])
    if json:
        terminal.show_json(dict(result.report))
    else:
        from cli.tables.verdict import verdict_parts

        terminal.show(*verdict_parts(result.report))
    terminal.show(f"Report: {page}")
    if mission is not None:
        with terminal.progress(Stage.CUTTING_CLIPS) as progress:
            from diagnosis.clips.write import write_clips

            cut = write_clips(mission, result, the_machine, folder / FOLDER, margin_s=clip_margin, progress=progress)
        show_clips(terminal, cut, folder / FOLDER)
    if open_page:
        show_page(terminal, page)
    if _reaches(result.report, fail_on):
        raise typer.Exit(_FAULTS)
    if fail_on is not FailOn.NEVER and result.report["verdict"]["status"] == "not_assessed":
        raise typer.Exit(_NOT_JUDGED)


@command
def report(
    terminal: Terminal,
    result: Annotated[
        Path, typer.Argument(metavar="RESULT", help="Folder of a report, or its report.json.", show_default=False)
    ],
    previous: Previous = None,
    max_size: MaxSize = 15.0,
    open_page: Annotated[bool, typer.Option("--open", help="Open the report in the browser.")] = False,
) -> None:
    """Write report.html again from a saved result; the log is not needed."""
    mission_paths([result])
    other = _previous(previous)
    with terminal.progress(Stage.WRITING_REPORT):
        from diagnosis.output import rebuild

        known = None if previous is None or other is None else (previous, other)
        page = rebuild(result, max_size_mb=max_size, previous=known)
    terminal.show(f"Report: {page}")
    if open_page:
        show_page(terminal, page)


def _previous(path: Path | None) -> ReportDocument | None:
    """Document of the result to compare with.

    Raises
    ------
    LogError
        Where it is no result.
    """
    if path is None:
        return None
    from diagnosis.output import load_report

    return load_report(result_file(path))


def _default_folder(log: Path) -> Path:
    """``<stem>-report`` in the current folder; a compressed table loses both endings."""
    stem = log.resolve().name if log.is_dir() else log.name.removesuffix(".gz").rsplit(".", 1)[0]
    return Path(f"{stem or log.name}-report")


def _reaches(report: Any, fail_on: FailOn) -> bool:
    """Whether an interval is at least as severe as asked."""
    order = list(FailOn)
    return fail_on is not FailOn.NEVER and any(
        order.index(FailOn(i["severity"])) >= order.index(fail_on) for i in report["intervals"]
    )


def _plan(terminal: Terminal, paths: list[Path], machine: Any, source: str, outputs: list[Path], json: bool) -> None:
    """Show what a run would read and write."""
    from replay.mission import source_options
    from replay.readers.registry import summarise_log

    found = []
    for path in paths:
        summary = summarise_log(path, source_options(path, machine))
        found.append(
            {"path": str(path), "format": summary.format, "duration_s": (summary.stop_ns - summary.start_ns) * 1e-9}
        )
    written = [str(path) for path in outputs]
    if json:
        machine_part = {"name": machine.name, "source": source}
        terminal.show_json({"would_read": found, "machine": machine_part, "would_write": written})
        return
    from cli.tables.layout import key_values

    rows = [("read", f"{f['path']}  ({f['format']}, {f['duration_s']:.1f} s)") for f in found]
    rows += [("machine", f"{machine.name} ({source})"), *(("write", name) for name in written)]
    terminal.show(key_values(rows))
