"""What a worker takes of the processors, and whether it sleeps: by these a hang is known, never by the clock on the wall alone."""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

HANG_CPU_S, WAITED_S = 10.0, 600.0
_TICKS = os.sysconf("SC_CLK_TCK")
_LOOK_S, _STEP_S = 0.2, 1.0  # looking costs dozens of calls of the system, which many short inputs would feel


@dataclass(frozen=True)
class Taken:
    """What a process and those that it started have taken, and what they do.

    Attributes
    ----------
    cpu_s : float
        Time of a processor, user and system, of all threads; children that have ended are counted too [s].
    sleeping : bool
        Whether every thread of every one of them waits for something other than a processor. A stopped one does not.
    """

    cpu_s: float = 0.0
    sleeping: bool = False


class Watch:
    """Time since a worker said anything: of the processors, and asleep.

    Parameters
    ----------
    pid : int
        Of the worker.

    Attributes
    ----------
    busy_s, slept_s : float
        What it has taken of the processors since the first look, and how long it has slept [s].
    """

    def __init__(self, pid: int) -> None:
        self._pid, self._seen = pid, time.monotonic()
        self.begin()

    def begin(self) -> None:
        """Count from zero, from the next look on."""
        self._cpu_at: float | None = None
        self.busy_s = self.slept_s = 0.0

    def over(self) -> str:
        """Look again, five times a second at most: ``hang``, ``waited``, or nothing.

        Time in which the worker could run and did not (the machine has other work, or somebody stopped it) counts for neither, and
        one that has taken time of a processor since the last look did not sleep. The time between two looks counts as one second at
        most: whoever looks may be stopped too.
        """
        now = time.monotonic()
        since = now - self._seen
        if since < _LOOK_S:
            return ""
        self._seen, taken = now, taken_by(self._pid)
        if self._cpu_at is None:
            self._cpu_at = taken.cpu_s
            return ""
        busy_s = taken.cpu_s - self._cpu_at
        if taken.sleeping and busy_s <= self.busy_s:
            self.slept_s += min(since, _STEP_S)
        self.busy_s = busy_s
        if busy_s > HANG_CPU_S:
            return "hang"
        return "waited" if self.slept_s > WAITED_S else ""

    def __str__(self) -> str:
        return f"{self.busy_s:.1f} s of a processor and {self.slept_s:.0f} s asleep"


def taken_by(pid: int) -> Taken:
    """Of a process and all below it; nothing where it is gone."""
    cpu_s, sleeping = 0.0, True
    for one in (pid, *below(pid)):
        if fields := _fields(Path(f"/proc/{one}/stat")):
            cpu_s += sum(map(int, fields[11:15])) / _TICKS
        for path in Path(f"/proc/{one}/task").glob("*/stat"):
            if fields := _fields(path):
                sleeping &= fields[0] in "SD"
    return Taken(cpu_s, sleeping)


def below(pid: int) -> list[int]:
    """Processes that a process has started, and those that they have."""
    out = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            children = [int(word) for word in path.read_text(encoding="ascii").split()]
        except OSError:
            continue
        out += [one for child in children for one in (child, *below(child))]
    return out


def end(pid: int) -> None:
    """End a process and all below it."""
    for one in (*below(pid), pid):
        with suppress(ProcessLookupError):
            os.kill(one, signal.SIGKILL)


def _fields(path: Path) -> list[str]:
    """Fields of a ``stat`` file after the name of the command."""
    try:
        return path.read_text(errors="replace").rpartition(")")[2].split()
    except OSError:
        return []
