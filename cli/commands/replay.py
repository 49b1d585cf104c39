"""`mfhca replay`: the replayed loop as a file, or the log as it was recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.terminal.command import command
from cli.terminal.console import Terminal
from cli.terminal.inputs import check_output, check_times, machine_of, mission_paths
from cli.terminal.options import End, Json, Logs, MachineFile, Start
from replay.errors import ConfigError
from replay.progress import Progress, Stage

EXAMPLES = """\b
Examples:
  mfhca replay mission.mcap -o loop.parquet
  mfhca replay mission.bag -o loop.mcap     # for Foxglove or PlotJuggler
  mfhca replay mission.mcap -o part.csv --start 100 --end 110
  mfhca replay mission.mcap --raw -o recorded   # every topic as Parquet"""


@command
def replay(
    terminal: Terminal,
    logs: Logs,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FILE", help=".parquet, .csv or .mcap; with --raw a folder.", show_default=False
        ),
    ],
    raw: Annotated[
        bool, typer.Option("--raw", help="Convert the log itself: all its numbers at their own stamps, no replay.")
    ] = False,
    machine: MachineFile = None,
    start: Start = None,
    end: End = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that something else wrote.")] = False,
    json: Json = False,
) -> None:
    """Replay the control loop: v_c, e, ρ, Ψ̂ printed and implied, u_a and u_s, to Parquet, CSV or MCAP; or the log as recorded."""
    paths = mission_paths(logs)
    check_times(start, end)
    check_output([output], paths)
    if raw:
        _convert(terminal, paths, output, machine, (start, end), force, json)
        return
    the_machine, source = machine_of(machine)
    with terminal.progress(Stage.STARTING) as progress:
        from replay.control.loop import replay_loop
        from replay.export.replay_log import format_of, refuse_foreign_file, write_replay
        from replay.mission import load_mission

        kind = format_of(output)
        if not force:
            refuse_foreign_file(output)
        mission = load_mission(paths, the_machine, start_s=start, stop_s=end, progress=progress)
        progress(Progress(Stage.REPLAYING_LOOP))
        replayed = replay_loop(mission.timeline, the_machine)
        progress(Progress(Stage.WRITING, output.name))
        written = write_replay(output, mission.timeline, replayed, the_machine, kind)
    timeline = mission.timeline
    if json:
        terminal.show_json(
            {
                "output": str(output),
                "format": kind,
                "machine": {"name": the_machine.name, "source": source},
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


def _convert(
    terminal: Terminal,
    paths: list[Path],
    folder: Path,
    machine: Path | None,
    part: tuple[float | None, float | None],
    force: bool,
    json: bool,
) -> None:
    """Write a log as recorded, and say what stands where."""
    if len(paths) > 1:
        raise ConfigError(f"--raw converts one log at a time; {len(paths)} were given")
    the_machine, _ = machine_of(machine)
    with terminal.progress(Stage.STARTING) as progress:
        from replay.export.raw_log import write_raw
        from replay.mission import source_options

        options = source_options(paths[0], the_machine)
        start, stop = part
        index = write_raw(paths[0], folder, options, start_s=start, stop_s=stop, force=force, progress=progress)
    if json:
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
