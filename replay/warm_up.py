"""A short simulated log, for programs that load everything a diagnosis needs before the first real log comes."""

from __future__ import annotations

from pathlib import Path

from replay.export.mission import write_mission
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


def write_warm_up_log(path: Path) -> None:
    """Write twelve seconds of the paper's machine as MCAP; its truth is not kept."""
    options = SimulationOptions(scenario="healthy", duration_s=12.0, rate_hz=100.0)
    write_mission(simulate_mission(options), path, "mcap")
