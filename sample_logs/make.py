"""Make the sample missions: ``python sample_logs/make.py`` (the same files on every run).

Each log has ``<stem>.truth.json`` beside it; the machine files name every signal of the logs. With ``--golden`` nothing
is made but ``golden/<stem>.json``: what `mfhca diagnose` finds in each mission today, to be reviewed as text.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from diagnosis.pipeline import diagnose
from diagnosis.results.result import MissionResult
from replay.atomic_write import atomic_path
from replay.export.formats.mcap import write_mcap
from replay.export.formats.rosbag1 import write_ros1_bag
from replay.export.formats.rosbag2 import write_rosbag2
from replay.export.formats.topics import axle_joint, mission_topics, wheel_joint
from replay.export.formats.twincat import plc_symbol, write_twincat
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.machine.toml_file import load_machine
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from replay.truth import write_truth

# 50 Hz keeps all of them together below 16 MB; `mfhca simulate` writes them at 1 kHz.
_RATE = 50.0

# Log, machine file that names its signals, and how the mission is simulated.
_PAPER = SimulationOptions(scenario="paper", seed=7, rate_hz=_RATE, imu=False)
_THREE = (
    FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 10.0, 18.0, 1.0, math.nan),
    FaultSpec("RL", Side.ACTUATOR, FaultMode.INEFFICIENT, 29.0, 39.0, 0.5),
    FaultSpec("FL", Side.SENSOR, FaultMode.INEFFICIENT, 45.0, 53.0, 0.3),
)
SAMPLES: Mapping[str, tuple[str, SimulationOptions]] = {
    "three_faults.mcap": (
        "haulotte.toml",
        SimulationOptions(scenario="healthy", seed=4, duration_s=60.0, rate_hz=_RATE, imu=False, faults=_THREE),
    ),
    "paper.mcap": ("haulotte.toml", _PAPER),
    "paper.bag": ("haulotte.toml", _PAPER),
    "paper_rosbag2": ("haulotte.toml", _PAPER),
    "paper_twincat.csv": ("haulotte-twincat.toml", _PAPER),
    "healthy_ice.mcap": (
        "haulotte.toml",
        SimulationOptions(scenario="healthy", seed=3, duration_s=60.0, rate_hz=_RATE, ice=0.6, imu=False),
    ),
    "spool.mcap": (
        "haulotte.toml",
        SimulationOptions(scenario="random", seed=11, duration_s=75.0, rate_hz=_RATE, evidence="spool", imu=False),
    ),
    "base.mcap": (
        "haulotte.toml",
        SimulationOptions(scenario="random", seed=11, duration_s=75.0, rate_hz=_RATE, evidence="base"),
    ),
}

_MACHINE = """\
# The paper's machine, {what}.
# Signals with usual names are found without this file; here each one is named.

[machine]
name = "Haulotte 16RTJ PRO"
wheels = ["FR", "FL", "RR", "RL"]

[geometry]
wheelbase = 2.1        # m
joint_spacing = 1.46   # m
wheel_diameter = 0.854 # m
wheel_offset = 0.20    # m
gear_ratio = 17.7
max_speed = 0.36       # m/s
max_steer = 0.7853981633974483 # rad

[plant]
flow = 1.59            # m/s, summed over the wheels that the pump can feed

[signals]
"""
_LEAVES = {
    "wheel": {
        "v_ref": ("/wheel_commands", "velocity", "rad/s"),
        "v": ("/joint_states", "velocity", "rad/s"),
        "v_true": ("/joint_states_redundant", "velocity", "rad/s"),
        "u": ("/valve_commands", "effort", "fraction"),
        "u_applied": ("/valve_feedback", "effort", "fraction"),
    },
    "steer": {
        "phi_ref": ("/wheel_commands", "position", "rad"),
        "phi": ("/joint_states", "position", "rad"),
        "phi_true": ("/joint_states_redundant", "position", "rad"),
        "u": ("/valve_commands", "effort", "fraction"),
        "u_applied": ("/valve_feedback", "effort", "fraction"),
    },
}
_PLAIN = {
    "cmd.v": ("/cmd_vel", "twist.linear.x", "m/s"),
    "cmd.omega": ("/cmd_vel", "twist.angular.z", "rad/s"),
    "gnss.lat": ("/gnss/fix", "latitude", "deg"),
    "gnss.lon": ("/gnss/fix", "longitude", "deg"),
}


def signal_names(mission: SimulatedMission) -> list[str]:
    return [*mission.columns, *(name for group in mission.slow for name in group.columns)]


def ros_source(name: str) -> str:
    if name in _PLAIN:
        topic, field, unit = _PLAIN[name]
    else:
        kind, part, leaf = name.split(".")
        topic, array, unit = _LEAVES[kind][leaf]
        field = f"{array}[{wheel_joint(part) if kind == 'wheel' else axle_joint(part)}]"
    return f'{{ topic = "{topic}", field = "{field}", unit = "{unit}" }}'


def plc_source(name: str, wheels: tuple[str, ...]) -> str:
    symbol, unit = plc_symbol(name, wheels)
    at = ', at = "motor"' if unit == "rpm" else ""
    return f'{{ symbol = "{symbol}", unit = "{unit}"{at} }}'


def write_machine_files(folder: Path, mission: SimulatedMission) -> None:
    wheels = mission.options.machine.wheels
    for file, what, source in (
        ("haulotte.toml", "recorded through ROS", ros_source),
        ("haulotte-twincat.toml", "recorded with TwinCAT Scope", lambda name: plc_source(name, wheels)),
    ):
        lines = [f'"{name}" = {source(name)}' for name in signal_names(mission)]
        with atomic_path(folder / file) as temporary:
            temporary.write_text(_MACHINE.format(what=what) + "\n".join(lines) + "\n", encoding="utf-8")


def write_log(mission: SimulatedMission, path: Path) -> None:
    """Write one log as small as its format allows."""
    if path.suffix == ".mcap":
        write_mcap(path, mission_topics(mission, "cdr"), level=19)
    elif path.suffix == ".bag":
        write_ros1_bag(path, mission_topics(mission, "ros1"), level=16)
    elif path.suffix == ".csv":
        write_twincat(path, mission)
    else:
        write_rosbag2(path, mission_topics(mission, "cdr"), compressed=True)


def make(folder: Path) -> None:
    """Write every sample, its truth and the machine files."""
    write_machine_files(folder, simulate_mission(_PAPER))
    for name, (_, options) in SAMPLES.items():
        mission = simulate_mission(options)
        path = folder / name
        write_log(mission, path)
        write_truth(mission.truth, folder / f"{path.stem}.truth.json")


def golden_names() -> dict[str, str]:
    """Log of each distinct mission by stem; a mission in several formats counts once."""
    seen: list[SimulationOptions] = []
    names = {}
    for name, (_, options) in SAMPLES.items():
        if options not in seen:
            seen.append(options)
            names[Path(name).stem] = name
    return names


def diagnosed(log: Path, machine: Path | None = None) -> MissionResult:
    """What is found in a log; without a machine file the signals are found by their names."""
    return diagnose([log], haulotte() if machine is None else load_machine(machine))


def golden_of(log: Path, result: MissionResult) -> dict[str, Any]:
    """Verdict and faults of a log, in order of time."""
    report, rows = result.report, []
    for fault in report["intervals"]:
        epsilon = (fault["epsilon"] or {}).get("value")
        rows.append(
            {key: fault[key] for key in ("component", "side", "mode")}
            | {key: round(fault[key], 3) for key in ("start_s", "stop_s")}
            | {"epsilon": None if epsilon is None else round(epsilon, 3), "severity": fault["severity"]}
        )
    rows.sort(key=lambda row: (row["start_s"], row["component"], row["side"], row["stop_s"]))
    return {"log": log.name, "verdict": report["verdict"]["status"], "intervals": rows}


def write_golden(folder: Path) -> None:
    """Write the golden files, one fault per line."""
    (folder / "golden").mkdir(exist_ok=True)
    for stem, name in golden_names().items():
        found = golden_of(folder / name, diagnosed(folder / name))
        rows = ",\n".join("    " + json.dumps(row) for row in found["intervals"])
        head = "".join(f"  {json.dumps(key)}: {json.dumps(found[key])},\n" for key in ("log", "verdict"))
        body = f"[\n{rows}\n  ]" if rows else "[]"
        with atomic_path(folder / "golden" / f"{stem}.json") as temporary:
            temporary.write_text(f'{{\n{head}  "intervals": {body}\n}}\n', encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the sample missions.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path(__file__).parent)
    parser.add_argument("--golden", action="store_true", help="write golden/<stem>.json of the samples that are there")
    asked = parser.parse_args()
    write_golden(asked.folder) if asked.golden else make(asked.folder)
