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


@pytest.mark.parametrize(("processors", "names"), [(2, ["diagnose", "simulate", "diagnose"]), (1, ["diagnose"])])
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
    monkeypatch.setattr(subprocess, "run", lambda command, **_: runs.append(command))
    monkeypatch.setattr(hook_module.os, "cpu_count", lambda: 2)
    monkeypatch.setattr(hook_module, "TemporaryDirectory", lambda: nullcontext(str(tmp_path)))
    _finish(hook_module, ROOT, "editable")
    monkeypatch.undo()
    own = [command for command in runs if str(tmp_path / "own.csv") in command]
    assert len(own) == 2
    assert [run(command[3:]) for command in own] == [0, 0]
    assert (tmp_path / "own" / "report.json").is_file()


def test_wheels_for_others_compile_nothing(hook_module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
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
