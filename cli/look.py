"""`mfhca inspect` and `mfhca channels`."""

from __future__ import annotations

import traceback
from typing import Annotated, Any

import typer

from cli.app import command
from cli.console import Terminal
from cli.inputs import find_logs, machine_of, mission_paths
from cli.options import Json, Logs, MachineFile

INSPECT_EXAMPLES = """\b
Examples:
  mfhca inspect mission.mcap
  mfhca inspect logs/ "archive/**/*.bag" --json
  find . -name "*.mcap" | mfhca inspect -"""
CHANNELS_EXAMPLES = """\b
Examples:
  mfhca channels mission.mcap
  mfhca channels drive.bag plc-export.csv -m machine.toml"""

_UNREADABLE, _INTERNAL = 3, 70


@command
def inspect(
    terminal: Terminal,
    paths: Annotated[
        list[str],
        typer.Argument(metavar="PATH...", help="Files, folders, globs; - reads paths from stdin.", show_default=False),
    ],
    machine: MachineFile = None,
    json: Json = False,
) -> None:
    """Show what logs hold: topics, types, counts, rates, gaps, clocks, damage."""
    from cli.listing import inspect_document, inspect_parts
    from replay.errors import MfhcaError
    from replay.inspect import inspect_log
    from replay.mission import source_options

    the_machine, _ = machine_of(machine)
    found = find_logs(paths)
    failures = list(found.missing)
    code = _UNREADABLE if failures else 0
    documents: list[dict[str, Any]] = []
    for line in found.missing:
        terminal.error(line)
    for path in found.paths:
        try:
            with terminal.progress(f"reading {path}"):
                seen = inspect_log(path, source_options(path, the_machine))
        except Exception as error:
            known = isinstance(error, MfhcaError)
            code = max(code, _UNREADABLE if known or isinstance(error, OSError) else _INTERNAL)
            failures.append(str(error) if known else f"{path}: {type(error).__name__}: {error}")
            if terminal.verbose and not known:
                traceback.print_exc()
            terminal.error(failures[-1])
            continue
        if json:
            documents.append(inspect_document(seen))
        else:
            terminal.show(*inspect_parts(seen), "")
    if found.left_aside:
        terminal.note(f"files in the folders that are no logs by their names: {found.left_aside}")
    if json:
        terminal.show_json({"logs": documents, "errors": failures})
    if code:
        raise typer.Exit(code)


@command
def channels(terminal: Terminal, logs: Logs, machine: MachineFile = None, json: Json = False) -> None:
    """Show where each signal was found, what is missing, and what that costs the diagnosis."""
    paths = mission_paths(logs)
    the_machine, source = machine_of(machine)
    with terminal.progress("starting") as progress:
        from cli.mapped import signals_document, signals_parts
        from replay.mission import read_signals

        files, signals = read_signals(paths, the_machine, progress=progress)
    if json:
        terminal.show_json(signals_document(files, signals, the_machine, source))
        return
    from cli.tables import bullets, section

    terminal.show(*signals_parts(signals, the_machine))
    damage = [line for file in files for line in file.summary.damage]
    if damage:
        terminal.show(section("Damage"), bullets(damage))
