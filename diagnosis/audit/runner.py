"""Audit missions: leave what is done, run the rest on an engine, keep each end in the store as soon as it is known."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace

from diagnosis.audit.discovery.identity import fallback_id
from diagnosis.audit.engines import Engine, is_lost
from diagnosis.audit.events import Emit, EventFacts
from diagnosis.audit.plan import AuditOptions, Planned, allows_more, is_done, known_hashes, stored_result
from diagnosis.audit.store.folders import RESULTS, RunFolders
from diagnosis.audit.store.ingest import ingest
from diagnosis.audit.store.locks import FileLock, lock_mission
from diagnosis.audit.store.outcome import TRANSIENT, MissionState, Outcome
from diagnosis.audit.store.store import Store
from diagnosis.audit.store.stored import StoredResult
from diagnosis.audit.store.summary import MissionSummary
from diagnosis.audit.task import Attempt, Task, audit_one, key_of

TICK_S = 0.5
_AHEAD = 2
_LOST_TRIES = 5
_KILLED_TRIES = 1


@dataclass
class _Running:
    planned: Planned
    lock: FileLock
    number: int
    tries: int = 1
    lost: int = 0


class Runner:
    """One run over planned missions.

    Parameters
    ----------
    options : AuditOptions
        What is wanted.
    store : Store
        Where ends are kept; a run has begun in it.
    engine : Engine
        Where tasks run.
    place : RunFolders
        The run's own folders.
    emit : Emit
        Takes every event: ``skipped``, ``mission``, ``retry``, ``waiting``, ``tick``.
    """

    def __init__(self, options: AuditOptions, store: Store, engine: Engine, place: RunFolders, emit: Emit) -> None:
        self._options, self._store, self._engine, self._place, self._emit = options, store, engine, place, emit
        self._queue: deque[Planned] = deque()
        self._elsewhere: deque[Planned] = deque()
        self._running: dict[Future[Attempt], _Running] = {}
        self._locks: set[FileLock] = set()
        self._waited: set[str] = set()

    def run(self, planned: Sequence[Planned]) -> None:
        """Run until every mission has ended.

        Raises
        ------
        OutputError
            Where the output cannot be written; what was kept before stays.
        """
        self._queue.extend(planned)
        checked = time.monotonic()
        try:
            while self._queue or self._running or self._elsewhere:
                self._fill()
                if self._running:
                    done, _ = wait(self._running, TICK_S, return_when=FIRST_COMPLETED)
                    self._finish([(self._running.pop(future), future) for future in done])
                elif not self._queue:
                    time.sleep(TICK_S)
                self._emit("tick", {})
                if not self._queue and self._elsewhere and time.monotonic() - checked > 2 * TICK_S:
                    checked = time.monotonic()
                    self._queue, self._elsewhere = self._elsewhere, deque()
        except BaseException:
            self._engine.stop()
            raise
        finally:
            for lock in self._locks:
                lock.release()

    def _fill(self) -> None:
        """Hand out as much as can run, and a little more, so that nobody waits."""
        room = self._engine.capacity() + _AHEAD - len(self._running)
        while self._queue and room > 0:
            planned = self._queue.popleft()
            if planned.problem:
                self._refuse(planned)
                continue
            lock = lock_mission(self._options.output, planned.mission.name)
            if lock is None:
                self._elsewhere.append(planned)
                if planned.mission.name not in self._waited:
                    self._waited.add(planned.mission.name)
                    self._emit("waiting", {"name": planned.mission.name})
                continue
            self._locks.add(lock)
            result = stored_result(planned, self._store)
            if (
                self._options.resume and result is not None and is_done(result, self._options)
            ):  # by another run meanwhile
                self._release(lock)
                skip(planned, result, self._store, self._emit)
                continue
            number = result.attempts + 1 if result is not None else 1
            again = self._options.resume and result is not None and result.state in TRANSIENT
            more = again and result is not None and allows_more(self._options.limits, result)
            self._submit(_Running(planned, lock, number, tries=number if again and not more else 1))
            room -= 1

    def _submit(self, one: _Running) -> None:
        planned, options = one.planned, self._options
        mission = planned.mission
        if self._engine.shared:  # workers have folders of their own to start from
            mission = replace(mission, files=tuple(absolute(name) for name in mission.files))
        task = Task(
            mission=mission,
            output=absolute(str(options.output)),
            machine=planned.machine,
            machine_source=planned.source,
            machine_id=planned.machine_id,
            config_hash=planned.config_hash,
            folder=absolute(str(self._place.folder)),
            temporary="" if self._engine.shared else str(self._place.temporary),
            attempt=one.number,
            known=known_hashes(planned, self._store),
            limits=options.limits,
            max_size_mb=options.max_size_mb,
            objects=absolute(str(options.output / RESULTS)) if self._engine.shared else "",
            described=tuple(self._store.relative(file) for file in planned.mission.files),
            isolation=options.isolation,
            judge=options.judge,
        )
        self._running[self._engine.executor.submit(audit_one, task)] = one

    def _finish(self, done: Sequence[tuple[_Running, Future[Attempt]]]) -> None:
        """Keep what has ended, then say so."""
        ended = [(one, attempt) for one, future in done if (attempt := self._attempt_of(one, future)) is not None]
        if any(attempt.kept for _, attempt in ended):
            ingest(self._store)
        for one, attempt in ended:
            if not attempt.kept:
                keep(attempt, one.planned, self._store)
            outcome = attempt.outcome
            tries = max(self._options.retries, _KILLED_TRIES) if outcome.killed else self._options.retries
            if (outcome.killed or outcome.state in TRANSIENT) and one.tries <= tries:
                self._emit("retry", {"name": attempt.mission.name, "state": outcome.state, "reason": outcome.reason})
                self._submit(replace(one, number=one.number + 1, tries=one.tries + 1))
            else:
                self._release(one.lock)
                self._emit("mission", facts_of(attempt))

    def _release(self, lock: FileLock) -> None:
        lock.release()
        self._locks.discard(lock)

    def _attempt_of(self, one: _Running, future: Future[Attempt]) -> Attempt | None:
        """What came of a task; None where its worker was lost and another one is at it now."""
        try:
            return future.result()
        except BaseException as error:
            if not is_lost(error):
                raise
        self._engine.capacity()  # raises where not the worker alone was lost
        one.lost += 1
        if one.lost >= _LOST_TRIES:
            return self._lost(one)
        self._emit("retry", {"name": one.planned.mission.name, "reason": "the worker was lost"})
        self._submit(one)
        return None

    def _lost(self, one: _Running) -> Attempt:
        planned = one.planned
        key = key_of(planned.mission, (), planned.machine, planned.config_hash)
        outcome = Outcome(MissionState.CRASHED, f"{_LOST_TRIES} workers were lost while they diagnosed it")
        return Attempt(planned.mission, key, outcome, one.number, None, ())

    def _refuse(self, planned: Planned) -> None:
        key = key_of(planned.mission, (), planned.machine, planned.config_hash)
        attempt = Attempt(planned.mission, key, Outcome(MissionState.UNREADABLE, planned.problem), 1, None, ())
        keep(attempt, planned, self._store)
        self._emit("mission", facts_of(attempt))


def keep(attempt: Attempt, planned: Planned, store: Store) -> None:
    """Keep an attempt in the store, and what its files' hashes are."""
    mission = attempt.mission
    machine_id = planned.machine_id or planned.machine.id or fallback_id(mission)
    store.record(mission, attempt.key, attempt.outcome, attempt.report, machine_id=machine_id, hashes=attempt.hashes)


def absolute(name: str) -> str:
    """A path from the root on, links as they are; URLs stay."""
    return name if "://" in name else os.path.abspath(name)  # noqa: PTH100


def skip(planned: Planned, result: StoredResult, store: Store, emit: Emit) -> None:
    """Let a mission have the result that is there."""
    store.reuse(planned.mission, result)
    reason = store.reason_for(result.id, result.reason, planned.mission.files)
    emit(
        "skipped",
        {
            "name": planned.mission.name,
            "state": result.state,
            "reason": reason,
            "verdict": result.verdict,
            "report": result.report,
        },
    )


def facts_of(attempt: Attempt) -> EventFacts:
    """Facts about a mission's end, for events."""
    outcome = attempt.outcome
    summary = outcome.summary or MissionSummary(result={}, faults=[], components=[])
    result = summary["result"]
    return {
        "name": attempt.mission.name,
        "files": list(attempt.mission.files),
        "state": outcome.state,
        "reason": outcome.reason,
        "verdict": result.get("verdict"),
        "title": result.get("title", ""),
        "faults": len(summary["faults"]),
        "report": attempt.report,
        "attempt": attempt.number,
        "wall_s": round(outcome.wall_s, 3),
        "cpu_s": round(outcome.cpu_s, 3),
        "peak_mb": round(outcome.peak_mb, 1),
    }
