"""`mfhca audit`: many missions, unattended."""

from __future__ import annotations

import os
import signal
from contextlib import suppress
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.terminal.command import command
from cli.terminal.console import Terminal
from cli.terminal.options import FailOn, Json, MachineFile, MaxSize
from replay.errors import ConfigError, LogError, OutputError
from replay.progress import Stage

if TYPE_CHECKING:
    from diagnosis.audit.discovery.discover import Discovery
    from diagnosis.audit.plan import Asked

EXAMPLES = """\b
Examples:
  mfhca audit logs/                                  # every mission below logs/, into mfhca-audit/
  mfhca audit logs/ -o night -m machine.toml -j 8    # again: only what is new or changed
  mfhca audit logs/ --dry-run
  mfhca audit s3://fleet/2026/ --dask tcp://scheduler:8786 --events events.jsonl
  find logs -name '*.bag' -mtime -1 | mfhca audit - --json | jq .counts"""

OUTPUT = Path("mfhca-audit")


class TrendAxis(StrEnum):
    """What trends are drawn over."""

    HOURS = "hours"
    DAYS = "days"


@command
def audit(
    terminal: Terminal,
    paths: Annotated[
        list[str],
        typer.Argument(metavar="PATH", help="Folders, logs, globs, URLs, or - for names on stdin.", show_default=False),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the store, the fleet page and the reports.")
    ] = OUTPUT,
    machine: MachineFile = None,
    machine_id: Annotated[
        str | None,
        typer.Option("--machine-id", metavar="ID", help="Machine that all missions belong to.", show_default=False),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            "-j",
            metavar="N",
            min=1,
            help="Missions at once on this machine. Default: one per processor.",
            show_default=False,
        ),
    ] = None,
    memory: Annotated[
        float | None,
        typer.Option(
            "--memory",
            metavar="MB",
            min=16,
            help="Memory of each mission. Default: 4096, or its part of what is free.",
            show_default=False,
        ),
    ] = None,
    timeout: Annotated[float, typer.Option("--timeout", metavar="S", min=0.1, help="Time of each mission.")] = 1800.0,
    cpu: Annotated[
        float | None,
        typer.Option(
            "--cpu", metavar="S", min=1, help="Processor time of each mission. Default: no limit.", show_default=False
        ),
    ] = None,
    retries: Annotated[
        int,
        typer.Option(
            "--retries", metavar="N", min=0, help="Further attempts at a mission that crashed or met a limit."
        ),
    ] = 1,
    fail_on: Annotated[
        FailOn,
        typer.Option(
            "--fail-on",
            help="Lowest severity that ends with code 1; with never, a log that could not be judged counts as 0 too.",
        ),
    ] = FailOn.LOW,
    resume: Annotated[
        bool, typer.Option("--resume/--no-resume", help="Leave what is done and unchanged, or audit all again.")
    ] = True,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="List the missions and their state, and stop.")] = False,
    json: Json = False,
    events: Annotated[
        str | None,
        typer.Option(
            "--events",
            metavar="FILE",
            help="Add a line of JSON per event to FILE; - for stdout.",
            show_default=False,
        ),
    ] = None,
    baseline: Annotated[
        Path | None,
        typer.Option(
            "--baseline", metavar="STORE", help="Store or folder of an audit to compare with.", show_default=False
        ),
    ] = None,
    trends: Annotated[
        TrendAxis, typer.Option("--trends", help="Trends over hours of driving or over days.")
    ] = TrendAxis.HOURS,
    export: Annotated[
        str | None,
        typer.Option("--export", metavar="FORMAT", help="Also write the store's tables: parquet.", show_default=False),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option("--dask", metavar="ADDRESS", help="Scheduler of a Dask cluster to run on.", show_default=False),
    ] = None,
    max_size: MaxSize = 15.0,
) -> None:
    """Diagnose a tree of logs: a report per mission and a page about the fleet."""
    _check(json, events, export, machine_id)
    _end_with_the_terminal()
    with terminal.progress(Stage.LOOKING_FOR_MISSIONS):
        from diagnosis.audit.discovery.discover import discover
        from diagnosis.audit.isolation.limits import Limits, usual_memory_mb
        from diagnosis.audit.plan import Asked, merged_machines

        found = discover(paths, exclude=output)
        count = jobs or _processors()
        limits = Limits(memory or (usual_memory_mb(count) if dask is None else Limits.memory_mb), timeout, cpu)
        asked = Asked(output, machine, machine_id or "", limits, retries, resume, max_size)
        found = replace(found, notes=(*found.notes, *merged_machines(found.missions, asked)))
    for problem in found.problems:
        terminal.error(problem)  # also when quiet: a disk may not be there
    for note in found.notes:
        terminal.note(note)
    if dry_run and found.missions:
        from diagnosis.audit.endings import NOT_READ

        _list(terminal, found, asked, json)
        if found.problems:
            raise typer.Exit(NOT_READ)
        return
    _run(terminal, found, asked, count, dask, events, json, baseline, trends, export, fail_on)


def _check(json: bool, events: str | None, export: str | None, machine_id: str | None) -> None:
    if json and events == "-":
        raise ConfigError("--json and --events -: both would write to stdout; give --events a file")
    if export not in (None, "parquet"):
        raise ConfigError(f"--export {export}: expected parquet")
    if machine_id is not None and not machine_id.strip():
        raise ConfigError("--machine-id: is empty; give a name or leave it out")


def _end_with_the_terminal() -> None:
    """Take a lost terminal as being asked to end, where SIGTERM is and the caller (nohup) does not ignore it."""
    ended = signal.getsignal(signal.SIGTERM)
    if hasattr(signal, "SIGHUP") and callable(ended) and signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:
        signal.signal(signal.SIGHUP, ended)


def _said(found: Discovery) -> list[str]:
    return [*found.problems, *found.notes]


def _processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _list(terminal: Terminal, found: Discovery, asked: Asked, json: bool) -> None:
    from diagnosis.audit.session import overview

    rows = overview(found, asked)
    if json:
        listed = [
            {"name": one.mission.name, "files": list(one.mission.files), "bytes": one.mission.bytes, "state": state}
            for one, state in rows
        ]
        terminal.show_json({"missions": listed, "problems": _said(found), "left_aside": found.left_aside})
        return
    from cli.tables.audit import plan_parts

    terminal.show(*plan_parts(rows, found))


def _run(
    terminal: Terminal,
    found: Discovery,
    asked: Asked,
    jobs: int,
    dask: str | None,
    events: str | None,
    json: bool,
    baseline: Path | None,
    trends: TrendAxis,
    export: str | None,
    fail_on: FailOn,
) -> None:
    from cli.tables.audit import document, summary_parts
    from cli.terminal.audit_progress import shown_progress
    from diagnosis.audit import engines
    from diagnosis.audit.endings import NOT_READ, exit_code
    from diagnosis.audit.events import EventFacts, EventLog
    from diagnosis.audit.session import Audited, audit

    log = EventLog(None if events == "-" else Path(events)) if events else None
    terminal.json |= events == "-"
    try:
        with shown_progress(terminal) as show:

            def tell(event: str, facts: EventFacts) -> None:
                show(event, facts)
                if log is not None and event != "tick":
                    log.write(event, facts)

            for text in (*found.problems, *found.notes):
                tell("problem", {"reason": text})
            if not found.missions:
                if json:
                    terminal.show_json(document(Audited((), 0, 0), found, asked.output, NOT_READ))
                raise LogError(f"no mission was found ({found.left_aside} other files were left aside)")
            engine = (lambda: engines.dask(dask)) if dask else (lambda: engines.local(jobs))
            store = baseline / "fleet.sqlite" if baseline is not None and baseline.is_dir() else baseline
            audited = audit(found, asked, engine, tell, baseline=store, axis=trends.value)
            if export:
                from diagnosis.audit.store.parquet import export as export_tables
                from diagnosis.audit.store.store import Store

                with Store.open(asked.output / "fleet.sqlite") as opened:
                    export_tables(opened, asked.output / "tables")
            code = max(exit_code(audited.ends, fail_on.value), NOT_READ if found.problems else 0)
            tell("end", {"code": code, "failed": audited.failed})
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            terminal.note("what is finished is kept; the same command again does the rest")
        if log is not None:
            with suppress(OutputError):
                log.write("stopped", {"reason": str(error) or "interrupted"})
        raise
    finally:
        if log is not None:
            log.close()
    if json:
        terminal.show_json(document(audited, found, asked.output, code))
    else:
        terminal.show(*summary_parts(audited, found, asked.output))
    if code:
        raise typer.Exit(code)
