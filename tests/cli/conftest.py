"""A small mission that tests of the command line share."""

from __future__ import annotations

from pathlib import Path

import pytest

from replay.export.mission import write_mission
from replay.faults import FaultMode, FaultSpec, Side
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


@pytest.fixture(scope="session")
def mission_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """12 s at 100 Hz with the FR speed sensor stuck from 5 to 9 s."""
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 5.0, 9.0, 1.0, 0.3)
    options = SimulationOptions(scenario="healthy", duration_s=12.0, rate_hz=100.0, faults=(fault,))
    path = tmp_path_factory.mktemp("logs") / "drive.mcap"
    write_mission(simulate_mission(options), path, "mcap")
    return path


@pytest.fixture(autouse=True)
def _width_of_a_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    """Output as wide as in a pipe, whatever the terminal or the runner of the tests says."""
    monkeypatch.delenv("COLUMNS", raising=False)
