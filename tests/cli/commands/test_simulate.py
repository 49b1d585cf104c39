"""`mfhca simulate`: a log, its truth, and the words to go on with."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.main import run
from replay.machine.config import haulotte
from replay.mission import load_mission
from replay.truth import read_truth

SHORT = ["--duration", "4", "--rate", "100", "--scenario", "healthy"]


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("m.mcap", "mcap"),
        ("m.bag", "bag"),
        ("m", "rosbag2"),
        ("m.txt", "twincat"),
        ("m.csv", "csv"),
        ("m.parquet", "parquet"),
    ],
)
def test_every_format_is_read_again_without_a_machine_file(
    name: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / name
    assert run(["simulate", "-o", str(log), *SHORT]) == 0
    assert f"({kind}, 4 s at 100 Hz)" in " ".join(capsys.readouterr().out.split())
    assert read_truth(tmp_path / "m.truth.json").duration_s == 4.0
    mission = load_mission([log], haulotte())
    assert mission.timeline.size == 400
    assert {f"wheel.{w}.{s}" for w in haulotte().wheels for s in ("v", "u", "v_true", "u_applied")} <= set(
        mission.timeline.signals
    )


def test_faults_as_words_reach_the_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "m.mcap"
    faults = ["--fault", "FR sensor stuck 1 2 sat=0.2", "--fault", "RL actuator inefficient 2 3 eps=0.4"]
    assert run(["simulate", "-o", str(log), *SHORT, *faults, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["faults"], document["diagnose"]) == (2, ["mfhca", "diagnose", str(log)])
    truth = read_truth(Path(document["truth"]))
    assert [(i.component, i.mode, i.epsilon, i.sat_mean) for i in truth.intervals] == [
        ("FR", "stuck", 1.0, 0.2),
        ("RL", "inefficient", 0.4, 0.0),
    ]


def test_the_default_name_follows_the_format(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["simulate", "-q", *SHORT]) == 0
    assert run(["simulate", "-q", "--format", "bag", *SHORT]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mission.bag", "mission.mcap", "mission.truth.json"]


def test_a_format_beats_the_ending(tmp_path: Path) -> None:
    log = tmp_path / "m.log"
    assert run(["simulate", "-q", "-o", str(log), "-f", "mcap", *SHORT]) == 0
    assert log.read_bytes().startswith(b"\x89MCAP0")
    assert (tmp_path / "m.truth.json").is_file()


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.mcap", "b.mcap"):
        assert run(["simulate", "-q", "-o", str(tmp_path / name), "--seed", "7", *SHORT]) == 0
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_a_recording_is_never_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "real.bag"
    log.write_text("recorded")
    assert run(["simulate", "-o", str(log), *SHORT]) == 2
    assert "exists and is not a simulated log" in capsys.readouterr().err
    assert log.read_text() == "recorded"


def test_constants_and_varied_machines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain, slow, lossy, varied = (tmp_path / f"{name}.csv" for name in ("plain", "slow", "lossy", "varied"))
    assert run(["simulate", "-q", "-o", str(plain), *SHORT]) == 0
    assert run(["simulate", "-q", "-o", str(slow), *SHORT, "--set", "K=0.5", "--set", "lambda=0.5"]) == 0
    assert run(["simulate", "-q", "-o", str(lossy), *SHORT, "--set", "drop_share=0.3", "--set", "jitter=0.5"]) == 0
    assert run(["simulate", "-q", "-o", str(varied), "--vary", "--seed", "7", "--duration", "4"]) == 0
    assert plain.read_bytes() != slow.read_bytes()
    assert lossy.read_text().count(",,") > plain.read_text().count(",,") + 100
    assert read_truth(tmp_path / "varied.truth.json").duration_s == 4.0
    for setting, word in (("k=1", "'k' is not known"), ("K=big", "is not a number"), ("K=1e9", "plant.K")):
        assert run(["simulate", "-o", str(tmp_path / "x.csv"), *SHORT, "--set", setting]) == 2
        assert word in capsys.readouterr().err
    assert run(["simulate", "-o", str(tmp_path / "x.csv"), "--vary", "--seed", "1500"]) == 2
    assert "at least 2000" in capsys.readouterr().err


def test_an_earlier_log_and_the_truth_of_another_are_kept_without_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, other = tmp_path / "s.csv", tmp_path / "s.mcap"
    assert run(["simulate", "-q", "-o", str(log), *SHORT]) == 0
    kept, truth = log.read_bytes(), (tmp_path / "s.truth.json").read_bytes()
    another = [*SHORT, "--fault", "FR sensor stuck 1 2"]
    assert run(["simulate", "-o", str(log), *another]) == 2
    assert f"{log}: exists already; give another name with -o, or --force" in capsys.readouterr().err
    assert run(["simulate", "-o", str(other), *another]) == 2
    assert "s.truth.json: belongs to another mission" in capsys.readouterr().err
    assert not other.exists()
    assert (log.read_bytes(), (tmp_path / "s.truth.json").read_bytes()) == (kept, truth)
    assert run(["simulate", "-q", "-o", str(other), *SHORT]) == 0  # the same mission once more
    assert run(["simulate", "-q", "-o", str(log), *another, "--force"]) == 0
    assert len(read_truth(tmp_path / "s.truth.json").intervals) == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["--fault", "FR sensor stuck 9 12"],
            "fault of FR: begins at 9 s, but the mission ends at 4 s; expected a start",
        ),
        (["--set", "structure=pump", "--set", "structure=valves"], "structure is given 2 times; give it once"),
        (["--set", "K=1", "--set", "K=1.1"], "--set K=1: K is given 2 times; give it once"),
        (
            ["--set", "structure=valves", "--law", "signed"],
            "--law signed: a machine of this structure has its own law, pi",
        ),
    ],
)
def test_what_would_be_ignored_is_refused(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "x.csv"
    assert run(["simulate", "-o", str(log), *SHORT, *words]) == 2
    assert message in capsys.readouterr().err
    assert not log.exists()


def test_a_scenario_whose_faults_come_later_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    short = ["--duration", "4", "--rate", "100", "--scenario", "paper"]
    assert run(["simulate", "-o", str(tmp_path / "x.csv"), *short]) == 0
    assert "the paper scenario has no fault in 4 s; give a longer --duration, or --fault" in capsys.readouterr().err
    assert run(["simulate", "-o", str(tmp_path / "y.csv"), *SHORT, "--set", "structure=pump", "--law", "signed"]) == 0
    assert "no fault" not in capsys.readouterr().err


@pytest.mark.parametrize("name", ["m.mcap", "m.bag", "m.txt", "m.csv", "m.parquet"])
def test_a_mission_begins_when_it_is_asked_to(name: str, tmp_path: Path) -> None:
    log = tmp_path / name
    assert run(["simulate", "-o", str(log), *SHORT, "--start", "2026-10-05T09:30+02:00"]) == 0
    start = 1_791_185_400 * 10**9
    assert read_truth(tmp_path / "m.truth.json").start_ns == start
    assert load_mission([log], haulotte()).timeline.start_ns == start


@pytest.mark.parametrize(("date", "said"), [("monday", "is no date"), ("1899-01-01", "expected 1970 to 2099")])
def test_a_start_that_is_no_date_is_refused(
    date: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["simulate", "-o", str(tmp_path / "m.mcap"), *SHORT, "--start", date]) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
