"""The end of a process, without taking apart what the system frees at once."""

from __future__ import annotations

import atexit
import os
import sys
import threading
from typing import NoReturn


def leave(code: int) -> NoReturn:
    """End the process with an exit code, after everything that is registered for its end.

    Python then takes every module and object apart, and the compiler its code, for memory that goes
    with the process: over half a second of CPU time after a diagnosis. Where other threads still run, they are waited for in Python's own way.

    Raises
    ------
    SystemExit
        Where other threads run, or what was written cannot be handed on.
    """
    if threading.active_count() > 1:
        sys.exit(code)
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except (OSError, ValueError):
        sys.exit(code)
    os._exit(code)
