"""A whole audit: what is there, what is done, the rest, and the fleet page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from diagnosis.audit.copies import without_copies
from diagnosis.audit.discovery.discover import Discovery
from diagnosis.audit.endings import Ending, endings, write_failures
from diagnosis.audit.engines import Engine
from diagnosis.audit.events import Emit
from diagnosis.audit.fleet.listed import ListedMachine
from diagnosis.audit.fleet_page import FleetPage
from diagnosis.audit.plan import AuditOptions, Planned, is_done, plan, stored_result
from diagnosis.audit.previous_pages import compare_newest
from diagnosis.audit.runner import Runner, skip
from diagnosis.audit.store.folders import own_report, run_folders, sweep
from diagnosis.audit.store.ingest import ingest
from diagnosis.audit.store.locks import check_locks
from diagnosis.audit.store.store import FILE_NAME, Store
from diagnosis.audit.store.stored import StoredResult
from replay.errors import LogError

if TYPE_CHECKING:
    from diagnosis.audit.fleet.trend_types import Axis


@dataclass(frozen=True)
class Audited:
    """What came of an audit.

    Attributes
    ----------
    ends : tuple[Ending, ...]
        How the missions stand.
    skipped : int
        Missions that were done before.
    failed : int
        Missions in ``failures.txt``.
    gone : int
        Known missions that are not there any more.
    machines : tuple[ListedMachine, ...]
        The machines of the fleet page, in its order.
    """

    ends: tuple[Ending, ...]
    skipped: int
    failed: int
    gone: int = 0
    machines: tuple[ListedMachine, ...] = ()


def overview(discovery: Discovery, options: AuditOptions) -> list[tuple[Planned, str]]:
    """Each mission with its state: that of its result, or ``to do``; nothing is written."""
    path = options.output / FILE_NAME
    planned = plan(discovery.missions, options)
    if not path.is_file():
        return [(one, "to do") for one in planned]
    out: list[tuple[Planned, str]] = []
    with Store.open(path, read_only=True) as store:
        for one in planned:
            result = stored_result(one, store) if options.resume else None
            out.append((one, result.state if result is not None and is_done(result, options) else "to do"))
    return out


def audit(
    discovery: Discovery,
    options: AuditOptions,
    engine: Callable[[], AbstractContextManager[Engine]],
    emit: Emit,
    *,
    baseline: Path | None = None,
    axis: Axis = "hours",
) -> Audited:
    """Audit discovered missions.

    Parameters
    ----------
    discovery : Discovery
        From `diagnosis.audit.discovery.discover.discover`.
    options : AuditOptions
        What is wanted.
    engine : Callable
        Makes the engine, where there is something to do.
    emit : Emit
        Takes every event.
    baseline : Path or None
        Store of another audit to compare the fleet with.
    axis : str
        Trends over ``hours`` of driving or ``days``.

    Raises
    ------
    ConfigError
        Where the machine file is wrong or the engine is not there.
    OutputError
        Where the output cannot be written; what was kept before stays.
    """
    if baseline is not None:
        from diagnosis.audit.fleet_files import check_baseline

        check_baseline(baseline, options.output / FILE_NAME)
    check_locks(options.output)
    with Store.open(options.output / FILE_NAME) as store:
        page = FleetPage(options.output, baseline, axis, emit)
        complete = page.is_current()  # else an earlier run was ended before its last steps
        planned, done, rest = _begin(discovery, options, store, emit)
        if rest:
            page.update(always=False)  # what is still to do may contradict what it says
            with page.written_on_failure(), run_folders(options.output) as place, engine() as made:
                runner = Runner(options, store, made, place, page.emit_and_update)
                rest = _run_all(runner, done, rest, options, store)
        names = [one.mission.name for one in (rest if complete else planned)]
        compare_newest(store, names, options.max_size_mb, emit)
        ends = endings(store, [one.mission for one in planned])
        failed = write_failures(options.output, planned, ends, options.machine)
        page.finish()
        gone = store.database.rows("SELECT count(*) FROM mission WHERE gone IS NOT NULL")[0][0]
    return Audited(tuple(ends), len(planned) - len(rest), failed, gone, page.machines())


def _begin(
    discovery: Discovery, options: AuditOptions, store: Store, emit: Emit
) -> tuple[list[Planned], list[Planned], list[Planned]]:
    """Begin a run of the store: all missions, those that are done, and the rest."""
    sweep(options.output)
    store.begin_run((*discovery.problems, *discovery.notes))
    taken = ingest(store)
    if taken.attempts or taken.links or taken.problems:
        emit("ingested", {"attempts": taken.attempts, "links": taken.links, "problems": list(taken.problems)})
    missions = store.adopt(discovery.missions, discovery.roots)
    planned = plan(missions, options)
    done, rest = list[Planned](), list[Planned]()
    emit("start", {"missions": len(planned), "bytes": sum(m.bytes for m in missions)})
    for one in planned:
        result = stored_result(one, store) if options.resume else None
        if result is not None:
            _remake_page(result, options, emit)
        if result is not None and is_done(result, options):
            skip(one, result, store, emit)
            done.append(one)
        else:
            rest.append(one)
    emit("planned", {"rest": len(rest), "bytes": sum(one.mission.bytes for one in rest)})
    return planned, done, rest


def _run_all(
    runner: Runner, done: Sequence[Planned], rest: Sequence[Planned], options: AuditOptions, store: Store
) -> list[Planned]:
    """Run what is not done; all missions that were run.

    Those that were done are run too where they shared a report whose place another result has taken meanwhile.
    """
    now, ran = list(rest), list(rest)
    while now:
        for part in without_copies(now, store):
            runner.run(part)
        done, now = _parted(done, options, store)
        ran += now
    return ran


def _parted(done: Sequence[Planned], options: AuditOptions, store: Store) -> tuple[list[Planned], list[Planned]]:
    """Missions that are done still, and those that are not any more."""
    parts: tuple[list[Planned], list[Planned]] = [], []
    for one in done:
        parts[not is_done(stored_result(one, store), options)].append(one)
    return parts


def _remake_page(result: StoredResult, options: AuditOptions, emit: Emit) -> None:
    """Make a result's page again where it was removed and the rest of the report is there."""
    if result.report is None or (options.output / result.report / "report.html").is_file():
        return
    from diagnosis.output import rebuild

    with own_report(options.output, result.report, result.key) as folder:
        if folder is None or not (folder / "report.json").is_file():
            return
        try:
            rebuild(folder, max_size_mb=options.max_size_mb)
        except (LogError, KeyError, TypeError, ValueError):  # the mission is diagnosed again
            return
    emit("rebuilt", {"report": result.report})
