"""In which state a child that left no outcome has ended, and why: by its exit code, its signal and its last words."""

from __future__ import annotations

import re
import signal
from contextlib import suppress
from pathlib import Path

from diagnosis.audit.isolation import child
from diagnosis.audit.isolation.child import Work
from diagnosis.audit.isolation.fork_server import Ended
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.store.outcome import LimitMet, MissionState

NO_ANSWER = "the process that starts missions does not answer"
_NO_MEMORY = re.compile(r"bad_alloc|MemoryError|out of memory|cannot allocate memory|LLVM ERROR", re.IGNORECASE)
_FRAME = re.compile(r'^  File "([^"]+)", line (\d+) in (\S+)', re.MULTILINE)
_NO_MEMORY_LEFT = "the system had no memory left and ended its process; run fewer at once with -j"
_OUTSIDE = {
    getattr(signal, name)
    for name in ("SIGHUP", "SIGINT", "SIGQUIT", "SIGTERM", "SIGALRM", "SIGUSR1", "SIGUSR2", "SIGPWR", "SIGXCPU")
    if hasattr(signal, name)
}
"""Signals that no program sends itself by a fault in it."""
_OUTSIDE_START = re.compile(rf"ended with SIG(KILL|TERM|HUP|INT|QUIT)|^cannot start a process|^{NO_ANSWER}$")


def not_the_missions(reason: str) -> bool:
    """Whether a mission that could not be started failed for something outside of it."""
    return _OUTSIDE_START.search(reason) is not None


def why(ended: Ended, work: Work, limits: Limits, *, no_memory: bool) -> tuple[MissionState, str, bool]:
    """Find out why a child left no outcome.

    Parameters
    ----------
    ended : Ended
        How it ended.
    work : Work
        What it was given; its last words lie in its folder.
    limits : Limits
        Its limits.
    no_memory : bool
        Whether the system ended any process for want of memory meanwhile.

    Returns
    -------
    tuple[MissionState, str, bool]
        State, reason, and whether something outside of the mission ended it.
    """
    state, reason = _why(ended, _messages(work), limits, no_memory=no_memory)
    return state, reason, reason in (_NO_MEMORY_LEFT, _from_outside(-ended.code))


def _why(ended: Ended, messages: str, limits: Limits, *, no_memory: bool) -> tuple[MissionState, str]:
    over_cpu = limits.cpu_s is not None and ended.cpu_s >= limits.cpu_s
    if ended.stopped == "wall":
        return MissionState.TIMEOUT, over_time(limits)
    if ended.stopped == "memory" or ended.code == child.OUT_OF_MEMORY:
        return MissionState.OUT_OF_MEMORY, over_memory(limits)
    if ended.code >= 0:
        return MissionState.CRASHED, f"its process ended with code {ended.code} and left no result{_place(messages)}"
    name = signal_name(-ended.code)
    if limits.cpu_s is not None and (name == "SIGXCPU" or (name == "SIGKILL" and over_cpu)):
        text = f"took more than {limits.cpu_s:g} s of a processor; allow more with --cpu"
        return MissionState.TIMEOUT, LimitMet(text, "--cpu", limits.cpu_s)
    if name == "SIGKILL":
        return (
            (MissionState.OUT_OF_MEMORY, _NO_MEMORY_LEFT) if no_memory else (MissionState.UNREADABLE, _from_outside(9))
        )
    if -ended.code in _OUTSIDE:
        return MissionState.UNREADABLE, _from_outside(-ended.code)
    if _NO_MEMORY.search(messages):
        return MissionState.OUT_OF_MEMORY, over_memory(limits)
    if name == "SIGBUS":
        return (
            MissionState.CRASHED,
            f"its process ended with SIGBUS: a file became shorter while it was read{_place(messages)}",
        )
    return MissionState.CRASHED, f"its process ended with {name}{_place(messages)}"


def _from_outside(number: int) -> str:
    return f"its process was ended from outside by {signal_name(number)}; audit again"


def over_time(limits: Limits) -> str:
    """Reason of a mission that took longer than it may."""
    return LimitMet(f"took longer than {limits.wall_s:g} s; allow more with --timeout", "--timeout", limits.wall_s)


def over_memory(limits: Limits, place: str = "") -> str:
    """Reason of a mission that needed more memory than it may, and where."""
    text = (
        f"needed more than {limits.memory_mb:.0f} MB of memory{f' {place}' if place else ''}; allow more with --memory"
    )
    return LimitMet(text, "--memory", limits.memory_mb)


def signal_name(number: int) -> str:
    """Name of a signal."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _messages(work: Work) -> str:
    with suppress(OSError), (Path(work.folder) / child.MESSAGES).open("rb") as file:
        return file.read(1 << 16).decode("utf-8", "replace")
    return ""


def _place(messages: str) -> str:
    """Innermost place in the program, as the fault handler wrote it."""
    frame = _FRAME.search(messages, max(messages.find("Current thread"), 0))
    return f" (in {frame[3]}, {Path(frame[1]).name}, line {frame[2]})" if frame else ""
