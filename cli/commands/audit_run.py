"""A run of `mfhca audit`: find the missions, audit or list them, show what came of it."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cli.terminal.console import Terminal
from cli.terminal.options import FailOn
from diagnosis.api.audit_request import AuditRequest as ApiRequest
from replay.errors import ConfigError, OutputError
from replay.progress import Stage

if TYPE_CHECKING:
    from diagnosis.audit.discovery.discover import Discovery
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

    def asked(self) -> ApiRequest:
        """What is asked of the audit itself, whoever shows it."""
        return ApiRequest(
            tuple(self.paths), self.output, self.machine, self.machine_id, self.jobs, self.memory_mb, self.timeout_s,
            self.cpu_s, self.retries, self.resume, self.dask, self.max_size_mb,
        )  # fmt: skip

    def check(self) -> None:
        """Raise a `ConfigError` where options do not go together."""
        if self.json and self.events == "-":
            raise ConfigError("--json and --events -: both would write to stdout; give --events a file")
        if self.export not in (None, "parquet"):
            raise ConfigError(f"--export {self.export}: expected parquet")
        self.asked().check()


def run_audit(terminal: Terminal, request: AuditRequest) -> int:
    """Audit, or list what would be audited; give the exit code."""
    request.check()
    _end_with_the_terminal()
    with terminal.progress(Stage.LOOKING_FOR_MISSIONS):
        found, asked = request.asked().found()
    for problem in found.problems:
        terminal.error(problem)  # also when quiet: a disk may not be there
    for note in found.notes:
        terminal.note(note)
    if request.dry_run and found.missions:
        from diagnosis.audit.endings import NOT_READ

        _list(terminal, found, asked, request.json)
        return NOT_READ if found.problems else 0
    return _audit(terminal, request, found, asked)


def _end_with_the_terminal() -> None:
    """Take a lost terminal as being asked to end, where SIGTERM is and the caller (nohup) does not ignore it."""
    ended = signal.getsignal(signal.SIGTERM)
    if hasattr(signal, "SIGHUP") and callable(ended) and signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:
        signal.signal(signal.SIGHUP, ended)


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
    from diagnosis.api.auditing import run
    from diagnosis.audit.endings import NOT_READ
    from diagnosis.audit.session import Audited

    with _published(terminal, request) as emit:
        if not found.missions and request.json:
            terminal.show_json(document(Audited((), 0, 0), found, asked.output, NOT_READ))
        baseline = request.baseline
        store = baseline / "fleet.sqlite" if baseline is not None and baseline.is_dir() else baseline
        done = run(request.asked(), found, asked, emit, store, request.trends)
        if request.export:
            _export(asked.output)
        code = done.exit_code(request.fail_on.value)
        emit("end", {"code": code, "failed": done.failed})
    audited = Audited(done.ends, done.skipped, done.failed, done.gone, done.machines)
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
