"""Every sample around faults, beside the envelopes of a long mission."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.output import WINDOWS, rebuild, write_result
from diagnosis.pipeline import diagnose
from diagnosis.results.evidence_columns import steps_around
from diagnosis.results.result import MissionResult
from replay.arrays import envelope
from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.export.mission import write_mission
from replay.machine.config import haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[MissionResult, MissionResult]:
    """One mission with all its samples, and taken for a long one."""
    log = tmp_path_factory.mktemp("log") / "direct.mcap"
    options = SimulationOptions(scenario="random", seed=5, duration_s=40.0, evidence="direct", steering_faults=True)
    write_mission(simulate_mission(options), log, "mcap")
    with pytest.MonkeyPatch.context() as patch:
        full = diagnose([log], haulotte())
        patch.setattr(envelope, "FULL_STEPS", 10_000)
        patch.setattr(envelope, "_BUCKETS", 6_000)
        patch.setattr("replay.arrays.blocks.BLOCK", 3_304)
        return full, diagnose([log], haulotte(), store=ColumnStore(block=3_304))


def test_both_edges_of_long_faults_and_the_whole_of_short_ones() -> None:
    step = steps_around([(5_000, 20_000), (30_000, 30_100)], 100_000, 0.001)
    assert [step[0], step[-1] + 1] == [3_000, 32_100]
    assert np.flatnonzero(np.diff(step) > 1).tolist() == [3_999, 7_999]


def test_steps_are_bounded_and_the_first_faults_come_first() -> None:
    faults = [(50_000, 50_010), (20_000, 20_010)]
    step = steps_around(faults, 100_000, 0.001, most=9_000)
    assert (step[0], step[-1]) == (48_000, 52_009)
    assert steps_around(faults, 100_000, 0.001, most=100).size == 0
    assert steps_around([(0, 10)], 1_000, 0.001).tolist() == list(range(1_000))


def test_closeups_hold_the_samples_that_a_short_mission_holds(results: tuple[MissionResult, MissionResult]) -> None:
    full, long = results
    assert full.windows is None
    assert long.windows is not None
    step, columns = long.windows.step, long.windows.columns
    assert {c.partition(".")[0] for c in columns} >= {"wheel", "steer", "replay", "evidence"}
    for name, values in columns.items():
        exact = full.columns[name][step]
        kept = np.isfinite(values)
        assert kept.any(), name
        assert_allclose(values[kept], exact[kept], rtol=1e-5, atol=1e-6, err_msg=name)
        if not name.startswith("evidence."):
            assert np.array_equal(kept, np.isfinite(exact)), name
    for fault in full.report["intervals"]:
        for at in (fault["start_s"], fault["stop_s"] - 1e-3):
            row = np.searchsorted(step, round(at * 1000))
            assert step[row] == round(at * 1000)
            sides = [s for s in ("sensor", "actuator") if fault["side"] in (s, "sensor_or_actuator")]
            name = next(f"evidence.{fault['component']}.{s}.expected" for s in sides)
            if name in full.columns and np.isfinite(full.columns[name][step[row]]):
                assert np.isfinite(columns[name][row])


def test_saved_closeups_make_the_same_page_again(results: tuple[MissionResult, MissionResult], tmp_path: Path) -> None:
    full, long = results
    *_, windows = write_result(long, tmp_path)
    assert windows.name == WINDOWS
    page = (tmp_path / "report.html").read_bytes()
    (tmp_path / "report.html").unlink()
    assert rebuild(tmp_path).read_bytes() == page
    windows.write_bytes((tmp_path / "report.parquet").read_bytes())
    with pytest.raises(LogError, match=r"report\.windows\.parquet: column 'step' is missing"):
        rebuild(tmp_path)
    write_result(full, tmp_path)
    assert not windows.exists()
