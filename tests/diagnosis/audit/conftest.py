"""Children that find the made-up work beside the tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from diagnosis.audit.isolated import ForkServer, Isolation
from replay.export.mission import write_mission
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


@pytest.fixture(scope="session", autouse=True)
def _importable() -> Iterator[None]:
    patch = pytest.MonkeyPatch()
    patch.syspath_prepend(Path(__file__).parent)
    yield
    patch.undo()


@pytest.fixture(scope="session")
def forks(_importable: None) -> Iterator[Isolation]:
    """Server that forks children."""
    server = ForkServer(warmed=False)
    yield server
    server.close()


@pytest.fixture(scope="session")
def mission_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """12 s at 100 Hz without faults."""
    options = SimulationOptions(scenario="healthy", duration_s=12.0, rate_hz=100.0)
    path = tmp_path_factory.mktemp("logs") / "drive.mcap"
    write_mission(simulate_mission(options), path, "mcap")
    return path
