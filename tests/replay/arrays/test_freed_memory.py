"""Memory that a process keeps: what it may hold after it has freed much, and that it says where nothing can be set."""

from __future__ import annotations

import subprocess
import sys

import pytest

from replay.arrays import freed_memory

_ASKED = """
import numpy as np
from replay.arrays.freed_memory import keep_freed_memory

def faults():
    with open("/proc/self/stat") as file:
        return int(file.read().rsplit(")", 1)[1].split()[7])

kept = keep_freed_memory()
for _ in range(3):
    columns = [np.ones(200_000) for _ in range(10)]
    del columns
before = faults()
for _ in range(20):
    columns = [np.ones(200_000) for _ in range(10)]
    del columns
print(kept, faults() - before < 1000)
"""

_GIVEN_BACK = """
import numpy as np
from replay.arrays.freed_memory import give_back, keep_freed_memory

def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

keep_freed_memory()
columns = [np.ones(200_000) for _ in range(40)]
del columns[::2]  # as much again is in use between them
before = resident()
print(not give_back() or before - resident() > 10_000_000)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="a function of glibc")
def test_pages_between_columns_in_use_are_given_back() -> None:
    done = subprocess.run([sys.executable, "-c", _GIVEN_BACK], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


@pytest.mark.skipif(sys.platform != "linux", reason="a setting of glibc")
def test_pages_of_freed_columns_are_used_again() -> None:
    done = subprocess.run([sys.executable, "-c", _ASKED], capture_output=True, text=True, check=True)
    assert done.stdout in ("True True\n", "False False\n", "False True\n")  # musl has no such setting


def test_nothing_is_set_on_another_system(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    assert not freed_memory.keep_freed_memory()
    assert not freed_memory.give_back()
