"""The end of a process: what is registered for it is done, what was printed arrives, and other threads are waited for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

_REGISTERED = """
import atexit, sys, tempfile
from cli.terminal.leaving import leave
folder = tempfile.TemporaryDirectory(dir=sys.argv[1])
atexit.register(print, "registered")
print("printed")
leave(3)
"""

_THREAD = """
import threading, time
from cli.terminal.leaving import leave
threading.Thread(target=lambda: (time.sleep(0.3), print("thread"))).start()
leave(1)
"""


@pytest.mark.parametrize(
    ("code", "status", "said"), [(_REGISTERED, 3, "printed\nregistered\n"), (_THREAD, 1, "thread\n")]
)
def test_nothing_that_was_to_be_done_is_lost(code: str, status: int, said: str, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", code, tmp_path], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (status, said, "")
    assert list(tmp_path.iterdir()) == []
