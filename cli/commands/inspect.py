"""`mfhca inspect` and `mfhca channels`."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.terminal.console import Terminal
from cli.terminal.inputs import FoundLogs, find_logs, machine_of
from cli.terminal.options import Json, MachineFile
from replay.progress import Stage

if TYPE_CHECKING:
    from replay.inspection.report import InspectReport
    from replay.machine.config import Machine

EXAMPLES = """\b
Examples:
  mfhca inspect mission.mcap                  # from the index, at once
  mfhca inspect mission.mcap --full           # reads everything
  mfhca inspect logs/ "archive/**/*.bag" --json
  mfhca inspect s3://fleet/2026/              # of MCAP files by a few small requests
  find . -name "*.mcap" | mfhca inspect -"""
_UNREADABLE, _INTERNAL = 3, 70


def inspect(
    terminal: Terminal,
    paths: Annotated[
        list[str],
        typer.Argument(
            metavar="PATH...", help="Files, folders, globs, URLs; - reads them from stdin.", show_default=False
        ),
    ],
    full: Annotated[
        bool, typer.Option("--full", "-f", help="Read everything: gaps, jitter, clocks, checksums, channels, losses.")
    ] = False,
    machine: MachineFile = None,
    json: Json = False,
) -> None:
    """Show what logs hold: topics, types, counts, rates, damage; with --full gaps, jitter, clocks."""
    from cli.tables.inspection import damage_parts, inspect_document, inspect_parts, list_parts
    from replay.errors import MfhcaError

    found = find_logs(paths, urls=True)
    failures = list(found.missing)
    look = _looker(full, machine)
    logs: list[tuple[str, Callable[[], InspectReport]]] = [(str(path), partial(look, path)) for path in found.paths]
    if found.urls:
        failures += _remote_logs(terminal, found, full, machine, look, logs)
    code = _UNREADABLE if failures else 0
    seen: list[InspectReport] = []
    for line in failures:
        terminal.error(line)
    for path, looked in logs:
        try:
            with terminal.progress(Stage.READING, path):
                seen.append(looked())
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
        if not json and (terminal.verbose or len(logs) == 1):
            terminal.show(*inspect_parts(seen[-1]), "")
    if found.left_aside:
        terminal.note(f"files in the folders that are no logs by their names: {found.left_aside}")
    if json:
        terminal.show_json({"logs": [inspect_document(s) for s in seen], "errors": failures})
    elif len(logs) > 1:
        terminal.show(*list_parts(seen, failures))
        if not terminal.verbose:
            terminal.show(*(part for s in seen for part in damage_parts(s)))
            terminal.note("-v shows each log's topics" + ("" if full else ", --full reads everything"))
    if code:
        raise typer.Exit(code)


def _remote_logs(
    terminal: Terminal,
    found: FoundLogs,
    full: bool,
    machine: Path | None,
    look: Callable[[Path], InspectReport],
    logs: list[tuple[str, Callable[[], InspectReport]]],
) -> list[str]:
    """Add the logs behind URLs, and give why there is none behind some."""
    with terminal.progress(Stage.LOOKING_FOR_LOGS):
        from diagnosis.audit.discovery.inspect_remote import inspect_remotely, logs_at

        remote, problems, left_aside = logs_at(found.urls)
    found.left_aside += left_aside
    for log in remote:
        clock = None if full else _clock(Path(log.files[0]), machine_of(machine)[0] if machine is not None else None)
        logs.append((log.files[0], partial(inspect_remotely, log, look, clock)))
    return problems


def _clock(path: Path, machine: Machine | None) -> str:
    if machine is None:
        return "header"
    from replay.mission import source_options

    return source_options(path, machine).stamp


def _looker(full: bool, machine: Path | None) -> Callable[[Path], InspectReport]:
    """Give the function that inspects one log; what takes time to load is loaded when a log needs it."""
    the_machine = machine_of(machine)[0] if machine is not None or full else None

    def look(path: Path) -> InspectReport:
        from replay.inspection.mcap_index import mcap_index

        quick = None if full else mcap_index(path, _clock(path, the_machine))
        if quick is not None:
            return quick
        from replay.inspection import inspect_log
        from replay.mission import source_options

        options = source_options(path, the_machine or machine_of(None)[0])
        return inspect_log.inspect_log(path, options) if full else inspect_log.inspect_index(path, options)

    return look
