"""One attempt at one mission, from its files to a result object: the function that every engine runs."""

from __future__ import annotations

import os
import secrets
import shutil
import tempfile
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from diagnosis.audit.discovery.identity import fallback_id
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.discovery.staging import Late, Staged, stage
from diagnosis.audit.isolation import child
from diagnosis.audit.isolation.child import Work
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.isolation.run import isolation, run_isolated
from diagnosis.audit.isolation.why import over_time
from diagnosis.audit.store.folders import MISSIONS, publish, swept_folder
from diagnosis.audit.store.keys import Key, file_roles, log_hash, unhashed_log
from diagnosis.audit.store.locks import cannot_write
from diagnosis.audit.store.objects import Objects
from diagnosis.audit.store.outcome import READ, MissionState, Outcome
from diagnosis.audit.store.records import FileRecord, ResultObject, attempt_record
from replay.errors import ConfigError, LogError, OutputError
from replay.machine.config import Machine
from replay.readers.common.room import FULL
from replay.version import __version__


@dataclass(frozen=True)
class Task:
    """One attempt at one mission.

    Attributes
    ----------
    mission : MissionSource
        As found.
    output : str
        Folder of the audit.
    machine : Machine
        The mission's machine.
    machine_source : str
        Where its settings come from.
    machine_id : str
        Identity for trends; empty: what the log and the machine file say.
    config_hash : str
        From `diagnosis.audit.store.keys.config_hash`.
    folder : str
        The run's working folder, on the disk of the output.
    temporary : str
        The run's folder for temporary files; empty: one of this machine's own.
    attempt : int
        Number of the attempt: 1, 2, …
    known : tuple[str, ...]
        SHA-256 of each file where it is known already; empty: all are to be hashed.
    limits : Limits
        Of the child.
    max_size_mb : float
        Size the page should keep to [MB].
    objects : str
        Folder where the attempt is to leave its result object; empty: whoever handed the task out keeps it.
    described : tuple[str, ...]
        Names of the files in the result object.
    isolation : str
        As in `diagnosis.audit.isolation.run.isolation`.
    judge : str
        As in `Work`; for tests.
    """

    mission: MissionSource
    output: str
    machine: Machine
    machine_source: str
    machine_id: str
    config_hash: str
    folder: str
    temporary: str = ""
    attempt: int = 1
    known: tuple[str, ...] = ()
    limits: Limits = field(default_factory=Limits)
    max_size_mb: float = 8.0
    objects: str = ""
    described: tuple[str, ...] = ()
    isolation: str = ""
    judge: str = "diagnosis.audit.isolation.child:judge"


@dataclass(frozen=True)
class Attempt:
    """What came of a task.

    Attributes
    ----------
    mission : MissionSource
        As in the task.
    key : Key
        Of the result.
    outcome : Outcome
        How it ended.
    number : int
        Number of the attempt.
    report : str or None
        Folder of the report, relative to the output.
    hashes : tuple[str, ...]
        SHA-256 of each file; empty where they could not be read.
    kept : bool
        Whether its result object stands already.
    """

    mission: MissionSource
    key: Key
    outcome: Outcome
    number: int
    report: str | None
    hashes: tuple[str, ...]
    kept: bool = False


def key_of(mission: MissionSource, hashes: tuple[str, ...], machine: Machine, config_hash: str) -> Key:
    """Key of a mission's result; without hashes, that of files which cannot be read."""
    content = unhashed_log(mission)
    if hashes:
        content = log_hash(hashes, file_roles([Path(name).name for name in mission.files], machine))
    return Key(content, config_hash, __version__)


def audit_one(task: Task) -> Attempt:
    """Hash a mission's files, diagnose them in a child, and move the report to its place.

    Raises
    ------
    OutputError
        Where the output cannot be written: no outcome of the mission, but of the audit.
    """
    name = f"{os.getpid()}-{secrets.token_hex(6)}"
    folder = Path(task.folder) / name
    with ExitStack() as ending:
        try:
            folder.mkdir(parents=True)
            ending.callback(shutil.rmtree, folder, ignore_errors=True)
            if task.temporary:
                temporary = Path(tempfile.mkdtemp(dir=task.temporary))
                ending.callback(shutil.rmtree, temporary, ignore_errors=True)
            else:  # of a worker on another machine, which may be ended by force
                temporary = ending.enter_context(swept_folder())
        except OSError as error:
            raise cannot_write(error, folder) from error
        attempt = _audit(task, folder, temporary)
        if task.objects:
            _put(task, attempt)
        return replace(attempt, kept=bool(task.objects))


def _audit(task: Task, folder: Path, temporary: Path) -> Attempt:
    files = tuple(Path(name) for name in task.mission.files if "://" not in name)
    before, start = _signature(files), time.monotonic()
    try:
        staged = stage(task.mission, temporary / "files", task.known, start + task.limits.wall_s)
    except Late:
        outcome = Outcome(MissionState.TIMEOUT, over_time(task.limits), time.monotonic() - start)
        return _unhashed(task, outcome)
    except (LogError, ConfigError) as error:
        full = isinstance(error.__cause__, OSError) and error.__cause__.errno in FULL
        return _unhashed(task, Outcome(MissionState.UNREADABLE, str(error), passing=True, killed=full))
    hashes = staged.hashes
    key = key_of(task.mission, hashes, task.machine, task.config_hash)
    work = Work(
        tuple(str(path) for path in staged.paths),
        task.machine,
        task.machine_source,
        task.machine_id,
        fallback_id(task.mission),
        str(folder),
        str(temporary),
        task.max_size_mb,
        task.judge,
    )
    try:
        outcome = run_isolated(work, task.limits, isolation(task.isolation), time.monotonic() - start)
    except OutputError as error:
        raise OutputError(
            f"{task.output}: the report of {task.mission.name} cannot be written ({error}); finished missions are kept; run the "
            "same command again to continue"
        ) from error
    if _signature(files) != before:
        gone = "was changed or removed while it was read; audit again once it is complete"
        outcome = Outcome(MissionState.UNREADABLE, gone, outcome.wall_s, outcome.cpu_s, outcome.peak_mb, passing=True)
    outcome = replace(outcome, reason=named(outcome.reason, staged, task.mission, temporary))
    if outcome.passing:
        return _unhashed(task, outcome)
    report = None
    if outcome.state in READ and (folder / child.REPORT).is_dir():
        report = f"{MISSIONS}/{task.mission.name}"
        publish(folder / child.REPORT, Path(task.output) / report, key)
    return Attempt(task.mission, key, outcome, task.attempt, report, hashes)


def _unhashed(task: Task, outcome: Outcome) -> Attempt:
    """End that says nothing of the files' content: the next audit tries again."""
    return Attempt(
        task.mission, key_of(task.mission, (), task.machine, task.config_hash), outcome, task.attempt, None, ()
    )


def named(reason: str, staged: Staged, mission: MissionSource, temporary: Path) -> str:
    """A reason that names files as they were found, not their copies of this attempt."""
    if len(staged.paths) == len(mission.files):
        for path, name in zip(staged.paths, mission.files, strict=True):
            if temporary in path.parents:
                reason = reason.replace(str(path), name)
    return reason.replace(f"{temporary}{os.sep}", "")


def _put(task: Task, attempt: Attempt) -> None:
    """Leave the attempt's result object, as `Store.record` would."""
    mission = attempt.mission
    hashes = attempt.hashes or (None,) * len(mission.files)
    files: list[FileRecord] = [
        {"path": path, "size": size, "stamp": stamp, "sha256": sha256}
        for path, size, stamp, sha256 in zip(task.described, sizes_of(mission), mission.stamps, hashes, strict=True)
    ]
    document: ResultObject = {
        "mission": {"name": mission.name, "files": files, "bytes": mission.bytes},
        "key": attempt.key.record,
        "summary": attempt.outcome.summary,
        "attempt": attempt_record(attempt.outcome),
        "report": attempt.report,
        "machine_id": task.machine_id or task.machine.id or fallback_id(mission),
        "made_ns": time.time_ns(),
    }
    Objects(task.objects).put_attempt(attempt.key.stem, document, attempt.number)


def sizes_of(mission: MissionSource) -> tuple[int, ...]:
    """Size of each of a mission's files [bytes]."""
    return mission.sizes or (mission.bytes,) * len(mission.files)


def _signature(files: tuple[Path, ...]) -> dict[str, tuple[int, ...]]:
    """What changes with the files' content or place."""
    found: dict[str, tuple[int, ...]] = {}
    for path in files:
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            with suppress(OSError):
                status = file.stat()
                found[str(file)] = (status.st_size, status.st_mtime_ns, status.st_ino)
    return found
