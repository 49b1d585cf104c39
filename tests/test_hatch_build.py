"""What an installation of the checkout does beyond copying: it compiles the kernels, and never fails for it."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from cli.main import run

ROOT = Path(__file__).parents[1]


@pytest.fixture
def hook_module() -> ModuleType:
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class _Told:
    def __init__(self) -> None:
        self.lines: list[str] = []

    def display_info(self, line: str) -> None:
        self.lines.append(line)


def _finish(module: ModuleType, root: Path, version: str) -> list[str]:
    told = _Told()
    module.KernelHook(str(root), {}, None, None, "", "wheel", told).finalize(version, {}, "")
    return told.lines


@pytest.mark.parametrize(("processors", "names"), [(2, ["diagnose", *["simulate", "diagnose"] * 2]), (1, ["diagnose"])])
def test_an_editable_installation_runs_the_first_diagnosis(
    hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch, processors: int, names: list[str]
) -> None:
    runs: list[tuple[list[str], dict[str, Any]]] = []
    monkeypatch.setattr(subprocess, "run", lambda command, **options: runs.append((command, options)))
    monkeypatch.setattr(hook_module.os, "cpu_count", lambda: processors)
    told = _finish(hook_module, ROOT, "editable")
    assert sorted(command[4] for command, _ in runs) == sorted(names)
    sample = str(ROOT / "sample_logs" / "three_faults.mcap")
    assert sum(sample in command for command, _ in runs) == 1
    for command, options in runs:
        assert command[:4] == [sys.executable, "-m", "cli.main", "-q"]
        assert options["cwd"] == str(ROOT)
    assert len(told) == 1


def test_what_an_installation_runs_ends_well(
    hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    runs: list[list[str]] = []
    folders: list[str | None] = []

    def noted(command: list[str], **options: Any) -> None:
        runs.append(command)
        folders.append(options["env"].get("NUMBA_CACHE_DIR"))

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(subprocess, "run", noted)
    monkeypatch.setattr(hook_module.os, "cpu_count", lambda: 2)
    monkeypatch.setattr(hook_module, "TemporaryDirectory", lambda: nullcontext(str(tmp_path)))
    _finish(hook_module, ROOT, "editable")
    monkeypatch.undo()
    assert folders == [None] * 5  # beside the sources, where every run looks
    own = [command for command in runs if str(tmp_path / "own.csv") in command]
    assert len(own) == 2
    assert [run(command[3:]) for command in own] == [0, 0]
    assert (tmp_path / "own" / "report.json").is_file()


def _build(module: ModuleType, version: str, target: str = "wheel") -> tuple[dict[str, Any], list[str]]:
    told, data = _Told(), {"force_include": {}}
    hook = module.KernelHook(str(ROOT), {}, None, None, "", target, told)
    hook.initialize(version, data)
    hook.finalize("standard", data, "")  # what it compiled into goes
    assert not any(Path(source).parent.exists() for source in data["force_include"])
    return data, told.lines


def test_a_wheel_brings_kernels_of_a_common_kind_of_processor(
    hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs: list[tuple[list[str], dict[str, str] | None]] = []

    def runs_well(command: list[str], **options: Any) -> subprocess.CompletedProcess[bytes]:
        runs.append((command, options["env"]))
        assert options["cwd"] == str(ROOT)
        answer = b"NUMBA_CACHE_DIR=/cache\nNUMBA_CPU_NAME=common\nNUMBA_CPU_FEATURES=\n" if "-c" in command else b""
        return subprocess.CompletedProcess(command, 0, answer)

    monkeypatch.setenv("NUMBA_OPT", "0")
    monkeypatch.setattr(subprocess, "run", runs_well)
    data, told = _build(hook_module, "standard")
    (source,) = data["force_include"]
    assert data["force_include"][source] == "replay/compiled"
    assert len(told) == 1
    ours = [(command[4], environment) for command, environment in runs if "cli.main" in command]
    assert [name for name, _ in ours] == ["simulate", "diagnose"] * len(hook_module._LOGS)
    for _, environment in ours:
        assert environment is not None
        assert environment["NUMBA_CPU_NAME"] == "common"
        assert "NUMBA_OPT" not in environment
    assert runs[-1][0][1:3] == ["-m", "replay.arrays.shipped_kernels"]
    assert runs[-1][0][4] == source


@pytest.mark.parametrize(("version", "target"), [("editable", "wheel"), ("standard", "sdist")])
def test_nothing_but_a_wheel_brings_kernels(
    hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch, version: str, target: str
) -> None:
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("compiled"))
    assert _build(hook_module, version, target) == ({"force_include": {}}, [])


def test_compiling_can_be_turned_off(hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MFHCA_KERNELS", "0")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("compiled"))
    assert _build(hook_module, "standard") == ({"force_include": {}}, [])
    assert _finish(hook_module, ROOT, "editable") == []
    assert hook_module.KernelHook(str(ROOT), {}, None, None, "", "wheel", _Told()).dependencies() == []


@pytest.mark.parametrize("answer", [b"", None], ids=["a processor of no known kind", "packages are not there"])
def test_a_wheel_that_cannot_be_compiled_is_made_all_the_same(
    hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch, answer: bytes | None
) -> None:
    def runs(command: list[str], **_: object) -> subprocess.CompletedProcess[bytes]:
        if answer is None:
            raise subprocess.CalledProcessError(1, command)
        return subprocess.CompletedProcess(command, 0, answer)

    monkeypatch.setattr(subprocess, "run", runs)
    data, told = _build(hook_module, "standard")
    assert data == {"force_include": {}}
    assert told[-1] == "not compiled now; the first diagnosis does it"


def test_wheels_compile_nothing_once_they_are_made(hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("compiled"))
    assert _finish(hook_module, ROOT, "standard") == []


def test_a_source_without_sample_logs_compiles_nothing(hook_module: ModuleType, tmp_path: Path) -> None:
    assert _finish(hook_module, tmp_path, "editable") == []


def test_an_installation_without_the_packages_says_so_and_ends_well(
    hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(command: list[str], **_: object) -> None:
        raise subprocess.CalledProcessError(1, command)

    monkeypatch.setattr(subprocess, "run", fails)
    assert _finish(hook_module, ROOT, "editable")[-1] == "not compiled now; the first diagnosis does it"


def test_the_sources_are_found_where_pipx_asks_for_a_safe_path(
    hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "beside.py").write_text("print('found')")
    monkeypatch.setenv("PYTHONSAFEPATH", "1")
    hook = hook_module.KernelHook(str(tmp_path), {}, None, None, "", "wheel", _Told())
    assert hook._python("-m", "beside").stdout.split() == [b"found"]
