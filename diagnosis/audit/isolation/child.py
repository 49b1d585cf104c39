"""The work on one mission, in a process of its own.

It reads the log, writes the report into a folder that nobody else reads yet, and leaves ``outcome.json`` beside it.
Whatever ends it earlier leaves no ``outcome.json``, and who started it says what the reason was.
"""

from __future__ import annotations

import errno
import faulthandler
import os
import signal
import sys
import tempfile
import traceback
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, NotRequired, TypedDict

from diagnosis.audit.isolation.limits import Limits, die_with, hold
from diagnosis.audit.store.outcome import MissionState
from diagnosis.audit.store.summary import MissionSummary, ResultFacts, summarise
from diagnosis.results.json_text import dump_json
from diagnosis.results.vocabulary import Verdict
from replay.arrays.processors import use_one
from replay.errors import ConfigError, LogError, NoLog, NotJudged, OutputError
from replay.log.left_out import FileLeftOut
from replay.machine.config import Machine
from replay.readers.common.room import FULL

if TYPE_CHECKING:
    from diagnosis.results.document import MachineRow
    from diagnosis.results.result import MissionResult

NO_ROOM = "cannot keep temporary data: {}; make room or set TMPDIR to a folder that has it, then audit again"
OUTCOME, REPORT, MESSAGES = "outcome.json", "report", "messages.txt"
_PASSING = (
    "EIO", "ESTALE", "ETIMEDOUT", "EAGAIN", "EBUSY", "ENXIO", "ENODEV", "EACCES", "EPERM", "EMFILE", "ENFILE",
    "ENETDOWN", "ENETUNREACH", "EHOSTDOWN", "EHOSTUNREACH", "ECONNREFUSED", "ECONNRESET", "ECONNABORTED", "ENOTCONN",
    "ESHUTDOWN", "ENOLINK", "EREMOTEIO",
)  # fmt: skip
PASSING = {getattr(errno, name) for name in _PASSING if hasattr(errno, name)}
"""Errors of disks, networks and rights: they say nothing of a file's content."""


#: State of a child whose report has no place to be written: no end of the mission, but of the audit.
NOT_KEPT = "not_written"


class ChildOutcome(TypedDict):
    """What a child leaves in ``outcome.json``: a state of `MissionState` or `NOT_KEPT`, the rest as in `Outcome`."""

    state: str
    reason: str
    summary: MissionSummary | None
    passing: NotRequired[bool]
    killed: NotRequired[bool]
    no_log: NotRequired[bool]


@dataclass(frozen=True)
class Work:
    """What a child is given.

    Attributes
    ----------
    files : tuple[str, ...]
        Files of the mission on this machine.
    machine : Machine
        The machine.
    machine_source : str
        Where its settings come from.
    machine_id : str
        Identity for trends; empty: what the log and the machine file say.
    fallback_id : str
        Identity where nothing else says one.
    folder : str
        Folder of this attempt's own: the outcome and the report.
    temporary : str
        Folder of this attempt's own for temporary files.
    max_size_mb : float
        Size the page should keep to [MB].
    judge : str
        ``module:function`` that does the work; for tests.
    """

    files: tuple[str, ...]
    machine: Machine
    machine_source: str
    machine_id: str
    fallback_id: str
    folder: str
    temporary: str
    max_size_mb: float = 8.0
    judge: str = "diagnosis.audit.isolation.child:judge"


def judge(work: Work) -> ChildOutcome:
    """Diagnose the mission and write its report."""
    from diagnosis.output import write_result

    result = _diagnosed(work)
    if not result.report["machine"]["id"]:
        machine: MachineRow = {**result.report["machine"], "id": work.fallback_id}
        result = replace(result, report={**result.report, "machine": machine})
    write_result(result, Path(work.folder) / REPORT, max_size_mb=work.max_size_mb)
    damage = [text for file in result.report["log"]["files"] for text in file["damage"]]
    return {
        "state": MissionState.DEGRADED if damage else MissionState.OK,
        "reason": _first_of(damage),
        "summary": summarise(result.report),
    }


def _diagnosed(work: Work) -> MissionResult:
    """Diagnose all files; where that fails for files beside the first one, without them, which counts as damage."""
    from diagnosis.pipeline import diagnose, diagnose_mission
    from replay.mission import load_mission

    paths, left = [Path(name) for name in work.files], list[str]()
    first: LogError | ConfigError | None = None
    while True:
        try:
            if not left:
                return diagnose(
                    paths, work.machine, machine_source=work.machine_source, machine_id=work.machine_id or None
                )
            mission = load_mission(paths, work.machine)
            main, *others = mission.files
            main = replace(main, summary=replace(main.summary, damage=(*main.summary.damage, *left)))
            return diagnose_mission(
                replace(mission, files=(main, *others)),
                work.machine,
                machine_source=work.machine_source,
                machine_id=work.machine_id or None,
            )
        except (LogError, ConfigError) as error:
            if len(paths) == 1:
                if first is None or str(paths[0]) in str(first):
                    raise
                raise first  # noqa: B904 - what the side file lacks, not what this one lacks without it
            first, text = first or error, str(error)
            unusable = [path for path in paths[1:] if str(path) in text] or paths[1:]
            for path in paths:
                text = text.replace(str(path), path.name)
            left += [
                FileLeftOut(
                    f"{path.name} was left out: {text}"
                    if path.name in text
                    else f"{path.name} was left out, because nothing could be judged together with it ({text})"
                )
                for path in unusable
            ]
            paths = [path for path in paths if path not in unusable]


def _first_of(damage: list[str]) -> str:
    more = f" (and {len(damage) - 1} more)" if len(damage) > 1 else ""
    return f"{damage[0]}{more}" if damage else ""


def attempt(work: Work) -> ChildOutcome:
    """Do the work; every error becomes a state with its reason. ``not_written`` where the report has no place."""
    module, _, function = work.judge.partition(":")
    try:
        found: ChildOutcome = getattr(import_module(module), function)(work)
    except NotJudged as error:
        facts: ResultFacts = {
            "verdict": Verdict.NOT_ASSESSED,
            "title": Verdict.NOT_ASSESSED.label,
            "machine_name": work.machine.name,
            "machine_id": work.machine_id or work.machine.id or work.fallback_id,
        }
        summary: MissionSummary = {"result": facts, "faults": [], "components": []}
        return {"state": MissionState.DEGRADED, "reason": str(error), "summary": summary}
    except OutputError as error:
        return {"state": NOT_KEPT, "reason": _system_reason(error), "summary": None}
    except (LogError, ConfigError) as error:
        number = error.__cause__.errno if isinstance(error.__cause__, OSError) else None
        found = _unread(number, str(error))
        return {**found, "no_log": isinstance(error, NoLog)}
    except MemoryError as error:
        return {"state": MissionState.OUT_OF_MEMORY, "reason": _where(error), "summary": None}
    except OSError as error:
        full, what = error.errno in FULL, error.strerror or error
        name = f"{error.filename}: " if error.filename else ""
        reason = NO_ROOM.format(what) if full else f"{name}cannot be read: {what}"
        return _unread(error.errno, reason)
    except Exception as error:
        traceback.print_exc()
        text = f"internal error: {type(error).__name__}: {error} ({_where(error)})"
        return {"state": MissionState.CRASHED, "reason": text, "summary": None}
    return found


def _unread(number: int | None, reason: str) -> ChildOutcome:
    """End of a mission that cannot be read, by the number of the system's error where there is one."""
    full = number in FULL
    passing = full or number in PASSING
    return {"state": MissionState.UNREADABLE, "reason": reason, "summary": None, "passing": passing, "killed": full}


def _system_reason(error: BaseException) -> str:
    cause = error.__cause__
    return (cause.strerror or str(cause)) if isinstance(cause, OSError) else str(error)


def _where(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    return f"in {Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""


def run(work: Work, limits: Limits, parent: int) -> None:
    """Be the child: take on the limits, work, leave the outcome; never returns."""
    code = 1
    try:
        die_with(parent)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)  # who started this one decides when it ends
        messages = os.open(Path(work.folder) / MESSAGES, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        for stream in (1, 2):
            os.dup2(messages, stream)
        sys.stdout = sys.stderr = os.fdopen(messages, "w", buffering=1, encoding="utf-8", errors="replace")
        faulthandler.enable(sys.stderr)
        os.environ["TMPDIR"] = tempfile.tempdir = work.temporary
        hold(limits)
        use_one()  # an audit has as many missions at once as there are processors
        leave(work, attempt(work))
        code = 0
    except MemoryError:
        code = OUT_OF_MEMORY
    except OSError as error:
        code = NOT_WRITTEN if error.errno in FULL else 1
        with suppress(OSError):
            traceback.print_exc()
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


OUT_OF_MEMORY, NOT_WRITTEN = 97, 98
"""Exit codes of a child that had no memory left to say so, or no room on the disk."""


def leave(work: Work, found: ChildOutcome) -> None:
    """Leave the outcome for who started the child, whole or not at all."""
    path = Path(work.folder) / OUTCOME
    part = path.with_suffix(".part")
    part.write_bytes(dump_json(found))
    part.replace(path)
