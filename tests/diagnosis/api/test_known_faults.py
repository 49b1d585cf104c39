"""Known faults from Python: simulated and injected, scored and audited as on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import mfhca
from cli.main import run


def test_a_simulated_log_is_that_of_the_command_line(tmp_path: Path) -> None:
    made = mfhca.simulate(
        str(tmp_path / "a.mcap"), seed=3, duration_s=2, settings={"K": 1.6}, faults=["FR sensor stuck 1 2"]
    )
    words = ["simulate", "-o", str(tmp_path / "b.mcap"), "--seed", "3", "--duration", "2", "--set", "K=1.6"]
    assert run([*words, "--fault", "FR sensor stuck 1 2", "-q"]) == 0
    assert made.log.read_bytes() == (tmp_path / "b.mcap").read_bytes()
    assert made.truth_file.read_bytes() == (tmp_path / "b.truth.json").read_bytes()
    assert made.faults[["component", "mode", "start_s"]].to_numpy().tolist() == [["FR", "stuck", 1.0]]
    assert repr(made) == f"<MadeLog {made.log} (mcap, 2.0 s): 1 fault>"
    with pytest.raises(mfhca.ConfigError, match="exists already"):
        mfhca.simulate(made.log, duration_s=2)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scenario": "foo"}, "scenario = 'foo' is not known"),
        ({"settings": {"K": "a"}}, "'a' is not a number"),
        ({"controller": "zz"}, "controller 'zz' is not known"),
        ({"format": "xlsx"}, "format = 'xlsx' is not known; expected one of mcap, bag"),
        ({"faults": ["FR sensor stuck 1"]}, "expected PART SIDE MODE START STOP"),
        ({"evidence": "all"}, "evidence = 'all' is not known"),
        ({"duration_s": -1}, "duration_s = -1 s is out of range"),
    ],
)
def test_simulations_that_cannot_be(tmp_path: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(mfhca.ConfigError, match=words):
        mfhca.simulate(tmp_path / "a.mcap", **options)
    assert list(tmp_path.iterdir()) == []


def test_injected_faults(made: mfhca.MadeLog, tmp_path: Path) -> None:
    faulty = mfhca.inject(str(made.log), tmp_path / "f.mcap", faults=["RL sensor noisy 2 4 eps=0.4"], seed=7)
    assert faulty.truth.open_loop
    assert faulty.faults["epsilon"].tolist() == [0.4]
    assert any("already has" in note for note in faulty.notes)  # the simulated faults
    words = [
        "inject",
        str(made.log),
        "-o",
        str(tmp_path / "g.mcap"),
        "--fault",
        "RL sensor noisy 2 4 eps=0.4",
        "--seed",
        "7",
    ]
    assert run([*words, "-q"]) == 0
    assert faulty.log.read_bytes() == (tmp_path / "g.mcap").read_bytes()
    with pytest.raises(mfhca.OutputError, match="exists"):
        mfhca.inject(made.log, faulty.log, faults=["RL sensor noisy 2 4"])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "no fault is given"),
        ({"random": True, "count": 0}, "--count 0: expected 1 to 1000"),
        ({"faults": ["FR sensor stuck 1 2"], "silent": "loud"}, "--silent loud: is not known"),
        ({"faults": ["FR sensor noisy 1 2"], "epsilon": 2.0}, "--epsilon 2"),
    ],
)
def test_injections_that_cannot_be(made: mfhca.MadeLog, tmp_path: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(mfhca.ConfigError, match=words):
        mfhca.inject(made.log, tmp_path / "a.mcap", **options)


def test_scores_are_those_of_the_command_line(
    made: mfhca.MadeLog, result: mfhca.Diagnosis, saved: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scores = mfhca.evaluate(result, made.truth_file)
    assert run(["evaluate", str(saved), str(made.truth_file), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    by_path = mfhca.evaluate(str(saved), str(made.truth_file))
    assert json.loads(json.dumps(by_path.document)) == printed
    assert scores.faults["outcome"].tolist() == ["right", "right"]
    assert repr(scores) == "<Evaluation of 1 mission: 2 of 2 injected faults right>"
    assert scores.events.loc["wheel", "right"] == 2
    assert scores.sides.loc[("wheel", "sensor"), "decided_share"] > 0.9
    assert scores.notes == ()
    assert set(scores.reported["id"]) == set(result.faults.index)
    page = scores.save(tmp_path / "scores.html")
    assert "<html" in page.read_text(encoding="utf-8")
    with pytest.raises(mfhca.ConfigError, match="would be changed"):
        scores.save(made.truth_file)


def test_scores_need_the_truth_of_the_mission(result: mfhca.Diagnosis, saved: Path, tmp_path: Path) -> None:
    with pytest.raises(mfhca.ConfigError, match="with its truth"):
        mfhca.evaluate(result)
    with pytest.raises(mfhca.ConfigError, match="no truth file"):
        mfhca.evaluate(tmp_path / "x.mcap" if (tmp_path / "x.mcap").write_text("x") else saved)
    with pytest.raises(mfhca.ConfigError, match=r"none\.json"):
        mfhca.evaluate(saved, tmp_path / "none.json")


def test_an_audit(made: mfhca.MadeLog, result: mfhca.Diagnosis, tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    (logs / "one.mcap").write_bytes(made.log.read_bytes())
    events: list[str] = []
    fleet = mfhca.audit(logs, tmp_path / "out", jobs=1, events=lambda name, facts: events.append(name))
    row = fleet.missions.loc["one"]
    assert repr(fleet) == f"<Audit {fleet.output}: 1 mission of 1 machine, 0 failed>"
    assert (row["state"], row["verdict"], row["faults"]) == ("ok", "stop", len(result.faults))
    assert mfhca.read_result(fleet.output / row["report"]).faults.equals(result.faults)
    assert fleet.page.is_file()
    assert (fleet.exit_code(), fleet.exit_code("never")) == (1, 0)
    assert next(name for name in events if name != "problem") == "start"  # no machine file is a note before it
    again = mfhca.audit(str(logs), str(tmp_path / "out"), jobs=1)
    assert (again.skipped, len(again.missions)) == (1, 1)


def test_an_audit_in_another_working_folder(
    made: mfhca.MadeLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("monday", "tuesday"):
        place = tmp_path / name
        (place / "logs").mkdir(parents=True)
        (place / "logs" / f"{name}.mcap").write_bytes(made.log.read_bytes())
        monkeypatch.chdir(place)
        assert mfhca.audit("logs", "out", jobs=1).missions["state"].to_dict() == {name: "ok"}


def test_an_audit_of_nothing(tmp_path: Path) -> None:
    with pytest.raises(mfhca.LogError, match=r"no mission was found; .*no: no such file"):
        mfhca.audit(tmp_path / "no", tmp_path / "out")
    with pytest.raises(mfhca.ConfigError, match="--jobs 0: expected 1 or more"):
        mfhca.audit(tmp_path, tmp_path / "out", jobs=0)
    with pytest.raises(mfhca.ConfigError, match="--trends weeks"):
        mfhca.audit(tmp_path, tmp_path / "out", trends="weeks")  # type: ignore[arg-type]
