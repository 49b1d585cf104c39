"""Run one mission in a process of its own, and say how that ended."""

from __future__ import annotations

import atexit
import errno
import itertools
import json
import os
import pickle
import re
import signal
import socket
import subprocess
import sys
import threading
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Protocol

import orjson

from diagnosis.audit.isolation import child
from diagnosis.audit.isolation.child import ChildOutcome, Work
from diagnosis.audit.isolation.fork_server import Ended, Stopped
from diagnosis.audit.isolation.limits import LINUX, Limits, memory_kills
from diagnosis.audit.store.outcome import MissionState, Outcome
from replay.errors import OutputError

_GRACE_S = 30.0
_CLOSE_S = 2.0
_LEAST_S = 0.01
_NO_MEMORY = re.compile(r"bad_alloc|MemoryError|out of memory|cannot allocate memory|LLVM ERROR", re.IGNORECASE)
_FRAME = re.compile(r'^  File "([^"]+)", line (\d+) in (\S+)', re.MULTILINE)
_NO_MEMORY_LEFT = "the system had no memory left and ended its process; run fewer at once with -j"
_OUTSIDE = {
    getattr(signal, name)
    for name in ("SIGHUP", "SIGINT", "SIGQUIT", "SIGTERM", "SIGALRM", "SIGUSR1", "SIGUSR2", "SIGPWR")
    if hasattr(signal, name)
}
"""Signals that no program sends itself by a fault in it."""
_OUTSIDE_START = re.compile(r"ended with SIG(KILL|TERM|HUP|INT|QUIT)|^cannot start a process")
# One thread for each child: missions run beside each other, and a process with one thread may be forked.
_ONE_THREAD = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "ARROW_DEFAULT_MEMORY_POOL": "system",
    "JE_ARROW_MALLOC_CONF": "background_thread:false",
}


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
        killed = _OUTSIDE_START.search(ended) is not None
        return Outcome(
            MissionState.UNREADABLE if killed else MissionState.CRASHED, ended, passing=killed, killed=killed
        )
    found = _left_by(work) if not ended.code else None
    if ended.code == child.NOT_WRITTEN or (found is not None and found["state"] == child.NOT_KEPT):
        raise OutputError((found["reason"] if found is not None else "") or os.strerror(errno.ENOSPC))
    if found is None:
        state, reason = _why(ended, _messages(work), limits, killed=memory_kills() > kills)
        killed = reason in (_NO_MEMORY_LEFT, _from_outside(-ended.code))
        return Outcome(
            state, reason, ended.wall_s + spent_s, ended.cpu_s, ended.peak_mb, passing=killed, killed=killed
        )  # fmt: skip
    state, reason = MissionState(found["state"]), found["reason"]
    if state is MissionState.OUT_OF_MEMORY:
        reason = _over_memory(limits, reason)
    return Outcome(
        state,
        reason,
        ended.wall_s + spent_s,
        ended.cpu_s,
        ended.peak_mb,
        summary=found["summary"],
        passing=found.get("passing", False),
    )


def _left_by(work: Work) -> ChildOutcome | None:
    """Outcome that a child has left; None where it left none."""
    try:
        found: ChildOutcome = orjson.loads((Path(work.folder) / child.OUTCOME).read_bytes())
    except (OSError, orjson.JSONDecodeError):
        return None
    return found


def _why(ended: Ended, messages: str, limits: Limits, *, killed: bool) -> tuple[MissionState, str]:
    """State and reason of a child that left no outcome."""
    over_cpu = limits.cpu_s is not None and ended.cpu_s >= limits.cpu_s
    if ended.stopped == "wall":
        return MissionState.TIMEOUT, over_time(limits)
    if ended.stopped == "memory" or ended.code == child.OUT_OF_MEMORY:
        return MissionState.OUT_OF_MEMORY, _over_memory(limits)
    if ended.code >= 0:
        return MissionState.CRASHED, f"its process ended with code {ended.code} and left no result{_place(messages)}"
    name = _signal_name(-ended.code)
    if name == "SIGXCPU" or (name == "SIGKILL" and over_cpu):
        return MissionState.TIMEOUT, f"took more than {limits.cpu_s:g} s of a processor; allow more with --cpu"
    if name == "SIGKILL":
        return (MissionState.OUT_OF_MEMORY, _NO_MEMORY_LEFT) if killed else (MissionState.UNREADABLE, _from_outside(9))
    if -ended.code in _OUTSIDE:
        return MissionState.UNREADABLE, _from_outside(-ended.code)
    if _NO_MEMORY.search(messages):
        return MissionState.OUT_OF_MEMORY, _over_memory(limits)
    if name == "SIGBUS":
        return (
            MissionState.CRASHED,
            f"its process ended with SIGBUS: a file became shorter while it was read{_place(messages)}",
        )
    return MissionState.CRASHED, f"its process ended with {name}{_place(messages)}"


def _from_outside(number: int) -> str:
    return f"its process was ended from outside by {_signal_name(number)}; audit again"


def over_time(limits: Limits) -> str:
    """Reason of a mission that took longer than it may."""
    return f"took longer than {limits.wall_s:g} s; allow more with --timeout"


def _over_memory(limits: Limits, place: str = "") -> str:
    return (
        f"needed more than {limits.memory_mb:.0f} MB of memory{f' {place}' if place else ''}; allow more with --memory"
    )


def _signal_name(number: int) -> str:
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


class ForkServer:
    """Children forked from a process that has imported and compiled everything, `fork_server`; it is started with the first mission, and again if it was lost.

    Parameters
    ----------
    warmed : bool
        Whether it runs a short simulated mission first; without, it starts sooner and each child takes longer.
    """

    def __init__(self, *, warmed: bool = True) -> None:
        self._warmed = warmed
        self._lock = threading.Lock()
        self._numbers = itertools.count()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._waiting: dict[int, Future[Ended | str]] = {}
        self.closed = False

    def run(self, work: Work, limits: Limits) -> Ended | str:
        """As in `Isolation`."""
        waiting: Future[Ended | str] = Future()
        with self._lock:
            if self.closed:
                raise Stopped
            number = next(self._numbers)
            if self._connection is None:
                self._start()
            assert self._connection is not None
            self._waiting[number] = waiting
            try:
                self._connection.send_bytes(pickle.dumps((number, work, limits)))
            except OSError:
                self._lose(self._connection)
        try:
            return waiting.result(limits.wall_s + _GRACE_S + (300.0 if self._warmed else 60.0))
        except TimeoutError:
            self._kill()
            return "the process that starts missions does not answer"

    def start(self) -> None:
        """As in `Isolation`."""
        with self._lock:
            if self._connection is None and not self.closed:
                self._start()

    def _start(self) -> None:
        ours, theirs = socket.socketpair()
        call = (
            "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from diagnosis.audit.isolation.fork_server import main; "
            f"main({theirs.fileno()}, {os.getpid()}, warmed={self._warmed})"
        )
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", call, json.dumps([p for p in sys.path if p])],
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **_ONE_THREAD},
            start_new_session=True,  # Ctrl-C is for the audit, which then ends this
        )
        theirs.close()
        self._connection = Connection(ours.detach())
        threading.Thread(target=self._listen, args=(self._connection,), daemon=True).start()

    def _listen(self, connection: Connection) -> None:
        try:
            while True:
                number, ended = connection.recv()
                with self._lock:
                    waiting = self._waiting.pop(number, None)
                if waiting is not None:
                    waiting.set_result(ended)
        except (EOFError, OSError, pickle.UnpicklingError):
            with self._lock:
                self._lose(connection)

    def _lose(self, connection: Connection) -> None:
        """Answer all who wait on a server that has ended."""
        if self._connection is not connection:
            return
        self._connection = None
        connection.close()
        how = "" if self.closed else self._end_of_server()
        waiting, self._waiting = self._waiting, {}
        for one in waiting.values():
            if self.closed:
                one.set_exception(Stopped())
            else:
                one.set_result(f"the process that starts missions ended {how}")

    def _end_of_server(self) -> str:
        assert self._process is not None
        try:
            code = self._process.wait(_CLOSE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        return f"with {_signal_name(-code)}" if code < 0 else f"with code {code}"

    def _kill(self) -> None:
        process = self._process
        if process is not None:
            process.kill()

    def close(self) -> None:
        """End the server; it ends its children and removes their folders first."""
        with self._lock:
            self.closed = True
            process, connection = self._process, self._connection
        if process is None or connection is None:
            return
        with suppress(OSError), socket.socket(fileno=os.dup(connection.fileno())) as end:
            end.shutdown(socket.SHUT_RDWR)
        process.terminate()  # heeded only while it starts and does not listen yet
        try:
            process.wait(_CLOSE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


_MADE: dict[tuple[str, int, str], Isolation] = {}
_MAKING = threading.Lock()


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
