"""Fork server: a process that has imported and compiled everything once, and forks a child per mission.

It has one thread, so that forking it is safe. It gets its work over a socket, watches its children's time and
memory, and when the socket closes, because the audit has ended in whichever way, it ends the children, removes their
folders and ends itself.
"""

from __future__ import annotations

import gc
import importlib
import os
import pickle
import select
import shutil
import signal
import socket
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection

from diagnosis.audit.isolation import child
from diagnosis.audit.isolation.child import Work
from diagnosis.audit.isolation.limits import Limits, follow, held_mb
from diagnosis.audit.store.folders import swept_folder

POLL_S = 0.05
TERMINATED = 128 + signal.SIGTERM
"""Exit code of a server that was ended by SIGTERM while it started, and has removed what it had made."""
_STUCK_S = 10.0


class Stopped(Exception):
    """Children were ended because the audit ends: no end of a mission."""


@dataclass(frozen=True)
class Ended:
    """How a child ended.

    Attributes
    ----------
    code : int
        Exit code, or the negative number of the signal.
    stopped : str
        Limit at which it was stopped from outside: ``wall`` or ``memory``; else empty.
    wall_s, cpu_s, peak_mb : float
        What it took.
    """

    code: int
    stopped: str = ""
    wall_s: float = 0.0
    cpu_s: float = 0.0
    peak_mb: float = 0.0


@dataclass
class _Child:
    number: int
    work: Work
    limits: Limits
    base_mb: float
    start: float = field(default_factory=time.monotonic)
    stopped: str = ""
    stopped_at: float = 0.0
    answered: bool = False
    peak_mb: float = 0.0


class ServerLoop:
    """The server's loop over requests and children."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._children: dict[int, _Child] = {}
        self._wake, woken = socket.socketpair()
        for end in (self._wake, woken):
            end.setblocking(False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(woken.fileno(), warn_on_full_buffer=False)
        self._woken = woken
        self._ends: list[Connection | socket.socket] = [connection, self._wake]

    def serve(self) -> None:
        """Serve until the other end closes."""
        try:
            while self._step():
                pass
        except (EOFError, OSError):
            pass
        finally:
            self._end_children()

    def _step(self) -> bool:
        wait = POLL_S if self._children else None
        ready, _, _ = select.select(self._ends, [], [], wait)
        if self._wake in ready:
            with suppress(BlockingIOError):
                self._wake.recv(4096)
        self._reap()
        self._watch()
        if self._connection in ready:
            self._fork(*pickle.loads(self._connection.recv_bytes()))
        return True

    def _fork(self, number: int, work: Work, limits: Limits) -> None:
        me = os.getpid()
        try:
            pid = os.fork()
        except OSError as error:
            self._connection.send((number, f"cannot start a process: {error.strerror}"))
            return
        if pid == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            os.setpgid(0, 0)
            for end in (self._connection, self._wake, self._woken):
                end.close()
            child.run(work, limits, me)
        with suppress(OSError):  # on both sides: whichever comes first
            os.setpgid(pid, pid)
        self._children[pid] = _Child(number, work, limits, held_mb(me))

    def _reap(self) -> None:
        for pid in list(self._children):
            done, status, used = os.wait4(pid, os.WNOHANG)
            if done:
                one = self._children.pop(pid)
                _kill(pid)  # what it may have started
                wall, peak = time.monotonic() - one.start, max(one.peak_mb, used.ru_maxrss / 1024)
                code = os.waitstatus_to_exitcode(status)
                self._answer(one, Ended(code, one.stopped, wall, used.ru_utime + used.ru_stime, peak))

    def _answer(self, one: _Child, ended: Ended) -> None:
        if not one.answered:
            one.answered = True
            self._connection.send((one.number, ended))

    def _watch(self) -> None:
        now = time.monotonic()
        for pid, one in self._children.items():
            held = held_mb(pid)
            one.peak_mb = max(one.peak_mb, held)
            if one.stopped:
                if now - one.stopped_at > _STUCK_S:  # within the system, as on a server that is gone: it ends some time
                    self._answer(one, Ended(-signal.SIGKILL, one.stopped, now - one.start, 0.0, one.peak_mb))
                continue
            if held - one.base_mb > one.limits.memory_mb:
                one.stopped = "memory"
            elif now - one.start > one.limits.wall_s:
                one.stopped = "wall"
            if one.stopped:
                one.stopped_at = now
                _kill(pid)

    def _end_children(self) -> None:
        for pid in self._children:
            _kill(pid)
        for pid, one in self._children.items():
            with suppress(ChildProcessError):
                os.waitpid(pid, 0)
            for folder in (one.work.temporary, one.work.folder):
                shutil.rmtree(folder, ignore_errors=True)


def _kill(group: int) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(group, signal.SIGKILL)


def warm() -> None:
    """Import what a mission needs, and diagnose a short simulated one, so that compiled scans and the page are loaded."""
    from replay.machine.config import haulotte
    from replay.warm_up import write_warm_up_log

    with swept_folder() as folder:
        log = folder / "warm.mcap"
        write_warm_up_log(log)
        child.judge(Work((str(log),), haulotte(), "", "", "", str(folder), str(folder)))


def main(descriptor: int, parent: int, *, warmed: bool) -> None:
    """Entry of the server's process."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # the audit decides when it ends
    asked: list[int] = []

    def end(number: int, _: object) -> None:
        asked.append(number)
        sys.exit(TERMINATED)

    signal.signal(signal.SIGTERM, end)
    follow(signal.SIGTERM)  # while it does not listen to its socket
    if os.getppid() != parent:
        os._exit(1)
    try:
        importlib.import_module("diagnosis.pipeline")
        importlib.import_module("diagnosis.output")
        importlib.import_module("replay.readers.registry").load_readers()
        if warmed:
            with suppress(Exception):  # each child then loads what it needs; what is wrong shows there
                warm()
    finally:
        if asked:  # a compiled module that is being imported makes an error of its own of that exit
            sys.exit(TERMINATED)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    follow(0)
    gc.collect()
    gc.freeze()
    ServerLoop(Connection(descriptor)).serve()
    os._exit(0)
