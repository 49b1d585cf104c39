"""Children from a fresh interpreter each: where a process cannot be forked safely. About two seconds slower each."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

from diagnosis.audit.isolation import child
from diagnosis.audit.isolation.child import Work
from diagnosis.audit.isolation.fork_server import POLL_S, Ended, Stopped
from diagnosis.audit.isolation.limits import Limits, held_mb

_TASK = "task.pickle"
_CALL = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from diagnosis.audit.isolation.fresh_process import main; main(sys.argv[2])"


class Spawner:
    """Starts one interpreter per mission."""

    def __init__(self) -> None:
        self._running: set[subprocess.Popen[bytes]] = set()
        self.closed = False

    def start(self) -> None:
        """Nothing can be made ready."""

    def run(self, work: Work, limits: Limits) -> Ended | str:
        """As in `diagnosis.audit.isolation.run.Isolation`.

        Raises
        ------
        Stopped
            Where the audit is asked to end meanwhile.
        """
        if self.closed:
            raise Stopped
        task = Path(work.folder) / _TASK
        start = time.monotonic()
        try:
            task.write_bytes(pickle.dumps((work, limits)))
            process = subprocess.Popen(
                [sys.executable, "-P", "-c", _CALL, json.dumps([p for p in sys.path if p]), str(task)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except OSError as error:
            return f"cannot start a process: {error.strerror or error}"
        self._running.add(process)
        stopped, peak = "", 0.0
        while process.poll() is None:
            held = held_mb(process.pid)
            peak = max(peak, held)
            if not stopped and held > limits.memory_mb + _PROGRAM_MB:
                stopped = "memory"
            if not stopped and time.monotonic() - start > limits.wall_s:
                stopped = "wall"
            if stopped or self.closed:
                process.kill()
            with suppress(subprocess.TimeoutExpired):
                process.wait(POLL_S)
        self._running.discard(process)
        assert process.stdin is not None
        process.stdin.close()
        if self.closed:
            raise Stopped
        return Ended(process.returncode, stopped, time.monotonic() - start, 0.0, peak)

    def close(self) -> None:
        """End all children."""
        self.closed = True
        for process in list(self._running):
            process.kill()


_PROGRAM_MB = 350.0


def main(task: str) -> None:
    """Entry of a child: it ends when the pipe from its parent closes."""
    work, limits = pickle.loads(Path(task).read_bytes())
    threading.Thread(target=_watch, args=(limits,), daemon=True).start()
    child.run(work, limits, os.getppid())


def _watch(limits: Limits) -> None:
    threading.Thread(target=_watch_memory, args=(limits.memory_mb + _PROGRAM_MB,), daemon=True).start()
    sys.stdin.buffer.read()
    os._exit(1)


def _watch_memory(most_mb: float) -> None:
    """End this process past its memory where the system has no limit to hold."""
    try:
        import resource
    except ImportError:  # Windows
        return
    unit = 1 << 20 if sys.platform == "darwin" else 1 << 10
    while resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit < most_mb or sys.platform == "linux":
        time.sleep(POLL_S)
    os._exit(child.OUT_OF_MEMORY)
