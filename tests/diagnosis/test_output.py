"""Three files of one result, and the page made again from two of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import orjson
import pyarrow.parquet as pq
import pytest

from diagnosis.output import load_report, load_result, rebuild, write_result
from diagnosis.pipeline import diagnose_mission
from diagnosis.results.document import SCHEMA
from diagnosis.results.result import MissionResult
from replay.errors import LogError, OutputError
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.mission import Mission
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign


@pytest.fixture(scope="module")
def result() -> MissionResult:
    mission = simulate_mission(SimulationOptions(scenario="healthy", seed=3, duration_s=12.0, rate_hz=200.0))
    items = {
        name: Signal(name, mission.stamps, x, SignalSource(column=name), "a.mcap", guessed=False)
        for name, x in mission.columns.items()
    }
    signals = Signals(items, {})
    return diagnose_mission(Mission((), signals, align(signals)), haulotte())


def test_three_files(result: MissionResult, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "mission-report"
    paths = write_result(result, folder)
    assert [p.name for p in paths] == ["report.html", "report.json", "report.parquet"]
    assert sorted(p.name for p in folder.iterdir()) == sorted(p.name for p in paths)
    assert load_report(folder / "report.json") == result.report
    loaded = load_result(folder / "report.json").columns
    assert list(loaded) == list(result.columns)
    for name in ("t", "wheel.FR.v", "evidence.FR.sensor.residual", "replay.RL.psi_printed", "replay.RL.u"):
        stored, exact = loaded[name], result.columns[name]
        extent = np.ptp(np.nan_to_num(exact)) / 1024
        np.testing.assert_allclose(stored, exact, rtol=1e-3, atol=extent + 1e-9, equal_nan=True)
    for name in loaded:
        nan = np.isnan(loaded[name])
        np.testing.assert_array_equal(nan, np.isnan(result.columns[name]), err_msg=name)


def test_page_made_again_is_the_same_page(result: MissionResult, tmp_path: Path) -> None:
    page, report, _ = write_result(result, tmp_path)
    first = page.read_bytes()
    page.unlink()
    assert rebuild(tmp_path).read_bytes() == first
    assert rebuild(report).read_bytes() == first


def test_same_result_same_bytes(result: MissionResult, tmp_path: Path) -> None:
    one = [p.read_bytes() for p in write_result(result, tmp_path / "a")]
    two = [p.read_bytes() for p in write_result(result, tmp_path / "b")]
    assert one == two


def test_place_that_cannot_be_written(result: MissionResult, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(OutputError, match=r"taken.*cannot make the folder.*-o"):
        write_result(result, tmp_path / "taken" / "report")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read"),
        (b"{", "not JSON"),
        (b"[]", "schema array found"),
        (b'{"schema": "other/1"}', f"schema 'other/1' found, '{SCHEMA}' expected"),
    ],
)
def test_saved_report_that_is_none(tmp_path: Path, content: bytes | None, words: str) -> None:
    path = tmp_path / "report.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(LogError) as caught:
        load_report(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def test_report_without_its_columns(result: MissionResult, tmp_path: Path) -> None:
    (tmp_path / "report.json").write_bytes(orjson.dumps(result.report))
    with pytest.raises(LogError, match=r"report\.parquet: cannot be read.*mfhca diagnose"):
        rebuild(tmp_path)
    (tmp_path / "report.parquet").write_bytes(b"PAR1 no table")
    with pytest.raises(LogError, match=r"report\.parquet: cannot be read"):
        rebuild(tmp_path)


def test_saved_columns_whose_clock_is_damaged(result: MissionResult, tmp_path: Path) -> None:
    _, _, parquet = write_result(result, tmp_path)
    table = pq.read_table(parquet)
    t = table["t"].to_numpy().copy()
    t[100] += 0.3
    pq.write_table(table.set_column(table.column_names.index("t"), "t", [t]), parquet)
    with pytest.raises(LogError, match=r"report\.parquet: column 't' is not uniform") as caught:
        rebuild(tmp_path)
    assert type(caught.value) is LogError  # foreseen


@pytest.mark.parametrize("kind", campaign([np.int8, np.float16, np.uint16, np.int64], 2))
def test_saved_columns_of_other_numbers_are_read(result: MissionResult, tmp_path: Path, kind: type) -> None:
    _, _, parquet = write_result(result, tmp_path)
    table = pq.read_table(parquet)
    column = np.zeros(table.num_rows, kind)
    pq.write_table(table.set_column(table.column_names.index("wheel.FR.v"), "wheel.FR.v", [column]), parquet)
    assert rebuild(tmp_path).stat().st_size > 100_000


def test_full_disk_leaves_the_earlier_result_whole(
    result: MissionResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_result(result, tmp_path)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    def full(*_: object, **__: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("diagnosis.output.build_page", full)
    newer = MissionResult({**result.report, "tool": {"name": "mfhca-replay", "version": "9"}}, result.columns)
    with pytest.raises(OutputError, match="No space left on device"):
        write_result(newer, tmp_path)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_comparison_is_kept_with_the_result(result: MissionResult, tmp_path: Path) -> None:
    older = {**result.report, "log": {**result.report["log"], "start_ns": result.report["log"]["start_ns"] - 10**12}}
    page, report, _ = write_result(result, tmp_path)
    rebuild(tmp_path, previous=(Path("monday"), older))
    kept = load_report(report)
    assert kept["previous"]["order"] == "earlier"
    assert {k: v for k, v in kept.items() if k != "previous"} == result.report
    with_it = page.read_bytes()
    rebuild(tmp_path)
    assert page.read_bytes() == with_it
