"""`mfhca fit` writes a machine file that the other commands take, and never over another."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.main import run
from replay.export.mission import write_mission
from replay.machine.toml_file import load_machine
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


@pytest.fixture(scope="module")
def healthy_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """40 s at 100 Hz without a fault."""
    options = SimulationOptions(scenario="healthy", duration_s=40.0, rate_hz=100.0, evidence="base")
    path = tmp_path_factory.mktemp("logs") / "healthy.mcap"
    write_mission(simulate_mission(options), path, "mcap")
    return path


def test_the_written_file_is_checked_and_used(
    healthy_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "machine.toml"
    assert run(["fit", str(healthy_log), "-o", str(file)]) == 0
    out, notes = capsys.readouterr()
    assert "no machine file was given: of the paper's Haulotte" in notes
    assert "plant.FR.K" in out
    assert "plant.FR.grip" in out
    assert run(["config", "check", str(file)]) == 0
    assert set(load_machine(file).plant.wheels) == {"FR", "FL", "RR", "RL"}
    assert run(
        ["diagnose", str(healthy_log), "-m", str(file), "-o", str(tmp_path / "report"), "--fail-on", "high"]
    ) in (0, 3)
    report = json.loads((tmp_path / "report" / "report.json").read_text(encoding="utf-8"))
    assert report["intervals"] == []


def test_an_existing_file_is_replaced_with_force_only(
    healthy_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "machine.toml"
    file.write_text("mine", encoding="utf-8")
    assert run(["fit", str(healthy_log), "-o", str(file)]) == 2
    assert "exists and was not changed" in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == "mine"
    assert run(["fit", str(healthy_log), "-o", str(file), "--force"]) == 0
    assert load_machine(file).plant.wheels


def test_json_is_one_document(healthy_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["fit", str(healthy_log), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "mfhca-fit/1"
    assert document["missions"] == ["healthy.mcap"]
    assert document["output"] is None
    assert {"key", "value", "std", "why"} <= set(document["constants"][0])


def test_a_wrong_unit_is_shown_everywhere(
    healthy_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base, file = tmp_path / "base.toml", tmp_path / "machine.toml"
    field = "velocity[front_right_wheel]"
    base.write_text(
        f'[signals]\n"wheel.FR.v" = {{ topic = "/joint_states", field = "{field}", unit = "m/s" }}\n', encoding="utf-8"
    )
    assert run(["fit", str(healthy_log), "-m", str(base), "-o", str(file), "--json"]) == 0
    streams = capsys.readouterr()
    assert 'unit = "rad/s"' in json.loads(streams.out)["unit_errors"][0]["text"]
    assert "unit error: wheel.FR.v, 2" in streams.err
    assert "# UNIT ERROR: wheel.FR.v" in file.read_text(encoding="utf-8")
    assert "FR" not in load_machine(file).plant.wheels


def test_a_missing_log_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["fit", str(tmp_path / "none.mcap")]) == 3
    assert "none.mcap: no such file" in capsys.readouterr().err
