"""`mfhca counterfactual` and `mfhca evaluate controllers`: tables, files, and refusals in one sentence."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

from cli.main import run

SIMULATE = ["simulate", "-q", "--duration", "50", "--rate", "100", "--scenario", "healthy"]
FAULTS = ["--fault", "FR sensor stuck 20 22", "--fault", "RL actuator inefficient 26 31 eps=0.5"]


def made(folder: Path, *words: str) -> Path:
    log = folder / "m.mcap"
    assert run([*SIMULATE, "-o", str(log), *words]) == 0
    return log


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("counterfactual"), *FAULTS)


def shown(capsys: pytest.CaptureFixture[str]) -> str:
    return " ".join(capsys.readouterr().out.split())


def test_laws_in_the_terminal_and_as_files(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--controller", "p", "--controller", "mfhca", "--draws", "3", "-o", str(tmp_path / "out")]
    assert run(["counterfactual", str(log), *words]) == 0
    text = shown(capsys)
    assert "law that ran mfhca, opposed: lambda" in text
    assert "2 faults of wheels" in text
    document = json.loads((tmp_path / "out" / "counterfactual.json").read_text("utf-8"))
    assert document["schema"] == "mfhca-counterfactual/1"
    own, recorded = document["self_replay"], document["recorded"]["figures"]
    assert own["error_replayed"] == pytest.approx(own["error_recorded"], rel=0.02)
    assert own["effort_replayed"] == pytest.approx(own["effort_recorded"], rel=0.05)
    p, mfhca = document["laws"]
    assert (p["law"], p["parameters"], p["gains"]) == ("p", 1, {"k": 1.0})
    assert p["figures"]["tracking_error"]["healthy"] > 2 * recorded["tracking_error"]["healthy"]
    assert p["error_band"]["low"] <= p["figures"]["tracking_error"]["mission"] <= p["error_band"]["high"]
    assert mfhca["figures"]["tracking_error"]["mission"] == pytest.approx(
        recorded["tracking_error"]["mission"], rel=0.02
    )
    assert [(r["component"], r["side"], r["mode"]) for r in p["recoveries"]] == [
        ("FR", "sensor", "stuck"),
        ("RL", "actuator", "inefficient"),
    ]
    table = pq.read_table(tmp_path / "out" / "counterfactual.parquet")
    assert {"t", "wheel.FR.v_ref", "wheel.FR.load", "self.RL.u", "p.RR.v", "mfhca.FL.read"} <= set(table.column_names)
    assert table.num_rows == 5000
    page = (tmp_path / "out" / "counterfactual.html").read_text("utf-8")
    assert "The recorded mission under other laws" in page
    assert "http://" not in page.replace("http://www.w3.org", "").split('id="plotlyjs"')[0]


def test_other_gains_change_the_law_that_ran(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        run(["counterfactual", str(log), "--controller", "mfhca", "--set", "zeta=4000", "--draws", "0", "--json"]) == 0
    )
    document = json.loads(capsys.readouterr().out)
    (law,) = document["laws"]
    assert law["gains"]["zeta"] == 4000.0
    assert law["error_band"] is None
    assert (
        law["figures"]["tracking_error"]["healthy"] < 0.9 * document["recorded"]["figures"]["tracking_error"]["healthy"]
    )


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["--set", "zeta=1"], 2, "--set: belongs to one law, 8 are asked for; give one --controller"),
        (["--controller", "p", "--set", "q=1"], 2, "p has no parameter 'q'; expected one of k"),
        (["--controller", "p", "--set", "k"], 2, "--set k: expected NAME=VALUE with a number"),
        (["--recorded", "p k=1"], 3, "self-replay: the law found in it (p) gives a mean |e| of"),
        (["--recorded", "pi signed"], 2, "'signed' is not understood"),
        (["--open"], 2, "--open: there is no page to open; give a folder for it with -o"),
    ],
)
def test_what_cannot_be_done_is_said(
    words: Sequence[str], code: int, sentence: str, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["counterfactual", str(log), *words]) == code
    assert sentence in capsys.readouterr().err.replace("\n", " ")


def test_a_mission_of_an_unknown_law_needs_its_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = made(tmp_path, "--controller", "fuzzy", "--duration", "25")
    words = ["--controller", "p", "--draws", "0"]
    assert run(["counterfactual", str(log), *words]) == 3
    assert "--recorded" in capsys.readouterr().err
    assert run(["counterfactual", str(log), *words, "--recorded", "fuzzy"]) == 0
    assert "law that ran fuzzy" in shown(capsys)


def test_the_table_of_controllers(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["evaluate", "controllers", "--duration", "3", "--seed", "1", "--controller", "neural", "--scenario", "ice"]
    assert run(words) == 0
    text = shown(capsys)
    assert "ice: the paper's drive without faults" in text
    assert "neural Yu (0.024 / 0.125)" in text
    assert run([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["parameters"] == 6


def test_a_controller_in_the_simulator(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["simulate", "-o", str(tmp_path / "m.csv"), "--duration", "3", "--rate", "100", "--json"]
    assert run([*words, "--preset", "paper-table"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["preset"].startswith("paper-table: a reconstruction")
    assert document["control_effort"] > 0.0
    for more, sentence in (
        (["--preset", "paper-table", "--scenario", "paper"], "--preset paper-table: says itself what --scenario would"),
        (["--controller", "pi", "--law", "signed"], "--law signed: is a reading of MFHCA's law"),
        (["--controller", "pi", "--set", "k_i=1"], "'k_i' is not known"),
    ):
        assert run([*words, "--force", *more]) == 2
        assert sentence in capsys.readouterr().err.replace("\n", " ")


def test_wheels_without_a_drive_are_in_no_law_s_hands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "m.csv"
    assert run([*SIMULATE, "-o", str(log), "--fault", "FR sensor stuck 20 22"]) == 0
    table = pd.read_csv(log)
    free = [c for c in table if c.startswith(("wheel.RR.", "wheel.RL.")) and not c.endswith((".v", ".v_true"))]
    table.drop(columns=free).to_csv(tmp_path / "free.csv", index=False)
    file = tmp_path / "free.toml"
    file.write_text(
        '[machine]\nwheels = ["FR", "FL", "RR", "RL"]\nunpowered = ["RR", "RL"]\n[geometry]\nwheelbase = 2.1\n'
        "joint_spacing = 1.46\nwheel_offset = 0.2\nwheel_diameter = 0.854\nmax_speed = 0.36\n",
        encoding="utf-8",
    )
    words = ["-m", str(file), "--controller", "p", "--draws", "2", "-o", str(tmp_path / "out")]
    assert run(["counterfactual", str(tmp_path / "free.csv"), *words]) == 0
    assert "RR, RL: without a drive" in " ".join(capsys.readouterr().out.split())
    document = json.loads((tmp_path / "out" / "counterfactual.json").read_text("utf-8"))
    assert list(document["known_s"]) == [row["wheel"] for row in document["plant"]] == ["FR", "FL"]
    own = document["self_replay"]
    assert own["error_replayed"] == pytest.approx(own["error_recorded"], rel=0.02)
    names = pq.read_table(tmp_path / "out" / "counterfactual.parquet").column_names
    assert "p.FR.v" in names
    assert not any(".RR." in name for name in names)
