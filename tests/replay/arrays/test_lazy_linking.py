"""Kernels that come out of a cache: run at once, and compiled into others that call them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

_KERNELS = """
from replay.arrays.compiling import njit

@njit(cache=True)
def twice(x):
    return 2.0 * x

@njit(cache=True)
def more(x):
    return twice(x) + 1.0

@njit
def fresh(x):
    return more(x) + twice(x)
"""
_RUN = """
import kernels
print(kernels.more(1.5), sum(kernels.more.stats.cache_hits.values()))
library = next(iter(kernels.more.overloads.values())).library
print(library._bitcode is not None)
print(kernels.fresh(1.5))
print(library._bitcode is not None, library.get_pointer_to_function("no_such_function"))
"""


def _run(folder: Path) -> list[str]:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")}
    root = str(Path(__file__).parents[3])
    environment["PYTHONPATH"] = os.pathsep.join([str(folder), root])
    done = subprocess.run(
        [sys.executable, "-c", _RUN], capture_output=True, text=True, check=True, env=environment, cwd=folder
    )
    return done.stdout.splitlines()


def test_a_cached_kernel_runs_without_its_module_and_is_linked_into_what_calls_it(tmp_path: Path) -> None:
    (tmp_path / "kernels.py").write_text(_KERNELS, "utf-8")
    assert _run(tmp_path) == ["4.0 0", "False", "7.0", "False 0"]
    assert _run(tmp_path) == ["4.0 1", "True", "7.0", "False 0"]
