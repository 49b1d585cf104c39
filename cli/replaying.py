"""`mfhca replay`: the replayed loop as a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.app import command
from cli.console import Terminal
from cli.inputs import check_output, check_times, machine_of, mission_paths
from cli.options import End, Json, Logs, MachineFile, Start

EXAMPLES = """\b
Examples:
  mfhca replay mission.mcap -o loop.parquet
  mfhca replay mission.bag -o loop.mcap     # open beside the log in Foxglove or PlotJuggler
  mfhca replay mission.mcap -o part.csv --start 100 --end 110"""


@command
def replay(
    terminal: Terminal,
    logs: Logs,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help=".parquet, .csv or .mcap", show_default=False)
    ],
    machine: MachineFile = None,
    start: Start = None,
    end: End = None,
    json: Json = False,
) -> None:
    """Replay the control loop: v_c, e, ρ, Ψ̂ printed and implied, u_a and u_s, to Parquet, CSV or MCAP."""
    paths = mission_paths(logs)
    check_times(start, end)
    check_output([output], paths)
    the_machine, source = machine_of(machine)
    with terminal.progress("starting") as progress:
        from replay.export.replay_log import format_of, write_replay
        from replay.loop import replay_loop
        from replay.mission import load_mission

        kind = format_of(output)
        mission = load_mission(paths, the_machine, start_s=start, stop_s=end, progress=progress)
        progress("replaying the loop")
        replayed = replay_loop(mission.timeline, the_machine)
        progress(f"writing {output.name}")
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

    from cli.tables import key_values, section, text

    rows = [(r.name, Text.assemble(text(r.value), "\n", text(r.detail, "dim"))) for r in replayed.readings]
    what = "topics" if kind == "mcap" else "columns"
    terminal.show(
        section("How the paper's equations were read"),
        key_values(rows),
        "",
        text(f"Wrote {output}: {len(written)} {what}, {timeline.size} steps of {timeline.dt * 1e3:g} ms"),
    )
