"""`mfhca channels`: how the signals of a machine are found in its logs."""

from __future__ import annotations

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.inputs import machine_of, mission_paths
from cli.terminal.options import Json, Logs, MachineFile
from replay.progress import Stage

EXAMPLES = """\b
Examples:
  mfhca channels mission.mcap
  mfhca channels drive.bag plc-export.csv -m machine.toml"""


def channels(
    context: typer.Context,
    logs: Logs,
    machine: MachineFile = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Show where each signal was found, what is missing, and what the diagnosis cannot do without it."""
    terminal = terminal_of(context, json=json)
    paths = mission_paths(logs)
    the_machine, source = machine_of(machine)
    with terminal.progress(Stage.STARTING) as progress:
        from cli.tables.signals import signals_document, signals_parts
        from replay.mission import read_signals

        files, signals = read_signals(paths, the_machine, progress=progress)
    if json:
        terminal.show_json(signals_document(files, signals, the_machine, source))
        return
    from cli.tables.layout import bullets, section

    terminal.show(*signals_parts(signals, the_machine))
    damage = [line for file in files for line in file.summary.damage]
    if damage:
        terminal.show(section("Damage"), bullets(damage))
