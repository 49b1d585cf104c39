"""What a worker takes of the processors, and whether it sleeps: by these a hang is known, never by the clock on the wall alone."""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

HANG_CPU_S, WAITED_S = 10.0, 600.0
_TICKS = os.sysconf("SC_CLK_TCK")
_STEP_S = 1.0


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


@dataclass
class Watch:
    """Time since a worker said anything: of the processors, and asleep."""

    cpu_at: float = 0.0
    slept_s: float = 0.0
    seen: float = field(default_factory=time.monotonic)

    def over(self, taken: Taken) -> str:
        """Look again: ``hang``, ``waited``, or nothing.

        Time in which the worker could run and did not (the machine has other work, or somebody stopped it) counts for neither. The
        time between two looks counts as one second at most: whoever looks may be stopped too.
        """
        now = time.monotonic()
        self.slept_s += min(now - self.seen, _STEP_S) if taken.sleeping else 0.0
        self.seen = now
        if taken.cpu_s - self.cpu_at > HANG_CPU_S:
            return "hang"
        return "waited" if self.slept_s > WAITED_S else ""


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
