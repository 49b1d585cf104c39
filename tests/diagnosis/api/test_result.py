"""A diagnosis in Python says what the command line says, as tables and figures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import mfhca
from cli.main import run
from diagnosis.api.frames import FAULT_COLUMNS, faults_frame
from diagnosis.results.result import MissionResult
from diagnosis.results.vocabulary import Verdict


def test_verdict_and_exit_code(result: mfhca.Diagnosis) -> None:
    assert result.verdict.status == "stop"
    assert not result.verdict.cleared
    assert result.verdict.actions
    assert result.verdict.assumed  # the paper's machine stands in
    assert result.verdict.headline in str(result.verdict)
    assert [result.exit_code(s) for s in ("info", "low", "high", "never")] == [1, 1, 1, 0]
    with pytest.raises(mfhca.ConfigError, match="expected one of info, low, medium, high, never"):
        result.exit_code("severe")


def test_the_same_as_the_command_line(
    made: mfhca.MadeLog, result: mfhca.Diagnosis, saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["diagnose", str(made.log), "-o", str(tmp_path / "r"), "--json"]) == result.exit_code()
    printed = json.loads(capsys.readouterr().out)
    mine, theirs = ((p / "report.json").read_bytes() for p in (saved, tmp_path / "r"))
    assert mine == theirs
    assert [f["id"] for f in printed["intervals"]] == list(result.faults.index)
    assert {p.name for p in saved.iterdir()} == {p.name for p in (tmp_path / "r").iterdir()}


def test_faults_are_those_of_the_document(result: mfhca.Diagnosis, saved: Path) -> None:
    intervals = json.loads((saved / "report.json").read_text())["intervals"]
    faults = result.faults
    assert list(faults.columns) == list(FAULT_COLUMNS)
    assert list(faults.index) == [i["id"] for i in intervals]
    for (_, row), one in zip(faults.iterrows(), intervals, strict=True):
        assert (row["component"], row["side"], row["mode"]) == (one["component"], one["side"], one["mode"])
        assert (row["start"].value, row["stop"].value) == (one["start_ns"], one["stop_ns"])
        assert row["epsilon"] == pytest.approx(one["epsilon"]["value"] if one["epsilon"] else np.nan, nan_ok=True)


def test_no_faults_are_a_table_of_the_same_types(result: mfhca.Diagnosis) -> None:
    empty = faults_frame({**result.report, "intervals": []})
    assert empty.empty
    assert empty.dtypes.to_dict() == result.faults.dtypes.to_dict()


def test_states_leave_no_gap_and_coverage_counts_them(result: mfhca.Diagnosis) -> None:
    duration = result.report["log"]["duration_s"]
    spans = result.states.assign(seconds=result.states["stop_s"] - result.states["start_s"])
    assert_allclose(spans.groupby(["component", "side"])["seconds"].sum(), duration, atol=1e-6)
    assert_allclose(result.coverage.filter(like="seconds.").sum(axis=1), duration, atol=1e-6)


def test_signals_have_time_and_units(result: mfhca.Diagnosis) -> None:
    signals = result.signals
    assert signals.index.name == "t"
    assert_array_equal(signals["wheel.FR.v"], result.columns["wheel.FR.v"])
    units = signals.attrs["units"]
    assert set(units) == set(signals.columns)
    assert (units["wheel.FR.v"], units["steer.front.phi"], units["evidence.FR.sensor.probability"]) == (
        "m/s",
        "rad",
        "1",
    )
    assert result.closeups is None
    assert result.channels.loc["wheel.FR.v", "unit"] == "m/s"


def test_a_saved_result_shows_the_same(result: mfhca.Diagnosis, saved: Path) -> None:
    for place in (str(saved), saved, saved / "report.json"):
        again = mfhca.read_result(place)
        assert again.faults.equals(result.faults)
        assert again.states.equals(result.states)
        assert again.verdict == result.verdict
    lsb = result.channels.loc["wheel.FL.v", "lsb"]
    assert_allclose(again.signals["wheel.FL.v"], result.signals["wheel.FL.v"], rtol=1e-6, atol=lsb / 8)


def test_what_is_saved_again_is_the_same(saved: Path, tmp_path: Path) -> None:
    mfhca.read_result(saved).save(tmp_path / "copy")
    names = ("report.json", "report.html", "report.parquet")
    assert all((tmp_path / "copy" / n).read_bytes() == (saved / n).read_bytes() for n in names)


def test_a_notebook_sees_verdict_reason_and_faults(result: mfhca.Diagnosis) -> None:
    text = result._repr_html_()
    assert all(words in text for words in (result.verdict.headline, "FR speed sensor", "F1", ".plot_fault"))
    assert "<script" not in text
    assert repr(result) == f"<Diagnosis of known.mcap (18.0 s): {result.verdict.headline}; {len(result.faults)} faults>"


def test_names_from_logs_are_inert_in_a_notebook(result: mfhca.Diagnosis) -> None:
    report = result.report
    files = [{**report["log"]["files"][0], "path": "<script>alert(1)</script>\u202e.mcap"}]
    healthy: Any = {
        **report, "log": {**report["log"], "files": files}, "intervals": [],
        "verdict": {**report["verdict"], "status": Verdict.READY, "actions": []},
    }  # fmt: skip
    text = mfhca.Diagnosis(MissionResult(healthy, {}))._repr_html_()
    assert "<script" not in text
    assert "\u202e" not in text
    assert "No fault was found" in text


def test_previous_result_of_the_machine(made: mfhca.MadeLog, saved: Path) -> None:
    later = mfhca.diagnose(str(made.log), previous=str(saved), wheels="FR", start_s=1, stop_s=17)
    assert later.report["previous"]["mission"]["files"] == ["known.mcap"]
    assert {row["component"] for row in later.report["coverage"]} >= {"FR"}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"wheels": ["XX"]}, "wheels XX: no such wheel; the machine has FR, FL, RR, RL"),
        ({"start_s": -1.0}, "start_s -1: expected seconds"),
        ({"start_s": 5.0, "stop_s": 5.0}, "stop_s 5: must be later than start_s 5"),
        ({"machine": 5}, "5 is no path"),
        ({"machine": "no.toml"}, r"no\.toml: cannot read the machine file"),
    ],
)
def test_options_that_cannot_be(made: mfhca.MadeLog, options: dict[str, Any], words: str) -> None:
    with pytest.raises(mfhca.ConfigError, match=words):
        mfhca.diagnose(made.log, **options)


def test_logs_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(mfhca.LogError, match=r"no\.mcap: no such file"):
        mfhca.diagnose(str(tmp_path / "no.mcap"))
    with pytest.raises(mfhca.ConfigError, match="no log is given"):
        mfhca.diagnose([])
    with pytest.raises(mfhca.ConfigError, match="5 is no path"):
        mfhca.diagnose(5)  # type: ignore[arg-type]
    with pytest.raises(mfhca.LogError, match=r"holds no report\.json"):
        mfhca.read_result(tmp_path)
    (tmp_path / "report.json").write_text("{}")
    with pytest.raises(mfhca.LogError, match=r"report\.json"):
        mfhca.read_result(tmp_path)


def test_a_result_without_its_time_series(saved: Path, tmp_path: Path) -> None:
    (tmp_path / "report.json").write_bytes((saved / "report.json").read_bytes())
    with pytest.raises(mfhca.LogError, match=r"report\.parquet"):
        mfhca.read_result(tmp_path)


def test_a_folder_that_cannot_be_written(result: mfhca.Diagnosis, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(mfhca.OutputError):
        result.save(tmp_path / "file" / "report")
    with pytest.raises(mfhca.ConfigError, match="max-size"):
        result.save(tmp_path / "r", max_size_mb=0.1)


def test_a_machine_itself_or_its_file(made: mfhca.MadeLog, tmp_path: Path) -> None:
    sample = Path(__file__).parents[3] / "sample_logs" / "haulotte.toml"
    assert mfhca.load_machine(sample).id == "", "copied for several machines it would make them one"
    file = tmp_path / "haulotte.toml"
    file.write_text(sample.read_text(encoding="utf-8").replace("[machine]\n", '[machine]\nid = "lifter"\n'))
    machine = mfhca.load_machine(str(file))
    assert isinstance(machine, mfhca.Machine)
    by_object = mfhca.diagnose(made.log, machine=replace(machine, id="other"))
    by_file = mfhca.diagnose(made.log, machine=str(file))
    assert (by_object.report["machine"]["id"], by_file.report["machine"]["id"]) == ("other", "lifter")
    assert by_file.report["machine"]["source"] == "haulotte.toml"
    assert by_object.faults.equals(by_file.faults)
