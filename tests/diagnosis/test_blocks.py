"""A mission that runs in blocks, its columns in temporary files, gives the same result as one in a single piece."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.pipeline import diagnose
from diagnosis.results.result import MissionResult
from replay.arrays import blocks, envelope
from replay.arrays.column_store import ColumnStore
from replay.export.mission import write_mission
from replay.machine.config import haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("logs")


@cache
def log_of(folder: Path, evidence: str) -> Path:
    path = folder / f"{evidence}.mcap"
    options = SimulationOptions(scenario="random", seed=5, duration_s=20.0, evidence=evidence)  # type: ignore[arg-type]
    write_mission(simulate_mission(options), path, "mcap")
    return path


@cache
def in_one_piece(log: Path) -> MissionResult:
    return diagnose([log], haulotte())


def same(a: object, b: object, where: str = "") -> None:
    if isinstance(a, dict) and isinstance(b, dict):
        assert a.keys() == b.keys(), where
        for key in a:
            same(a[key], b[key], f"{where}/{key}")
    elif isinstance(a, list) and isinstance(b, list):
        assert len(a) == len(b), where
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            same(x, y, f"{where}[{i}]")
    elif isinstance(a, float) and isinstance(b, float):
        assert a == pytest.approx(b, rel=1e-7, abs=1e-12), where
    else:
        assert a == b, where


def in_blocks_of(steps: int, log: Path, monkeypatch: pytest.MonkeyPatch) -> MissionResult:
    store = ColumnStore(block=steps, always=10_000, room=0, flush=5_000)
    with monkeypatch.context() as patch:
        patch.setattr(blocks, "BLOCK", steps)
        return diagnose([log], haulotte(), store=store)


@pytest.mark.parametrize("evidence", ["base", "direct"])
def test_blocks_change_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch, evidence: str) -> None:
    log = log_of(folder, evidence)
    whole, cut = in_one_piece(log), in_blocks_of(3_301, log, monkeypatch)
    assert whole.report["intervals"], "a mission without faults shows little"
    same(whole.report, cut.report)
    assert whole.columns.keys() == cut.columns.keys()
    for name, values in whole.columns.items():
        assert_allclose(cut.columns[name], values, rtol=1e-6, atol=1e-9, err_msg=name)


def test_long_missions_show_envelopes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = log_of(folder, "direct")
    whole = in_one_piece(log)
    monkeypatch.setattr(envelope, "FULL_STEPS", 5_000)
    monkeypatch.setattr(envelope, "_BUCKETS", 3_000)
    short = diagnose([log], haulotte())
    assert short.report["log"].pop("samples_per_bucket") == 8
    same(whole.report, short.report)
    assert whole.columns.keys() == short.columns.keys()
    assert len(whole.columns["t"]) == 20_000
    rows = {len(x) for x in short.columns.values()}
    assert rows == {5_000}
    assert_allclose(np.diff(short.columns["t"]), 0.004)
    for name in ("wheel.FR.v", "evidence.FR.sensor.residual", "replay.FR.u"):
        buckets = whole.columns[name].reshape(-1, 8)
        assert_allclose(short.columns[name].reshape(-1, 2).max(axis=1), np.fmax.reduce(buckets, axis=1), rtol=1e-6)
