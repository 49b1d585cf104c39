"""Children that find the made-up work beside the tests; missions, keys and reports for the store."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.isolation.forks import ForkServer
from diagnosis.audit.isolation.run import Isolation, isolation
from diagnosis.audit.store.keys import Key, config_hash, log_hash
from replay.export.mission import write_mission
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


@pytest.fixture(scope="session", autouse=True)
def _importable() -> Iterator[None]:
    patch = pytest.MonkeyPatch()
    patch.syspath_prepend(Path(__file__).parent)
    for kind in ("fork", "fork-cold"):  # a server of an earlier test does not find it
        isolation(kind).close()
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


@pytest.fixture
def make_report() -> Callable[..., dict[str, Any]]:
    """Report of a mission with one fault of FR's actuator, as far as the store looks at it."""

    def make(
        start_ns: int = 1_760_000_000_000_000_000, epsilon: float = 0.2, machine_id: str = "H-07"
    ) -> dict[str, Any]:
        bounds = {"value": epsilon, "low": epsilon - 0.05, "high": epsilon + 0.05}
        fault = {
            "id": "F1", "component": "FR", "kind": "wheel", "side": "actuator", "mode": "inefficient", "start_s": 10.0,
            "stop_s": 30.0, "start_ns": start_ns + 10 * 10**9, "epsilon": bounds, "sat": None, "probability": 0.98,
            "severity": "medium", "hypotheses": [{"side": "actuator", "mode": "inefficient", "p": 0.98}],
        }  # fmt: skip
        coverage = [
            {
                "component": wheel, "side": side, "seconds": {"healthy": 60.0, "inefficient": 20.0, "not_excited": 20.0},
                "driving_s": 80.0, "decided_driving_s": 80.0 if side == "sensor" else 40.0,
            }
            for wheel in ("FR", "FL")
            for side in ("sensor", "actuator")
        ]  # fmt: skip
        return {
            "log": {
                "start_ns": start_ns,
                "duration_s": 100.0,
                "driving_s": 80.0,
                "distance_m": 12.5,
                "open_loop": False,
                "files": [],
            },
            "machine": {"id": machine_id, "name": "Haulotte"},
            "verdict": {"status": "watch", "title": "1 fault to watch"},
            "intervals": [fault],
            "coverage": coverage,
            "loss": [{"component": "FR", "side": "actuator", "epsilon": bounds, "seconds": 55.0, "relative": False}],
        }

    return make


@pytest.fixture
def make_mission(tmp_path: Path) -> Callable[..., MissionSource]:
    """Mission of one file that is really there."""

    def make(name: str, content: bytes = b"log") -> MissionSource:
        path = tmp_path / "logs" / f"{name}.mcap"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
        stamp = str(path.stat().st_mtime_ns)
        return MissionSource(name, (str(path),), len(content), (stamp,), sizes=(len(content),))

    return make


@pytest.fixture
def make_key() -> Callable[..., Key]:
    """Key of a log's content."""

    def make(content: str, version: str = "1.0") -> Key:
        return Key(log_hash([content]), config_hash(b"machine", {}, ""), version)

    return make
