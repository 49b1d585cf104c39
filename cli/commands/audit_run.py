"""A run of `mfhca audit`: find the missions, audit or list them, show what came of it."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cli.terminal.console import Terminal
from cli.terminal.options import FailOn
from replay.errors import ConfigError, LogError, OutputError
from replay.progress import Stage

if TYPE_CHECKING:
    from diagnosis.audit.discovery.discover import Discovery
    from diagnosis.audit.engines import Engine
    from diagnosis.audit.events import Emit, EventFacts
    from diagnosis.audit.plan import AuditOptions


@dataclass(frozen=True)
class AuditRequest:
    """What the command line asks for; names and defaults as there.

    Attributes
    ----------
    jobs : int or None
        Missions at once; None: one per processor.
    memory_mb, timeout_s, cpu_s : float or None
        Limits of each mission [MB], [s], [s].
    events : str or None
        File of events, ``-`` for stdout.
    baseline : Path or None
        Store, or folder of an audit.
    trends : {"hours", "days"}
        What trends are drawn over.
    """

    paths: list[str]
    output: Path
    machine: Path | None
    machine_id: str | None
    jobs: int | None
    memory_mb: float | None
    timeout_s: float
    cpu_s: float | None
    retries: int
    fail_on: FailOn
    resume: bool
    dry_run: bool
    json: bool
    events: str | None
    baseline: Path | None
    trends: Literal["hours", "days"]
    export: str | None
    dask: str | None
    max_size_mb: float

    @property
    def at_once(self) -> int:
        """Missions at once on this machine."""
        return self.jobs or _processors()

    def engine(self) -> Callable[[], AbstractContextManager[Engine]]:
        """What runs missions: processes of this machine, or a Dask cluster."""
        from diagnosis.audit import engines

        address = self.dask
        return (lambda: engines.dask(address)) if address else (lambda: engines.local(self.at_once))

    def check(self) -> None:
        """Raise a `ConfigError` where options do not go together."""
        if self.json and self.events == "-":
            raise ConfigError("--json and --events -: both would write to stdout; give --events a file")
        if self.export not in (None, "parquet"):
            raise ConfigError(f"--export {self.export}: expected parquet")
        if self.machine_id is not None and not self.machine_id.strip():
            raise ConfigError("--machine-id: is empty; give a name or leave it out")


def run_audit(terminal: Terminal, request: AuditRequest) -> int:
    """Audit, or list what would be audited; give the exit code."""
    request.check()
    _end_with_the_terminal()
    with terminal.progress(Stage.LOOKING_FOR_MISSIONS):
        found, asked = _found(request)
    for problem in found.problems:
        terminal.error(problem)  # also when quiet: a disk may not be there
    for note in found.notes:
        terminal.note(note)
    if request.dry_run and found.missions:
        from diagnosis.audit.endings import NOT_READ

        _list(terminal, found, asked, request.json)
        return NOT_READ if found.problems else 0
    return _audit(terminal, request, found, asked)


def _found(request: AuditRequest) -> tuple[Discovery, AuditOptions]:
    """Missions, and how each is to be diagnosed."""
    from diagnosis.audit.discovery.discover import discover
    from diagnosis.audit.isolation.limits import Limits, usual_memory_mb
    from diagnosis.audit.plan import AuditOptions, merged_machines

    found = discover(request.paths, exclude=request.output)
    memory = request.memory_mb or (usual_memory_mb(request.at_once) if request.dask is None else Limits.memory_mb)
    limits = Limits(memory, request.timeout_s, request.cpu_s)
    asked = AuditOptions(
        request.output,
        request.machine,
        request.machine_id or "",
        limits,
        request.retries,
        request.resume,
        request.max_size_mb,
    )
    return replace(found, notes=(*found.notes, *merged_machines(found.missions, asked))), asked


def _end_with_the_terminal() -> None:
    """Take a lost terminal as being asked to end, where SIGTERM is and the caller (nohup) does not ignore it."""
    ended = signal.getsignal(signal.SIGTERM)
    if hasattr(signal, "SIGHUP") and callable(ended) and signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:
        signal.signal(signal.SIGHUP, ended)


def _processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _list(terminal: Terminal, found: Discovery, asked: AuditOptions, json: bool) -> None:
    from diagnosis.audit.session import overview

    rows = overview(found, asked)
    if json:
        listed = [
            {"name": one.mission.name, "files": list(one.mission.files), "bytes": one.mission.bytes, "state": state}
            for one, state in rows
        ]
        problems = [*found.problems, *found.notes]
        terminal.show_json({"missions": listed, "problems": problems, "left_aside": found.left_aside})
        return
    from cli.tables.audit import plan_parts

    terminal.show(*plan_parts(rows, found))


def _audit(terminal: Terminal, request: AuditRequest, found: Discovery, asked: AuditOptions) -> int:
    from cli.tables.audit import document, summary_parts
    from diagnosis.audit.endings import NOT_READ, exit_code
    from diagnosis.audit.session import Audited, audit

    with _published(terminal, request) as emit:
        for text in (*found.problems, *found.notes):
            emit("problem", {"reason": text})
        if not found.missions:
            if request.json:
                terminal.show_json(document(Audited((), 0, 0), found, asked.output, NOT_READ))
            skipped = f" ({found.left_aside} files are not logs)" if found.left_aside else ""
            raise LogError(f"no mission was found{skipped}")
        baseline = request.baseline
        store = baseline / "fleet.sqlite" if baseline is not None and baseline.is_dir() else baseline
        audited = audit(found, asked, request.engine(), emit, baseline=store, axis=request.trends)
        if request.export:
            _export(asked.output)
        code = max(exit_code(audited.ends, request.fail_on.value), NOT_READ if found.problems else 0)
        emit("end", {"code": code, "failed": audited.failed})
    if request.json:
        terminal.show_json(document(audited, found, asked.output, code))
    else:
        terminal.show(*summary_parts(audited, found, asked.output))
    return code


@contextmanager
def _published(terminal: Terminal, request: AuditRequest) -> Iterator[Emit]:
    """Give the function that publishes events: on the terminal, and in the file of events where one is asked for."""
    from cli.terminal.audit_progress import shown_progress
    from diagnosis.audit.events import EventLog

    events = request.events
    log = EventLog(None if events == "-" else Path(events)) if events else None
    terminal.json |= events == "-"
    try:
        with shown_progress(terminal) as show:

            def emit(event: str, facts: EventFacts) -> None:
                show(event, facts)
                if log is not None and event != "tick":
                    log.write(event, facts)

            yield emit
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            terminal.note("finished missions are kept; run the same command again to continue")
        if log is not None:
            with suppress(OutputError):
                log.write("stopped", {"reason": str(error) or "interrupted"})
        raise
    finally:
        if log is not None:
            log.close()


def _export(output: Path) -> None:
    from diagnosis.audit.store.parquet import export
    from diagnosis.audit.store.store import Store

    with Store.open(output / "fleet.sqlite") as store:
        export(store, output / "tables")
