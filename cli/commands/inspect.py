"""`mfhca inspect`: what logs hold."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.console import Terminal
from cli.terminal.inputs import FoundLogs, find_logs
from cli.terminal.options import Json, MachineFile
from diagnosis.api.inputs import machine_of
from replay.errors import MfhcaError
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

Paths = Annotated[
    list[str],
    typer.Argument(metavar="PATH...", help="Files, folders, globs, URLs; - reads them from stdin.", show_default=False),
]
Full = Annotated[
    bool, typer.Option("--full", "-f", help="Read everything: gaps, jitter, clocks, checksums, channels, losses.")
]


@dataclass(frozen=True)
class _Log:
    """One log to inspect: its name, and the function that does it."""

    name: str
    inspected: Callable[[], InspectReport]


@dataclass
class _Outcome:
    """Reports of the logs that could be read, why others could not, and the exit code."""

    reports: list[InspectReport] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    code: int = 0


def inspect(
    context: typer.Context,
    paths: Paths,
    full: Full = False,
    machine: MachineFile = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Show what logs hold: topics, types, counts, rates, damage; with --full gaps, jitter, clocks."""
    from cli.tables.inspection import inspect_document

    terminal = terminal_of(context, json=json)
    found = find_logs(paths, urls=True)
    outcome = _Outcome(failures=list(found.missing))
    look = _looker(full, machine)
    logs = [_Log(str(path), partial(look, path)) for path in found.paths]
    if found.urls:
        outcome.failures += _remote_logs(terminal, found, full, machine, look, logs)
    outcome.code = _UNREADABLE if outcome.failures else 0
    for line in outcome.failures:
        terminal.error(line)
    for log in logs:
        _inspect_one(terminal, log, outcome, alone=len(logs) == 1)
    if found.left_aside:
        terminal.note(f"{found.left_aside} files in the folders were skipped: their names are not those of logs")
    if json:
        terminal.show_json({"logs": [inspect_document(r) for r in outcome.reports], "errors": outcome.failures})
    elif len(logs) > 1:
        _show_list(terminal, outcome, full)
    if outcome.code:
        raise typer.Exit(outcome.code)


def _inspect_one(terminal: Terminal, log: _Log, outcome: _Outcome, *, alone: bool) -> None:
    """Inspect a log, and show it where it is the only one or all are asked for; an unreadable one costs no other."""
    from cli.tables.inspection import inspect_parts

    try:
        with terminal.progress(Stage.READING, log.name):
            report = log.inspected()
    except Exception as error:
        known = isinstance(error, MfhcaError)
        outcome.code = max(outcome.code, _UNREADABLE if known or isinstance(error, OSError) else _INTERNAL)
        outcome.failures.append(str(error) if known else f"{log.name}: {type(error).__name__}: {error}")
        if terminal.verbose and not known:
            traceback.print_exc()
        terminal.error(outcome.failures[-1])
        return
    outcome.reports.append(report)
    if terminal.json and report.damage:
        terminal.note(f"{log.name} is degraded: {report.damage[0]}")
    if not terminal.json and (terminal.verbose or alone):
        terminal.show(*inspect_parts(report), "")


def _show_list(terminal: Terminal, outcome: _Outcome, full: bool) -> None:
    from cli.tables.inspection import damage_parts, list_parts

    terminal.show(*list_parts(outcome.reports, outcome.failures))
    if not terminal.verbose:
        terminal.show(*(part for report in outcome.reports for part in damage_parts(report)))
        terminal.note("-v shows each log's topics" + ("" if full else ", --full reads everything"))


def _remote_logs(
    terminal: Terminal,
    found: FoundLogs,
    full: bool,
    machine: Path | None,
    look: Callable[[Path], InspectReport],
    logs: list[_Log],
) -> list[str]:
    """Add the logs behind URLs, and give why there is none behind some."""
    with terminal.progress(Stage.LOOKING_FOR_LOGS):
        from diagnosis.audit.discovery.inspect_remote import inspect_remotely, logs_at

        remote, problems, left_aside = logs_at(found.urls)
    found.left_aside += left_aside
    for log in remote:
        clock = None if full else _clock(Path(log.files[0]), machine_of(machine)[0] if machine is not None else None)
        logs.append(_Log(log.files[0], partial(inspect_remotely, log, look, clock)))
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
