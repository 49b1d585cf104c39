"""A whole audit: what is there, what is done, the rest, and the fleet page."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, cast

import orjson

from diagnosis.audit.copies import without_copies
from diagnosis.audit.discovery.discover import Discovery
from diagnosis.audit.endings import Ending, endings, write_failures
from diagnosis.audit.engines import Engine
from diagnosis.audit.events import Emit, EventFacts
from diagnosis.audit.fleet.read import content_mark
from diagnosis.audit.plan import AuditOptions, Planned, is_done, plan, stored_result
from diagnosis.audit.previous_pages import compare_newest
from diagnosis.audit.runner import Runner, skip
from diagnosis.audit.store.folders import own_report, run_folders, sweep
from diagnosis.audit.store.ingest import ingest
from diagnosis.audit.store.locks import check_locks, exclusively
from diagnosis.audit.store.store import FILE_NAME, Store
from diagnosis.audit.store.stored import StoredResult
from replay.errors import LogError, OutputError
from replay.version import __version__

if TYPE_CHECKING:
    from diagnosis.audit.fleet.trend_types import Axis

PAGE_S = 60.0
_PAGE_SHARE = 20.0
_PAGE_TRIES = 3
_PAGE_NAME = "the fleet page"


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
    """

    ends: tuple[Ending, ...]
    skipped: int
    failed: int
    gone: int = 0


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
        page = _FleetPage(options.output, baseline, axis, emit)
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
    return Audited(tuple(ends), len(planned) - len(rest), failed, gone)


def _begin(
    discovery: Discovery, options: AuditOptions, store: Store, emit: Emit
) -> tuple[list[Planned], list[Planned], list[Planned]]:
    """Begin a run of the store: all missions, those that are done, and the rest."""
    sweep(options.output)
    store.begin_run()
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


class _PageState(TypedDict, total=False):
    """What says whether a `fleet.json` is up to date."""

    mark: str
    version: str
    axis: str
    baseline: object


@dataclass
class _FleetPage:
    """The fleet page, written anew every now and then while missions end."""

    output: Path
    baseline: Path | None
    axis: Axis
    emit: Emit
    due: float = field(default_factory=lambda: time.monotonic() + PAGE_S)

    def emit_and_update(self, event: str, facts: EventFacts) -> None:
        """Pass an event on, and write the page when it is due."""
        self.emit(event, facts)
        if event == "tick" and time.monotonic() > self.due:
            self.update(always=True)

    def update(self, *, always: bool) -> None:
        """Write the page while missions are still to end: what goes wrong with it costs none, and shows again at the end."""
        try:
            self.write(always=always)
        except OutputError:
            raise
        except Exception as error:
            self.due = time.monotonic() + PAGE_S
            self.emit("page_failed", {"reason": f"{type(error).__name__}: {error}"})

    def write(self, *, always: bool) -> None:
        """Write the page, unless the one that is there is up to date."""
        from diagnosis.audit.fleet_files import write_fleet

        if not always and self._is_as_asked():
            return
        start = time.monotonic()
        with exclusively(self.output, _PAGE_NAME, PAGE_S):  # its three files belong together
            files = write_fleet(self.output / FILE_NAME, self.output, baseline=self.baseline, axis=self.axis)
        took = time.monotonic() - start
        self.due = time.monotonic() + max(PAGE_S, _PAGE_SHARE * took)
        self.emit("page", {"path": str(files.html), "wall_s": round(took, 3)})

    @contextmanager
    def written_on_failure(self) -> Iterator[None]:
        """Write the page also where the audit is interrupted, with what was found until then."""
        try:
            yield
        except BaseException:
            with suppress(Exception):
                self.finish()
            raise

    def finish(self) -> None:
        """Write the page until it shows what the store holds; another audit of this output may write both meanwhile."""
        for _ in range(_PAGE_TRIES):
            self.write(always=False)
            if self.is_current():
                return

    def is_current(self) -> bool:
        """Whether there is a page of what the store holds now."""
        return self._shows_the_store(self._state())

    def _is_as_asked(self) -> bool:
        """Whether the page is current, and as it is asked for."""
        state = self._state()
        as_asked = self.baseline is None and state.get("baseline") is None and state.get("axis") == self.axis
        return as_asked and self._shows_the_store(state)

    def _shows_the_store(self, state: _PageState) -> bool:
        page, mark = self.output / "fleet.html", content_mark(self.output / FILE_NAME)
        return (state.get("mark"), state.get("version")) == (mark, __version__) and page.is_file()

    def _state(self) -> _PageState:
        """State of the `fleet.json` that is there; empty where there is none."""
        try:
            document: object = orjson.loads((self.output / "fleet.json").read_bytes())
        except (OSError, ValueError):
            return {}
        return cast(_PageState, document) if isinstance(document, dict) else {}
