"""Fixtures shared by all tests."""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# As in the command: threads of the linear algebra spin while they wait, and its products are small. Before numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from replay.arrays.kernel_cache import drop_own_stale_kernels
from tests.campaigns import long_ones

# Examples are not timed: other work on the machine, such as compiling, would fail them.
settings.register_profile("short", deadline=None, max_examples=40)
settings.register_profile("long", deadline=None, max_examples=200)

# Many commands and children are started: bytecode is kept, or each would compile everything that it imports once more.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# As in the command: looking for cycles after every 700 objects took a third of what collecting the tests takes.
gc.set_threshold(50_000, 10, 10)

ROOT = Path(__file__).resolve().parent.parent


def pytest_addoption(parser: pytest.Parser) -> None:
    """What `--long` adds."""
    parser.addoption("--long", action="store_true", help="also tests that repeat a proof over many seeds and machines")


def pytest_configure(config: pytest.Config) -> None:
    """Let no test run what was compiled from former sources; choose how many examples a property is tried on."""
    drop_own_stale_kernels()
    settings.load_profile("long" if config.getoption("--long") else "short")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the long tests out where they are not asked for."""
    if config.getoption("--long"):
        return
    left_out = long_ones(items)
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        apart = set(left_out)
        items[:] = [item for item in items if item not in apart]


@pytest.fixture(scope="session")
def reference_data() -> Path:
    """Folder with recorded logs and fault data; tests that need it skip where it is absent."""
    folder = Path(os.environ.get("MFHCA_REFERENCE_DATA", "../shared"))
    folder = folder if folder.is_absolute() else ROOT / folder
    if not (folder / "reference_logs").is_dir():
        pytest.skip(f"no reference data at {folder}; set MFHCA_REFERENCE_DATA to run this test")
    return folder
