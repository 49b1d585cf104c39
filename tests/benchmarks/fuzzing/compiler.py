"""The compiler of kernels at work within a reading: its time is not the reader's."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from numba.core import event


class CompilerTime(event.Listener):
    """Counts what the compiler takes, and says when it begins and ends.

    Parameters
    ----------
    tell : Callable
        Gets ``compiling`` where it begins, and ``reading`` where it has ended, on the thread that wants the kernel.

    Attributes
    ----------
    cpu_s : float
        Time of a processor in the compiler so far [s].
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        self.cpu_s, self._tell, self._here = 0.0, tell, threading.local()
        self._lock, self._busy = threading.Lock(), 0
        event.register("numba:compile", self)

    def on_start(self, event: Any) -> None:
        """Begin; a kernel that calls others compiles them within its own."""
        here = self._here
        here.depth = getattr(here, "depth", 0) + 1
        if here.depth == 1:
            here.since = time.thread_time()
            with self._lock:
                self._busy += 1
                if self._busy == 1:
                    self._tell("compiling")

    def on_end(self, event: Any) -> None:
        """End."""
        here = self._here
        here.depth -= 1
        if here.depth == 0:
            with self._lock:
                self.cpu_s += time.thread_time() - here.since
                self._busy -= 1
                if self._busy == 0:
                    self._tell("reading")
