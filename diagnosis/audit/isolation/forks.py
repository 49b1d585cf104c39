"""The audit's end of the fork server: starts it, hands it missions, and tells what came of each."""

from __future__ import annotations

import itertools
import json
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
from concurrent.futures import Future
from contextlib import suppress
from multiprocessing.connection import Connection

from diagnosis.audit.isolation.child import Work
from diagnosis.audit.isolation.fork_server import TERMINATED, Ended, Stopped
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.isolation.why import NO_ANSWER, signal_name

_GRACE_S = 30.0
_CLOSE_S = 2.0
# One thread for each child: missions run beside each other, and a process with one thread may be forked.
_ONE_THREAD = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "ARROW_DEFAULT_MEMORY_POOL": "system",
    "JE_ARROW_MALLOC_CONF": "background_thread:false",
}


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
        """As in `diagnosis.audit.isolation.run.Isolation`.

        Raises
        ------
        Stopped
            Where the audit is asked to end meanwhile.
        """
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
            return NO_ANSWER

    def start(self) -> None:
        """As in `diagnosis.audit.isolation.run.Isolation`."""
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
        if code == TERMINATED:
            code = -signal.SIGTERM
        return f"with {signal_name(-code)}" if code < 0 else f"with code {code}"

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
