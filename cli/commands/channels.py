"""`mfhca channels`: how the signals of a machine are found in its logs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.options import Json, Logs, MachineFile
from diagnosis.api.inputs import machine_of, mission_paths
from replay.progress import Stage

if TYPE_CHECKING:
    from cli.terminal.console import Terminal
    from replay.machine.config import Machine

NAMES = "names in the log"  # where wheels come from without a machine file
_OF_THE_PAPERS = re.compile(
    r"^(wheel\..*\.(u|u_applied|v_true|psi)|steer\..*)$", re.MULTILINE
)  # what ordinary robots have none of

EXAMPLES = """\b
Examples:
  mfhca channels mission.mcap
  mfhca channels drive.bag plc-export.csv -m machine.toml
  mfhca channels mission.mcap --all      # every topic.field, symbol or column"""


def channels(
    context: typer.Context,
    logs: Logs,
    machine: MachineFile = None,
    every: Annotated[
        bool, typer.Option("--all", help="List every channel of the logs: rate, range, unit, and what it could be.")
    ] = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Show where each signal was found, what is missing, and what the diagnosis cannot do without it."""
    terminal = terminal_of(context, json=json)
    paths = mission_paths(logs)
    if every:
        _show_all(terminal, paths, machine, json)
        return
    the_machine, source = machine_of(machine)
    with terminal.progress(Stage.STARTING) as progress:
        from cli.tables.signals import signals_document, signals_parts
        from replay.mission import read_signals

        files, signals = read_signals(paths, the_machine, progress=progress)
        if machine is None and not _OF_THE_PAPERS.search("\n".join(signals.items)):
            named = _named_in(paths)
            if named is not None:
                the_machine, source = named, NAMES
                files, signals = read_signals(paths, the_machine, progress=progress)
    if json:
        terminal.show_json(signals_document(files, signals, the_machine, source))
        return
    from cli.tables.layout import bullets, section

    terminal.show(*signals_parts(signals, the_machine, given=machine is not None))
    damage = [line for file in files for line in file.summary.damage]
    if damage:
        terminal.show(section("Damage"), bullets(damage))


def _named_in(paths: list[Path]) -> Machine | None:
    """A machine with the wheels that the names in a log tell; None where they tell none."""
    from replay.errors import LogError
    from replay.setup.draft import structure_of
    from replay.setup.read import read_everything

    try:
        return structure_of(read_everything(paths, every=False)).machine()
    except LogError:
        return None


def _show_all(terminal: Terminal, paths: list[Path], machine: Path | None, json: bool) -> None:
    """Every channel, and which signals of the machine it could be; without a machine file, of one with the wheels found."""
    with terminal.progress(Stage.STARTING) as progress:
        from cli.tables.all_channels import channels_document, channels_parts
        from cli.terminal.streams import console_of
        from replay.errors import LogError
        from replay.machine.config import haulotte
        from replay.setup.all_channels import channel_rows
        from replay.setup.draft import structure_of
        from replay.setup.read import read_everything

        given, source = machine_of(machine) if machine is not None else (None, NAMES)
        logs = read_everything(paths, given, progress=progress)
        try:
            the_machine = given or structure_of(logs).machine()
        except LogError:
            the_machine = None
        rows = channel_rows(logs, the_machine or haulotte())
    if json:
        terminal.show_json(channels_document(rows, the_machine, source))
        return
    import sys

    terminal.show(*channels_parts(rows, the_machine, console_of(sys.stdout).width))
