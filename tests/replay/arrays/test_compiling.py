"""Kernels that a wheel brings are used where they fit, and nowhere else."""

from __future__ import annotations

import ast
import os
import platform
import re
import subprocess
import sys
from pathlib import Path

import pytest

from replay.arrays import compiling
from replay.arrays.compiling import njit
from replay.arrays.shipped_cache import KINDS, kind_of_this_machine, shipped_folder
from replay.arrays.shipped_kernels import collect, environment
from replay.progress import Progress, Stage, compiling_begins, tell_of_compiling

ROOT = Path(__file__).parents[3]
KERNEL = """
import sys
from pathlib import Path
import numpy as np
from replay.arrays import shipped_cache
from replay.progress import tell_of_compiling
shipped_cache.SHIPPED = Path(sys.argv[1])
shipped_cache.INSTALLED = Path(sys.argv[1]).parent
if "read only" in sys.argv:
    from numba.core import caching
    def fails(self):
        raise PermissionError("read-only file system")
    caching._CacheLocator.ensure_cache_path = fails
told = []
tell_of_compiling(told.append)
from replay.readers.mcap.numbers import u16
value = u16(np.array([1, 2, 3], dtype=np.uint8), 1)
print(int(value), sum(u16.stats.cache_hits.values()), sum(u16.stats.cache_misses.values()), len(told))
"""

pytestmark = pytest.mark.skipif(
    kind_of_this_machine() is None, reason=f"no common kind of processor is known for this {platform.machine()}"
)


def read(shipped: Path, *words: str, **variables: str) -> list[int]:
    """The kernel's value, how often it came out of a cache, how often it was compiled, how often that was told."""
    outer = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
    command = [sys.executable, "-c", KERNEL, str(shipped), *words]
    done = subprocess.run(
        command, cwd=ROOT, env=outer | variables, stdin=subprocess.DEVNULL, capture_output=True, check=True, text=True
    )
    return [int(word) for word in done.stdout.split()]


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shipped")
    assert read(folder, **environment(folder / "cache")) == [0x0302, 0, 1, 1]
    assert collect(folder / "cache", ROOT, folder / "compiled") == 2  # the index and one kernel
    assert {f.suffix for f in shipped_folder("replay.readers.mcap.numbers", folder / "compiled").iterdir()} == {
        ".nbi",
        ".nbc",
    }
    return folder / "compiled"


def test_a_fresh_installation_compiles_nothing_that_the_wheel_brings(shipped: Path, tmp_path: Path) -> None:
    assert read(shipped, NUMBA_CACHE_DIR=str(tmp_path)) == [0x0302, 1, 0, 0]
    assert not [f for f in tmp_path.rglob("*") if f.is_file()]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder `none` of no wheel, beside which this processor's kernel stands as an installation in place leaves it."""
    folder = tmp_path_factory.mktemp("installed")
    assert read(folder / "none", NUMBA_CACHE_DIR=str(folder / "cache")) == [0x0302, 0, 1, 1]
    beside = folder / "replay" / "readers" / "mcap" / "__pycache__"
    beside.mkdir(parents=True)
    for file in [f for f in (folder / "cache").rglob("*") if f.is_file()]:
        file.rename(beside / file.name)
    return folder / "none"


def test_with_an_empty_folder_of_caches_what_the_installation_compiled_is_used(installed: Path, tmp_path: Path) -> None:
    assert read(installed, NUMBA_CACHE_DIR=str(tmp_path)) == [0x0302, 1, 0, 0]
    assert not [f for f in tmp_path.rglob("*") if f.is_file()]


@pytest.mark.parametrize("variable", ["NUMBA_BOUNDSCHECK", "MFHCA_KERNELS"])
def test_a_compiler_that_is_told_otherwise_takes_nothing_from_the_installation(
    installed: Path, tmp_path: Path, variable: str
) -> None:
    value = {"NUMBA_BOUNDSCHECK": "1", "MFHCA_KERNELS": "0"}[variable]
    assert read(installed, NUMBA_CACHE_DIR=str(tmp_path), **{variable: value}) == [0x0302, 0, 1, 1]


def test_without_kernels_of_the_wheel_they_are_compiled_and_kept(tmp_path: Path) -> None:
    assert read(tmp_path / "none", NUMBA_CACHE_DIR=str(tmp_path)) == [0x0302, 0, 1, 1]
    assert read(tmp_path / "none", NUMBA_CACHE_DIR=str(tmp_path)) == [0x0302, 1, 0, 0]


def test_where_no_folder_can_be_written_kernels_are_used_and_none_is_kept(shipped: Path, tmp_path: Path) -> None:
    nowhere, kept = str(tmp_path / "nowhere"), str(tmp_path / "kept")
    assert read(shipped, "read only", NUMBA_CACHE_DIR=nowhere) == [0x0302, 1, 0, 0]
    assert read(tmp_path / "none", "read only", NUMBA_CACHE_DIR=nowhere) == [0x0302, 0, 1, 1]
    assert not Path(nowhere).exists()
    assert read(tmp_path / "none", NUMBA_CACHE_DIR=kept) == [0x0302, 0, 1, 1]
    assert read(tmp_path / "none", "read only", NUMBA_CACHE_DIR=kept) == [0x0302, 1, 0, 0]


@pytest.mark.parametrize(
    "variables", [{"NUMBA_BOUNDSCHECK": "1"}, {"NUMBA_CPU_NAME": "generic"}], ids=["checked", "other processor"]
)
def test_a_compiler_that_is_told_otherwise_takes_nothing_from_the_wheel(
    shipped: Path, tmp_path: Path, variables: dict[str, str]
) -> None:
    assert read(shipped, NUMBA_CACHE_DIR=str(tmp_path), **variables) == [0x0302, 0, 1, 1]


def test_kernels_of_other_sources_are_not_used(shipped: Path, tmp_path: Path) -> None:
    other = tmp_path / "compiled"
    folder = shipped_folder("replay.readers.mcap.numbers", other)
    folder.mkdir(parents=True)
    for file in shipped_folder("replay.readers.mcap.numbers", shipped).iterdir():
        data = file.read_bytes()
        if file.suffix == ".nbi":
            from hashlib import sha256

            stamp = sha256((ROOT / "replay/readers/mcap/numbers.py").read_bytes()).digest()
            assert stamp in data
            data = data.replace(stamp, sha256(b"an older release").digest())
        (folder / file.name).write_bytes(data)
    assert read(other, NUMBA_CACHE_DIR=str(tmp_path / "cache")) == [0x0302, 0, 1, 1]


def test_a_processor_without_what_a_kind_needs_runs_none_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    from llvmlite import binding

    kind_of_this_machine.cache_clear()
    monkeypatch.setattr(binding, "get_host_cpu_features", dict)
    found = kind_of_this_machine()
    kind_of_this_machine.cache_clear()
    assert found is None or not found.needs


def test_a_machine_of_no_known_kind_ships_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    assert environment(tmp_path) == {}
    assert "riscv64" not in KINDS


def test_the_first_compilation_alone_is_told() -> None:
    told: list[Progress] = []
    tell_of_compiling(told.append)
    compiling_begins()
    compiling_begins()
    assert [p.stage for p in told] == [Stage.COMPILING]


def test_a_kernel_may_be_decorated_either_way() -> None:
    @njit
    def one(x: int) -> int:
        return x + 1

    @njit(error_model="numpy")
    def two(x: int) -> int:
        return x + 2

    assert (one(1), two(1)) == (2, 3)


@pytest.mark.parametrize("first", ["Python", "a kernel"])
def test_what_is_compiled_for_kernels_alone_refuses_python(first: str) -> None:
    @njit(no_cpython_wrapper=True)
    def part(x: int) -> int:
        return x + 1

    @njit
    def whole(x: int) -> int:
        return int(part(x))

    if first == "a kernel":
        assert whole(1) == 2
    with pytest.raises(TypeError, match="part is called by kernels alone"):
        part(1)
    assert whole(1) == 2


def test_a_part_hands_on_to_no_kernel_that_it_is_put_into_its_callers() -> None:
    @njit
    def called(x: int) -> int:
        return x + 1

    @njit(forceinline=True)
    def part(x: int) -> int:
        return int(called(x))

    @njit
    def whole(x: int) -> int:
        return int(part(x))

    assert whole(1) == 2
    assert [k.overloads[k.signatures[0]].fndesc.inline for k in (called, part)] == [False, True]


_SLOW = re.compile(r"\.(max|min)\(\)| @ |np\.(argsort|sort|median|unique|dot)\(")


def test_no_kernel_uses_what_takes_seconds_to_compile() -> None:
    found = []
    for path in (p for folder in ("replay", "diagnosis") for p in sorted((ROOT / folder).rglob("*.py"))):
        if "njit(" not in (text := path.read_text("utf-8")):
            continue
        for part in ast.parse(text).body:
            if isinstance(part, ast.FunctionDef) and any("njit" in ast.unparse(d) for d in part.decorator_list):
                found += [f"{path.name}: {part.name}: {m[0]}" for m in _SLOW.finditer(ast.unparse(part))]
    assert not found


def test_with_caches_of_another_numba_kernels_are_compiled_and_kept_as_always(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "_cache_of", None)

    @njit(cache=True)
    def three(x: int) -> int:
        return x + 3

    assert three(1) == 4
    assert type(three._cache).__name__ == "FunctionCache"
