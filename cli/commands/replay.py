"""`mfhca replay`: the replayed loop as a file, or the log as it was recorded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.console import Terminal
from cli.terminal.options import End, Json, Logs, MachineFile, Start
from diagnosis.api.inputs import check_output, check_times, machine_of, mission_paths
from replay.errors import ConfigError
from replay.progress import Progress, Stage

EXAMPLES = """\b
Examples:
  mfhca replay mission.mcap -o loop.parquet
  mfhca replay mission.bag -o loop.mcap     # for Foxglove or PlotJuggler
  mfhca replay mission.mcap -o part.csv --start 100 --end 110
  mfhca replay mission.mcap --raw -o recorded   # every topic as Parquet"""


Output = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="FILE", help=".parquet, .csv or .mcap; with --raw a folder.", show_default=False
    ),
]
Raw = Annotated[
    bool,
    typer.Option("--raw", help="Convert the log itself: all its numbers and texts at their own stamps, no replay."),
]
Force = Annotated[bool, typer.Option("--force", help="Replace files that something else wrote.")]


@dataclass(frozen=True)
class ReplayRequest:
    """What the command line asks for, once checked; names and defaults as there."""

    paths: list[Path]
    output: Path
    machine: Path | None
    start_s: float | None
    end_s: float | None
    force: bool
    json: bool


def replay_log(
    context: typer.Context,
    logs: Logs,
    output: Output,
    raw: Raw = False,
    machine: MachineFile = None,
    start: Start = None,
    end: End = None,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Replay the control loop: v_c, e, ρ, Ψ̂ printed and implied, u_a and u_s, or export the log as recorded."""
    terminal = terminal_of(context, json=json)
    request = ReplayRequest(mission_paths(logs), output, machine, start, end, force, json)
    check_times(start, end)
    check_output([output], request.paths)
    if raw:
        _convert(terminal, request)
    else:
        _replay(terminal, request)


def _replay(terminal: Terminal, request: ReplayRequest) -> None:
    """Write the replayed loop, and say how the paper's equations were read."""
    output = request.output
    machine, source = machine_of(request.machine)
    with terminal.progress(Stage.STARTING) as progress:
        from replay.control.loop import replay_loop
        from replay.export.replay_log import format_of, refuse_foreign_file, write_replay
        from replay.mission import load_mission

        kind = format_of(output)
        if not request.force:
            refuse_foreign_file(output)
        mission = load_mission(request.paths, machine, start_s=request.start_s, stop_s=request.end_s, progress=progress)
        progress(Progress(Stage.REPLAYING_LOOP))
        replayed = replay_loop(mission.timeline, machine)
        progress(Progress(Stage.WRITING, output.name))
        written = write_replay(output, mission.timeline, replayed, machine, kind)
    timeline = mission.timeline
    if request.json:
        terminal.show_json(
            {
                "output": str(output),
                "format": kind,
                "machine": {"name": machine.name, "source": source},
                "start_ns": timeline.start_ns,
                "step_ns": timeline.step_ns,
                "steps": timeline.size,
                "written": list(written),
                "readings": [{"name": r.name, "value": r.value, "detail": r.detail} for r in replayed.readings],
            }
        )
        return
    from rich.text import Text

    from cli.tables.layout import key_values, section, text

    rows = [(r.name, Text.assemble(text(r.value), "\n", text(r.detail, "dim"))) for r in replayed.readings]
    what = "topics" if kind == "mcap" else "columns"
    terminal.show(
        section("How the paper's equations were read"),
        key_values(rows),
        "",
        text(f"Wrote {output}: {len(written)} {what}, {timeline.size} steps of {timeline.dt * 1e3:g} ms"),
    )


def _convert(terminal: Terminal, request: ReplayRequest) -> None:
    """Write a log as recorded, and say what stands where."""
    paths, folder = request.paths, request.output
    if len(paths) > 1:
        raise ConfigError(f"--raw converts one log at a time; {len(paths)} were given")
    machine, _ = machine_of(request.machine)
    with terminal.progress(Stage.STARTING) as progress:
        from replay.export.raw_log import write_raw
        from replay.mission import source_options

        index = write_raw(
            paths[0],
            folder,
            source_options(paths[0], machine),
            start_s=request.start_s,
            stop_s=request.end_s,
            force=request.force,
            progress=progress,
        )
    if request.json:
        terminal.show_json({"output": str(folder), "format": "raw", **index})
        return
    from cli.tables.layout import bullets, section, table, text

    rows = [(f["file"], text(f["type"], "dim"), f["rows"], len(f["columns"])) for f in index["files"]]
    terminal.show(table(("file", "type", "rows", "columns"), rows, right=(2, 3)))
    if index["notes"]:
        terminal.show(section("Notes"), bullets(index["notes"]))
    if index["damage"]:
        terminal.show("", text("degraded: the log is damaged; what is left was written", "bold red"))
        terminal.show(bullets(index["damage"], "red"))
    terminal.show("", text(f"Wrote {folder}: {len(rows)} Parquet files and index.json"))
