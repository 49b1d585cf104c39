"""What a report says of log and machine, by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.pipeline import diagnose_mission
from diagnosis.recording_rows import machine_row
from replay.export.mission import write_mission
from replay.machine.config import haulotte
from replay.mission import Mission, load_mission
from replay.signals.signal import Signals
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Mission:
    path = tmp_path_factory.mktemp("logs") / "drive.mcap"
    write_mission(simulate_mission(SimulationOptions(scenario="healthy", duration_s=12.0, rate_hz=100.0)), path, "mcap")
    return load_mission([path], haulotte())


def test_the_log(mission: Mission) -> None:
    report = diagnose_mission(mission, haulotte()).report
    log, line = report["log"], mission.timeline
    assert [f["path"] for f in log["files"]] == ["drive.mcap"], "no folder"
    assert (log["rate_hz"], log["duration_s"]) == (100.0, pytest.approx(line.size * 0.01))
    speeds = [np.nan_to_num(line.signals[f"wheel.{w}.v"]) for w in haulotte().wheels]
    assert log["distance_m"] == pytest.approx(np.abs(speeds).mean(axis=0).sum() * 0.01, rel=1e-3)
    assert "samples_per_bucket" not in log
    assert "previous" not in report


def test_whose_identity_counts(mission: Mission) -> None:
    machine = replace(haulotte(), id="from the file")
    nothing = Mission((), Signals({}, {}), mission.timeline)
    assert machine_row(machine, nothing, "m.toml", "given")["id"] == "given"
    assert machine_row(machine, nothing, "m.toml", None)["id"] == "from the file"
    row = machine_row(replace(machine, geometry=None), nothing, "m.toml", None)
    assert (row["geometry"], row["source"]) == (None, "m.toml")


def test_numbers_are_short_and_known(mission: Mission) -> None:
    report = diagnose_mission(mission, haulotte()).report
    row = report["coverage"][0]
    assert row["driving_s"] == float(f"{row['driving_s']:.9g}")
