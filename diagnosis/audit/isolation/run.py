"""Run one mission in a process of its own, and say how that ended."""

from __future__ import annotations

import atexit
import errno
import os
import threading
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import orjson

from diagnosis.audit.isolation import child
from diagnosis.audit.isolation.child import ChildOutcome, Work
from diagnosis.audit.isolation.fork_server import Ended
from diagnosis.audit.isolation.forks import ForkServer
from diagnosis.audit.isolation.limits import LINUX, Limits, memory_kills
from diagnosis.audit.isolation.why import not_the_missions, over_memory, why
from diagnosis.audit.store.outcome import MissionState, Outcome
from replay.errors import OutputError

_LEAST_S = 0.01


class Isolation(Protocol):
    """A way to start children; safe to use from several threads."""

    closed: bool

    def start(self) -> None:
        """Make ready what can be before the first mission."""

    def run(self, work: Work, limits: Limits) -> Ended | str:
        """Run one mission to its end; a text where no child could be started; raises `Stopped`."""

    def close(self) -> None:
        """End all children and whatever starts them."""


def run_isolated(work: Work, limits: Limits, isolation: Isolation, spent_s: float = 0.0) -> Outcome:
    """Do the work in a child, in what is left of the mission's time after `spent_s` [s].

    Raises
    ------
    OutputError
        Where the report has no place to be written.
    """
    kills = memory_kills()
    ended = isolation.run(work, replace(limits, wall_s=max(limits.wall_s - spent_s, _LEAST_S)))
    if isinstance(ended, str):
        killed = not_the_missions(ended)
        return Outcome(
            MissionState.UNREADABLE if killed else MissionState.CRASHED, ended, passing=killed, killed=killed
        )
    found = _left_by(work) if not ended.code else None
    if ended.code == child.NOT_WRITTEN or (found is not None and found["state"] == child.NOT_KEPT):
        raise OutputError((found["reason"] if found is not None else "") or os.strerror(errno.ENOSPC))
    if found is None:
        state, reason, killed = why(ended, work, limits, no_memory=memory_kills() > kills)
        return Outcome(
            state, reason, ended.wall_s + spent_s, ended.cpu_s, ended.peak_mb, passing=killed, killed=killed
        )  # fmt: skip
    state, reason = MissionState(found["state"]), found["reason"]
    if state is MissionState.OUT_OF_MEMORY:
        reason = over_memory(limits, reason)
    return Outcome(
        state,
        reason,
        ended.wall_s + spent_s,
        ended.cpu_s,
        ended.peak_mb,
        summary=found["summary"],
        passing=found.get("passing", False),
        killed=found.get("killed", False),
        no_log=found.get("no_log", False),
    )


def _left_by(work: Work) -> ChildOutcome | None:
    """Outcome that a child has left; None where it left none."""
    try:
        found: ChildOutcome = orjson.loads((Path(work.folder) / child.OUTCOME).read_bytes())
    except (OSError, orjson.JSONDecodeError):
        return None
    return found


_FEW, _AMPLE_MB = 2, 1024.0
_MADE: dict[tuple[str, int, str], Isolation] = {}
_MAKING = threading.Lock()


def isolation_for(missions: int, limits: Limits) -> str:
    """Way to start children that takes the least for so many missions, as `isolation` takes it.

    A made-up mission beforehand takes longer than what two missions load themselves, which is memory of theirs then.
    """
    few = missions <= _FEW and limits.memory_mb >= _AMPLE_MB
    return "fork-cold" if LINUX and few else ""


def isolation(kind: str = "") -> Isolation:
    """Way to start children in this process and working folder, which names of files are read from; the same one until it is closed.

    Parameters
    ----------
    kind : str
        ``fork`` (Linux), ``fork-cold`` (not warmed) or ``spawn``; empty: what the platform does best.
    """
    kind = kind or ("fork" if LINUX else "spawn")
    with _MAKING:
        key = kind, os.getpid(), os.path.realpath(".")
        made = _MADE.get(key)
        if made is None or made.closed:
            if kind == "spawn":
                from diagnosis.audit.isolation.fresh_process import Spawner

                made = Spawner()
            else:
                made = ForkServer(warmed=kind == "fork")
            _MADE[key] = made
            atexit.register(made.close)
    return made
