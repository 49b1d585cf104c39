"""The files that the documentation's commands name: small missions that stand for a reader's own."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from replay.export.mission import write_mission
from replay.faults import FaultMode, FaultSpec, Side
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.ros_robots import Robot, urdf, write_robot

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = ROOT / "sample_logs"
#: By how much the clock of `plc.csv` is late, and how fast it runs away.
CLOCK_NS, DRIFT = 319_000_000, 50e-6
STUCK = FaultSpec("RR", Side.SENSOR, FaultMode.STUCK, 15.0, 22.0, 1.0, 0.2)


def write_documented_files(folder: Path) -> None:
    """Write all of them.

    Parameters
    ----------
    folder : Path
        Empty folder. It gets `sample_logs/`, `drive.mcap` (three faults), `machine.toml`,
        `robot.mcap` (an ordinary ROS robot of which a sensor is stuck),
        `recorder.mcap` and `plc.csv` (one mission on two clocks), `healthy/`, and `logs/` of two machines.
    """
    (folder / "sample_logs").symlink_to(SAMPLES)
    shutil.copy(SAMPLES / "three_faults.mcap", folder / "drive.mcap")
    shutil.copy(SAMPLES / "haulotte.toml", folder / "machine.toml")
    write_robot(folder / "robot.mcap", Robot(description=urdf(), stuck=("front_left_wheel_joint", 20.0, 35.0)))
    _write_two_files(folder)
    (folder / "healthy").mkdir()
    for day, seed in (("monday", 2), ("tuesday", 3), ("wednesday", 8)):
        write_mission(_mission(seed), folder / "healthy" / f"{day}.mcap", "mcap")
    for machine, seed, faults in (("lifter-1", 4, ()), ("lifter-1", 5, (STUCK,)), ("lifter-2", 6, ())):
        path = folder / "logs" / machine / f"{seed}.mcap"
        path.parent.mkdir(parents=True, exist_ok=True)
        write_mission(_mission(seed, faults), path, "mcap")


def _mission(seed: int, faults: tuple[FaultSpec, ...] = ()) -> SimulatedMission:
    day_ns = 86_400_000_000_000
    start = 1_760_000_000_000_000_000 + seed * day_ns
    return simulate_mission(
        SimulationOptions(
            scenario="healthy", seed=seed, duration_s=40.0, rate_hz=50.0, imu=False, start_ns=start, faults=faults
        )
    )


def _write_two_files(folder: Path) -> None:
    """One mission, its commands and speeds in the recorder's file, its speeds and valves in that of a PLC with another clock."""
    mission = _mission(7, (STUCK,))
    leaves = {name: name.rpartition(".")[2] for name in mission.columns}
    recorded = {
        name: mission.columns[name] for name, leaf in leaves.items() if leaf not in ("u", "u_applied", "v_true")
    }
    of_plc = {name: mission.columns[name] for name, leaf in leaves.items() if leaf not in ("v_ref", "omega")}
    write_mission(replace(mission, columns=recorded), folder / "recorder.mcap", "mcap")
    since = (mission.stamps - mission.stamps[0]).astype(np.float64)
    stamps = mission.stamps + CLOCK_NS + np.round(since * DRIFT / 1e3).astype(np.int64) * 1000
    write_mission(replace(mission, columns=of_plc, slow=(), stamps=stamps), folder / "plc.csv", "twincat")
