"""`mfhca inspect` and `mfhca channels`."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.app import command
from cli.console import Terminal
from cli.inputs import find_logs, machine_of, mission_paths
from cli.options import Json, Logs, MachineFile

if TYPE_CHECKING:
    from replay.inspection import InspectReport

INSPECT_EXAMPLES = """\b
Examples:
  mfhca inspect mission.mcap                  # from the index, at once
  mfhca inspect mission.mcap --full           # reads everything
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
    full: Annotated[
        bool, typer.Option("--full", "-f", help="Read everything: gaps, jitter, clocks, checksums, channels, losses.")
    ] = False,
    machine: MachineFile = None,
    json: Json = False,
) -> None:
    """Show what logs hold: topics, types, counts, rates, damage; with --full gaps, jitter, clocks."""
    from cli.listing import damage_parts, inspect_document, inspect_parts, list_parts
    from replay.errors import MfhcaError

    found = find_logs(paths)
    failures = list(found.missing)
    code = _UNREADABLE if failures else 0
    seen: list[InspectReport] = []
    for line in found.missing:
        terminal.error(line)
    look = _looker(full, machine)
    for path in found.paths:
        try:
            with terminal.progress(f"reading {path}"):
                seen.append(look(path))
        except Exception as error:
            known = isinstance(error, MfhcaError)
            code = max(code, _UNREADABLE if known or isinstance(error, OSError) else _INTERNAL)
            failures.append(str(error) if known else f"{path}: {type(error).__name__}: {error}")
            if terminal.verbose and not known:
                traceback.print_exc()
            terminal.error(failures[-1])
            continue
        if json and seen[-1].damage:
            terminal.note(f"{path} is degraded: {seen[-1].damage[0]}")
        if not json and (terminal.verbose or len(found.paths) == 1):
            terminal.show(*inspect_parts(seen[-1]), "")
    if found.left_aside:
        terminal.note(f"files in the folders that are no logs by their names: {found.left_aside}")
    if json:
        terminal.show_json({"logs": [inspect_document(s) for s in seen], "errors": failures})
    elif len(found.paths) > 1:
        terminal.show(*list_parts(seen, failures))
        if not terminal.verbose:
            terminal.show(*(part for s in seen for part in damage_parts(s)))
            terminal.note("-v shows each log's topics" + ("" if full else ", --full reads everything"))
    if code:
        raise typer.Exit(code)


def _looker(full: bool, machine: Path | None) -> Callable[[Path], InspectReport]:
    """Give the function that inspects one log; what takes time to load is loaded when a log needs it."""
    the_machine = machine_of(machine)[0] if machine is not None or full else None

    def look(path: Path) -> InspectReport:
        from replay.inspect_mcap import mcap_index

        machine = the_machine
        clock = "header"
        if machine is not None:
            from replay.mission import source_options

            clock = source_options(path, machine).stamp
        quick = None if full else mcap_index(path, clock)
        if quick is not None:
            return quick
        from replay import inspect
        from replay.mission import source_options

        options = source_options(path, machine or machine_of(None)[0])
        return inspect.inspect_log(path, options) if full else inspect.inspect_index(path, options)

    return look


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
