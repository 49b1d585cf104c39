"""Columns that a file of columns does not hold, and how they come back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import orjson
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from diagnosis.output import load_result, write_result
from diagnosis.results.restored import KEY, Layout, difference, restored, sources_of
from diagnosis.results.result import MissionResult
from diagnosis.results.stored import grids_of, stored
from replay.errors import LogError
from tests.report_samples import five_faults

RNG = np.random.default_rng(3)
V, REF = (np.cumsum(RNG.normal(size=5000)) / 100 for _ in range(2))


def _kept(exact: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    steps = grids_of(exact, {})
    return {k: stored(k, v, steps[k]) for k, v in exact.items()}, steps


def test_a_difference_comes_back_to_a_step_of_its_grid() -> None:
    exact = {"wheel.a.b.v": V, "replay.a.b.v_ref": REF, "replay.a.b.e": V - REF}
    kept, steps = _kept(exact)
    sources = sources_of(exact, kept, steps)
    assert sources == {"replay.a.b.e": ("wheel.a.b.v", "replay.a.b.v_ref")}
    own = {k: v for k, v in kept.items() if k not in sources}
    again = restored(own, Layout(list(kept), sources))
    assert list(again) == list(exact)
    assert np.abs(again["replay.a.b.e"] - exact["replay.a.b.e"]).max() <= 1.001 * steps["replay.a.b.e"]


def test_a_small_residual_of_a_steering_angle_comes_back_from_an_expected_angle_as_fine() -> None:
    expected = np.repeat(np.cumsum(RNG.normal(size=500)) / 10, 10)
    phi = expected + 1e-3 * RNG.normal(size=5000)
    names = "evidence.front.sensor.residual", "steer.front.phi", "evidence.front.sensor.expected"
    exact = dict(zip(names, (phi - expected, phi, expected), strict=True))
    steps = grids_of(exact, {"steer.front.phi": 2.5e-4})
    assert steps[names[2]] == steps[names[0]] == steps[names[1]] == 2.0**-14
    kept = {k: stored(k, v, steps[k]) for k, v in exact.items()}
    assert sources_of(exact, kept, steps) == {names[0]: names[1:]}
    assert np.abs(difference(kept[names[1]], kept[names[2]]) - exact[names[0]]).max() <= 1.001 * steps[names[0]]


def test_both_sides_of_a_part_stand_once_and_no_others() -> None:
    exact = {f"evidence.{part}.{side}.residual": REF for part in ("front", "rear") for side in ("sensor", "actuator")}
    sources = sources_of(exact, *_kept(exact))
    assert sources == {f"evidence.{p}.actuator.residual": (f"evidence.{p}.sensor.residual",) for p in ("front", "rear")}
    assert sources_of(exact, *_kept(exact), among={"evidence.rear.actuator.residual"}).keys() == {
        "evidence.rear.actuator.residual"
    }


@pytest.mark.parametrize("change", [0.2, np.nan, np.inf])
def test_what_is_no_difference_at_one_sample_is_held(change: float) -> None:
    e = V - REF
    e[777] += change
    exact = {"wheel.FL.v": V, "replay.FL.v_ref": REF, "replay.FL.e": e}
    assert sources_of(exact, *_kept(exact)) == {}


def test_a_difference_where_its_sources_have_no_sample_is_held() -> None:
    v = V.copy()
    v[100:200] = np.nan
    exact = {"wheel.FL.v": v, "replay.FL.v_ref": REF, "replay.FL.e": V - REF}
    assert sources_of(exact, *_kept(exact)) == {}


def test_a_saved_result_gives_all_columns_and_an_older_one_too(tmp_path: Path) -> None:
    report, columns = five_faults(20.0, 20.0)
    residual = np.random.default_rng(1).normal(size=len(columns["t"])).astype(np.float32)
    twice = {**columns, **{f"evidence.front.{side}.residual": residual for side in ("sensor", "actuator")}}
    write_result(MissionResult(report, twice), tmp_path)
    held = pq.read_table(tmp_path / "report.parquet")
    assert "evidence.front.actuator.residual" not in held.column_names
    loaded = load_result(tmp_path / "report.json").columns
    assert list(loaded) == list(twice)
    first, second = (loaded[f"evidence.front.{side}.residual"] for side in ("sensor", "actuator"))
    np.testing.assert_array_equal(first, second)
    pq.write_table(pa.table(loaded), tmp_path / "report.parquet")
    older = load_result(tmp_path / "report.json")
    assert older.layout is None
    assert all(np.array_equal(older.columns[k], loaded[k], equal_nan=True) for k in twice)


@pytest.mark.parametrize(
    "said",
    [
        b"{",
        b"[1]",
        b"\xff",
        orjson.dumps({"columns": ["t"], "made_of": [["t"]], "steps": {}}),
        orjson.dumps({"columns": ["t"], "made_of": {"x": ["absent"]}, "steps": {}}),
        orjson.dumps({"columns": ["t"], "made_of": {"x": ["t", 1]}, "steps": {}}),
        orjson.dumps({"columns": ["t"], "made_of": {"x": ["t", "t", "t"]}, "steps": {}}),
        orjson.dumps({"columns": ["t"], "made_of": {f"x{i}": ["t"] for i in range(999)}, "steps": {}}),
        b"[" * 100_000,
    ],
)
def test_metadata_that_make_no_sense_are_told(tmp_path: Path, said: bytes) -> None:
    report, columns = five_faults(20.0, 20.0)
    write_result(MissionResult(report, columns), tmp_path)
    table = pq.read_table(tmp_path / "report.parquet").replace_schema_metadata({KEY: said})
    pq.write_table(table, tmp_path / "report.parquet")
    with pytest.raises(LogError, match=r"report\.parquet: cannot be read"):
        load_result(tmp_path / "report.json")


def test_names_in_the_metadata_that_are_no_columns_are_passed_over() -> None:
    said = {
        "columns": ["gone", 3, "x", "t", "t"],
        "made_of": {"x": ["t"]},
        "steps": {"t": 0.5, "gone": 1, "u": "a", "x": -1},
    }
    assert Layout.stated(orjson.dumps(said), ["t", "u"]) == Layout(["x", "t", "u"], {"x": ("t",)}, {"t": 0.5})
    assert Layout.stated(None, ["t"]) == Layout(["t"])


def test_differences_of_what_is_absurd_make_no_error() -> None:
    both = np.array([np.inf, 3e38, np.nan], np.float32)
    assert not np.isfinite(difference(both, -both)).any()
