"""What one mission may take of the machine, and how much a process has taken.

On Linux the memory limit is held twice: the system refuses private memory past it (``RLIMIT_DATA``; ``RLIMIT_AS`` would
count mapped logs too), which ends in a `MemoryError`, and who started the process watches what it holds, shared memory
included, because not every library survives a refusal and not all memory is private.
"""

from __future__ import annotations

import ctypes
import math
import os
import signal
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

MB = 1 << 20
_PR_SET_PDEATHSIG = 1
LINUX = sys.platform == "linux"


@dataclass(frozen=True)
class Limits:
    """Limits of one mission.

    Attributes
    ----------
    memory_mb : float
        Memory beyond what the program itself takes [MB].
    wall_s : float
        Time [s].
    cpu_s : float or None
        Time of a processor [s]; None: no limit of its own.
    file_mb : float
        Size of any one file that is written, temporary ones too [MB].
    """

    memory_mb: float = 4096.0
    wall_s: float = 1800.0
    cpu_s: float | None = None
    file_mb: float = 65536.0

    def __post_init__(self) -> None:
        for name in ("memory_mb", "wall_s", "cpu_s", "file_mb"):
            value = getattr(self, name)
            if value is not None and not (value > 0 and math.isfinite(value)):
                raise ValueError(f"{name} = {value}: must be a positive number")


def hold(limits: Limits) -> None:
    """Put limits on this process; what the platform cannot hold is left to who started it."""
    try:
        import resource
    except ImportError:  # Windows
        return
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a file past its limit becomes an OSError
    most: dict[int, int] = {
        resource.RLIMIT_FSIZE: int(limits.file_mb * MB),
        resource.RLIMIT_CORE: 0,
    }
    if limits.cpu_s is not None:
        most[resource.RLIMIT_CPU] = math.ceil(limits.cpu_s)
    if LINUX:
        most[resource.RLIMIT_DATA] = _private_virtual() + int(limits.memory_mb * MB)
    for what, value in most.items():
        _, hard = resource.getrlimit(what)
        with suppress(ValueError, OSError):
            resource.setrlimit(what, (value if hard == resource.RLIM_INFINITY else min(value, hard), hard))


def die_with(parent: int) -> None:
    """Let the system end this process when its parent ends, however that happens; exits where it has ended already."""
    follow(signal.SIGKILL)
    if LINUX:
        with suppress(OSError):  # if memory runs out, this process goes first
            Path("/proc/self/oom_score_adj").write_text("900", encoding="ascii")
    if os.getppid() != parent:
        os._exit(1)


def follow(number: int) -> None:
    """Let the system send this process a signal when the thread ends that started it; 0: none any more."""
    if LINUX:
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, number, 0, 0, 0)


def held_mb(pid: int) -> float:
    """Private and shared memory that a process holds, without mapped files [MB]; 0 where unknown."""
    try:
        text = Path(f"/proc/{pid}/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return 0.0
    kilobytes = 0
    for line in text.splitlines():
        if line.startswith(("RssAnon:", "RssShmem:", "VmSwap:")):
            kilobytes += int(line.split()[1])
    return kilobytes / 1024


def memory_kills() -> int:
    """How often the system has ended a process for want of memory; 0 where it does not say."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/vmstat").read_text(encoding="ascii").splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


def usual_memory_mb(jobs: int) -> float:
    """Memory limit where none is given: 4 GB, or an equal part of 80 % of what is available now [MB]."""
    available = min(_available(), _left_in_container())
    return max(min(4096.0, 0.8 * available / jobs), 256.0)


def _available() -> float:
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) / 1024
    return math.inf


def _left_in_container() -> float:
    """What the process's control group may still take, where it is limited."""
    group = Path("/sys/fs/cgroup")
    with suppress(OSError, ValueError):
        most, used = ((group / f"memory.{name}").read_text(encoding="ascii") for name in ("max", "current"))
        return (int(most) - int(used)) / MB
    return math.inf


def _private_virtual() -> int:
    """Private writable memory of this process as the system counts it for ``RLIMIT_DATA`` [bytes]."""
    for line in Path("/proc/self/status").read_text(encoding="ascii", errors="replace").splitlines():
        if line.startswith("VmData:"):
            return int(line.split()[1]) * 1024
    return 0
