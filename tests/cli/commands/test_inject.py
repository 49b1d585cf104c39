"""`mfhca inject`: from a recording to scores."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.main import run
from replay.machine.config import haulotte
from replay.mission import load_mission
from replay.truth import read_truth

MACHINE = """
[machine]
name = "Loader"
wheels = ["A", "B"]

[geometry]
max_speed = 2.0

[control]
law = "none"

[sources]
"*.csv" = { time = "clock", time_unit = "ms" }

[signals]
"wheel.A.v" = { column = "speed one", unit = "km/h" }
"wheel.B.v" = { column = "speed two", unit = "km/h" }
"wheel.A.v_ref" = { column = "wanted", unit = "km/h" }
"wheel.B.v_ref" = { column = "wanted", unit = "km/h" }
"wheel.A.v_true" = { column = "second one", unit = "km/h" }
"wheel.B.v_true" = { column = "second two", unit = "km/h" }
"""


@pytest.fixture
def drive(tmp_path: Path) -> list[str]:
    """40 s of a two-wheeled machine at 100 Hz in columns with names of their own; words to name log and machine."""
    rng = np.random.default_rng(2)
    t = np.arange(4000) / 100
    wanted = 3.6 * (1.0 + 0.4 * np.sin(t))
    speeds = np.round(wanted[:, None] + 0.03 * rng.standard_normal((t.size, 4)), 2)
    rows = [
        f"{1000 * a:.0f},{w:.4f},{','.join(f'{x:.2f}' for x in row)}"
        for a, w, row in zip(t, wanted, speeds, strict=True)
    ]
    head = "clock,wanted,speed one,speed two,second one,second two"
    (tmp_path / "drive.csv").write_text("\n".join([head, *rows]) + "\n")
    (tmp_path / "machine.toml").write_text(MACHINE)
    return [str(tmp_path / "drive.csv"), "-m", str(tmp_path / "machine.toml")]


def document(words: list[str], capsys: pytest.CaptureFixture[str]) -> Any:
    assert run([*words, "--json"]) in (0, 1)
    return json.loads(capsys.readouterr().out)


def test_from_a_recording_to_scores(drive: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "faulty.csv"
    made = document(["inject", *drive, "-o", str(out), "--fault", "A sensor stuck 20 30 sat=0.4"], capsys)
    assert made["open_loop"] is True
    assert [(f["component"], f["mode"], f["start_s"]) for f in made["faults"]] == [("A", "stuck", 20.0)]
    assert made["diagnose"] == ["mfhca", "diagnose", str(out), "-m", drive[2]]
    truth = read_truth(Path(made["truth"]))
    assert (truth.open_loop, truth.wheels, truth.duration_s) == (True, ("A", "B"), 40.0)
    page = tmp_path / "page"
    report = document(["diagnose", str(out), *drive[1:], "-o", str(page)], capsys)
    assert report["log"]["open_loop"] is True
    assert [(i["component"], i["side"], i["mode"]) for i in report["intervals"]] == [("A", "sensor", "stuck")]
    assert abs(report["intervals"][0]["start_s"] - 20.0) < 0.05
    assert "controller did not react to these faults" in (page / "report.html").read_text(encoding="utf-8")
    scores = document(["evaluate", str(out), *drive[1:]], capsys)
    assert [f["component"] for f in scores["results"][0]["wheel"]["faults"]] == ["A"]


def test_the_table_shows_what_was_injected(
    drive: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--fault", "A sensor inefficient 5 9", "--fault", "B sensor noisy 20 30", "--epsilon", "0.3"]
    assert run(["inject", *drive, "-o", str(tmp_path / "f.mcap"), *words]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "A sensor inefficient 5 to 9 s 0.3 0 B sensor noisy 20 to 30 s 0.3 0.278" in shown
    assert "(mcap, 6 signals, open-loop; other channels are not written)" in shown


def test_random_faults_are_the_same_for_the_same_seed(drive: list[str], tmp_path: Path) -> None:
    for name, seed in (("a.mcap", "7"), ("b.mcap", "7"), ("c.mcap", "8")):
        words = ["-o", str(tmp_path / name), "--random", "--count", "3", "--seed", seed]
        assert run(["inject", "-q", *drive, *words]) == 0
    first, again, other = (tmp_path / name for name in ("a.mcap", "b.mcap", "c.mcap"))
    assert first.read_bytes() == again.read_bytes()
    assert first.read_bytes() != other.read_bytes()
    assert len(read_truth(tmp_path / "a.truth.json").intervals) == 3


@pytest.mark.parametrize(
    ("name", "more", "kind"),
    [
        ("f.csv", [], "csv"),
        ("f.log", [], "csv"),
        ("f.bag", [], "bag"),
        ("f.mcap", [], "mcap"),
        ("f", ["-f", "rosbag2"], "rosbag2"),
    ],
)
def test_the_format_follows_the_words(
    name: str, more: list[str], kind: str, drive: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["inject", *drive, "-o", str(tmp_path / name), "--fault", "A sensor stuck 20 30", *more]
    assert document(words, capsys)["format"] == kind
    assert (tmp_path / "f.truth.json").is_file()


def test_several_inputs_become_one_mcap(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stamps = load_mission([mission_log], haulotte()).signals.items["cmd.v"].stamps
    rows = ["time_ns,wheel.FR.pressure_a,wheel.FR.pressure_b", *(f"{t},100000,0" for t in stamps)]
    (tmp_path / "plc.csv").write_text("\n".join(rows) + "\n")
    words = ["inject", str(mission_log), str(tmp_path / "plc.csv"), "-o", str(tmp_path / "f.log")]
    made = document([*words, "--fault", "RL sensor stuck 2 4"], capsys)
    assert made["format"] == "mcap"
    assert {"wheel.FR.pressure_a", "wheel.RL.v"} <= set(made["signals"])


def test_nothing_is_replaced_unasked(drive: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fault = ["--fault", "A sensor stuck 20 30"]
    (tmp_path / "f.truth.json").write_text("mine")
    assert run(["inject", *drive, "-o", str(tmp_path / "f.mcap"), *fault]) == 2
    assert "f.truth.json: exists; give another name with -o, or --force" in capsys.readouterr().err
    assert not (tmp_path / "f.mcap").exists()
    assert run(["inject", "-q", *drive, "-o", str(tmp_path / "f.mcap"), *fault, "--force"]) == 0
    before = (tmp_path / "drive.csv").read_bytes()
    assert run(["inject", *drive, "-o", drive[0], *fault, "--force"]) == 2
    assert "would be changed by writing" in capsys.readouterr().err
    assert (tmp_path / "drive.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "no fault is given"),
        (["--fault", "C sensor stuck 1 2"], "no such part; expected one of A, B"),
        (["--fault", "A actuator stuck 1 2"], "valve's position wheel.A.u_applied is not logged"),
        (["--fault", "A sensor stuck 50 60"], "the log lasts 39.990 s"),
        (["--fault", "A sensor noisy 5 6", "--epsilon", "2"], "--epsilon 2: expected"),
        (["--random", "--count", "90"], "ask for fewer"),
    ],
)
def test_mistakes_are_told(
    words: list[str], said: str, drive: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["inject", *drive, "-o", str(tmp_path / "f.mcap"), *words]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "f.mcap").exists()


def test_an_injected_log_takes_no_more_faults(
    drive: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = tmp_path / "f.parquet"
    assert run(["inject", "-q", *drive, "-o", str(first), "--fault", "A sensor stuck 20 30"]) == 0
    words = ["inject", str(first), *drive[1:], "-o", str(tmp_path / "g.parquet"), "--fault", "B sensor stuck 20 30"]
    assert run(words) == 2
    assert "already injected" in capsys.readouterr().err


def test_the_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["inject", "--help"]) == 0
    assert "mfhca inject drive.mcap -o faulty.mcap" in capsys.readouterr().out


def test_faults_of_a_simulated_original_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "drive.mcap"
    words = ["--scenario", "healthy", "--duration", "8", "--rate", "100", "--fault", "FR sensor stuck 2 3"]
    assert run(["simulate", "-q", "-o", str(log), *words]) == 0
    assert run(["inject", str(log), "-o", str(tmp_path / "f.mcap"), "--fault", "RL sensor no_signal 4 6"]) == 0
    assert "drive.truth.json names faults that the recording already has" in capsys.readouterr().err
    (tmp_path / "drive.truth.json").write_text("{}")
    assert run(["inject", str(log), "-o", str(tmp_path / "g.mcap"), "--fault", "RL sensor no_signal 4 6"]) == 0
    assert "names faults" not in capsys.readouterr().err


def test_a_format_that_is_only_read_asks_for_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Summary:
        format = "tdms"

    log = tmp_path / "drive.tdms"
    log.write_bytes(b"TDSm")
    monkeypatch.setattr("replay.readers.registry.summarise_log", lambda path, options: Summary())
    assert run(["inject", str(log), "-o", str(tmp_path / "out"), "--fault", "FR sensor stuck 1 2"]) == 2
    assert "the input's format tdms is read, not written" in capsys.readouterr().err
