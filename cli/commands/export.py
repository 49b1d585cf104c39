"""`mfhca export`: a diagnosis as one MCAP file for Foxglove, rerun and PlotJuggler."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.console import Terminal
from cli.terminal.options import Json, Logs, MachineFile
from diagnosis.api.inputs import check_output, machine_of, mission_paths
from diagnosis.api.saved_results import result_file, saved_report
from replay.errors import ConfigError, OutputError
from replay.progress import Progress, Stage

if TYPE_CHECKING:
    from diagnosis.clips.export import Exported
    from diagnosis.results.document import ReportDocument

EXAMPLES = """\b
Examples:
  mfhca export drive.mcap -o drive.result.mcap                  # open it together with drive.mcap
  mfhca export drive.mcap -o drive.result.mcap --result drive-report   # without diagnosing again
  mfhca export drive.mcap -o all.mcap --log --loop              # log, replayed loop and result in one file"""

Output = Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="MCAP file to write.", show_default=False)]
Diagnostics = Annotated[
    bool,
    typer.Option(
        "--diagnostics/--no-diagnostics",
        help="The state of every part over time (DiagnosticArray), fault events (Log), and layouts for both.",
    ),
]
Loop = Annotated[bool, typer.Option("--loop", help="The replayed loop too.")]
Log = Annotated[bool, typer.Option("--log", help="The messages of the log too, as they were written (MCAP logs).")]
Result = Annotated[
    Path | None,
    typer.Option(
        "--result",
        metavar="RESULT",
        help="Saved result of these logs (folder or report.json). Default: they are diagnosed.",
        show_default=False,
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace a file that something else wrote.")]


@dataclass(frozen=True)
class ExportRequest:
    """What the command line asks for; names and defaults as there."""

    paths: list[Path]
    output: Path
    diagnostics: bool
    loop: bool
    log: bool
    result: Path | None
    machine: Path | None
    force: bool
    json: bool


def export(
    context: typer.Context,
    logs: Logs,
    output: Output,
    diagnostics: Diagnostics = True,
    loop: Loop = False,
    log: Log = False,
    result: Result = None,
    machine: MachineFile = None,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write the diagnosis as ROS messages on the recorder's clock, to lie beside the log in Foxglove, rerun or PlotJuggler."""
    request = ExportRequest(mission_paths(logs), output, diagnostics, loop, log, result, machine, force, json)
    _check(request)
    _export(terminal_of(context, json=json), request)


def _check(request: ExportRequest) -> None:
    """Raise an error where the request cannot be done, before anything long begins."""
    output = request.output
    if not (request.diagnostics or request.loop or request.log):
        raise ConfigError("--no-diagnostics: nothing is left to write; add --loop or --log")
    if output.suffix.lower() != ".mcap":
        raise ConfigError(f"{output}: the file is MCAP; give it a name that ends in .mcap")
    for path in request.paths:
        if saved_report(path) is not None:
            raise ConfigError(
                f"{path}: is a saved result, and its messages are written beside the log: "
                f"mfhca export LOG -o {output} --result {path}"
            )
    check_output([output], request.paths)
    if output.is_file() and output.stat().st_size and not request.force:
        from diagnosis.clips.export import is_own

        if not is_own(output):
            raise OutputError(f"{output}: exists, and no export wrote it; give another name, or --force to replace it")


def _export(terminal: Terminal, request: ExportRequest) -> None:
    machine, source = machine_of(request.machine)
    saved = None if request.result is None else result_file(request.result)
    with terminal.progress(Stage.STARTING) as progress:
        from diagnosis.clips.export import Contents, check_same_mission, write_export
        from diagnosis.output import load_report
        from diagnosis.pipeline import diagnose_mission
        from replay.mission import load_mission

        report = None if saved is None else load_report(saved)
        mission = load_mission(request.paths, machine, progress=progress)
        if report is None:
            report = diagnose_mission(mission, machine, machine_source=source, progress=progress).report
        else:
            check_same_mission(report, mission, str(request.result))
        progress(Progress(Stage.WRITING, request.output.name))
        contents = Contents(request.diagnostics, request.loop, request.log)
        written = write_export(request.output, mission, report, machine, contents)
    _show(terminal, request, report, written)


def _show(terminal: Terminal, request: ExportRequest, report: ReportDocument, written: Exported) -> None:
    if request.json:
        terminal.show_json(
            {
                "written": [str(path) for path in written.paths],
                "messages": written.messages,
                "verdict": report["verdict"]["status"],
                "faults": len(report["intervals"]),
                "notes": list(written.notes),
            }
        )
        return
    from cli.tables.layout import text

    for note in written.notes:
        terminal.note(note)
    terminal.show(text(f"Wrote {written.paths[0]}: {written.messages} messages"))
    if written.paths[1:]:
        names = ", ".join(path.name for path in written.paths[1:])
        terminal.show(text(f"Layouts for Foxglove and PlotJuggler: {names}"))
