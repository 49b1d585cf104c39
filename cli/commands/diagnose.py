"""`mfhca diagnose`: one mission, its report and its verdict as exit code."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.commands.diagnose_run import DiagnoseRequest, run_diagnosis
from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.options import End, FailOn, Json, Logs, MachineFile, MaxSize, OpenPage, Previous, Start

EXAMPLES = """\b
Examples:
  mfhca diagnose mission.mcap
  mfhca diagnose drive.bag plc-export.csv -m machine.toml -o reports/monday
  mfhca diagnose mission.mcap --start 100 --end 160 --wheel FR --fail-on high
  mfhca diagnose mission.mcap --clips --open        # each fault cut out for Foxglove and PlotJuggler
  mfhca diagnose tuesday.mcap --previous monday-report   # what is new, resolved, changed
  mfhca diagnose mission.mcap --verify           # each fault once more by filterpy, reading by reading
  mfhca diagnose mission.mcap --json | jq .verdict"""

Output = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="DIR", help="Folder of the report. Default: <log>-report.")
]
Wheels = Annotated[
    list[str] | None,
    typer.Option("--wheel", "-w", metavar="W", help="Only this wheel; may be given again.", show_default=False),
]
FailOnOrUnjudged = Annotated[
    FailOn,
    typer.Option(
        "--fail-on",
        help="Lowest severity that ends with code 1; with never, a log that is not judged ends with 0 too.",
    ),
]
MachineId = Annotated[
    str | None,
    typer.Option(
        "--machine-id", metavar="ID", help="Id of the machine that the mission belongs to.", show_default=False
    ),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show what would be read and written, and stop.")]
Clips = Annotated[
    bool, typer.Option("--clips", help="Cut each fault of at least low severity into an MCAP file of its own.")
]
ClipMargin = Annotated[
    float,
    typer.Option("--clip-margin", metavar="S", min=0.0, max=3600.0, help="Time before and after each clip [s]."),
]
Verify = Annotated[
    bool, typer.Option("--verify", help="Check every fault by filterpy, stepped reading by reading (slow).")
]


def diagnose(
    context: typer.Context,
    logs: Logs,
    output: Output = None,
    machine: MachineFile = None,
    start: Start = None,
    end: End = None,
    wheel: Wheels = None,
    fail_on: FailOnOrUnjudged = FailOn.LOW,
    machine_id: MachineId = None,
    previous: Previous = None,
    json: Json = False,
    dry_run: DryRun = False,
    open_page: OpenPage = False,
    clips: Clips = False,
    clip_margin: ClipMargin = 5.0,
    max_size: MaxSize = 8.0,
    verify: Verify = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Diagnose one mission: report.html, report.json, and a verdict as exit code."""
    request = DiagnoseRequest(
        logs=logs,
        output=output,
        machine=machine,
        start_s=start,
        end_s=end,
        wheels=wheel,
        fail_on=fail_on,
        machine_id=machine_id,
        previous=previous,
        json=json,
        dry_run=dry_run,
        open_page=open_page,
        clips=clips,
        clip_margin_s=clip_margin,
        max_size_mb=max_size,
        verify=verify,
    )
    code = run_diagnosis(terminal_of(context, json=json), request)
    if code:
        raise typer.Exit(code)
