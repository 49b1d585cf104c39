"""Missions of the reference data's foreign plant, made by its own script; the data lies where ``MFHCA_REFERENCE_DATA`` says."""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from replay.faults import FaultMode, FaultSpec
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.mission import Mission, load_mission

PLANT = Path(os.environ.get("MFHCA_REFERENCE_DATA", "../shared")) / "foreign_plants"
NAME = "foreign"
_LOGGED = {"base": (False, False), "spool": (True, False), "direct": (True, True)}  # openings, second speeds


def maker() -> Any:
    """The script as a module.

    Raises
    ------
    FileNotFoundError
        Where the data is not there.
    """
    if not PLANT.is_dir():
        raise FileNotFoundError(f"{PLANT} is not there: set MFHCA_REFERENCE_DATA")
    sys.dont_write_bytecode = True
    if str(PLANT) not in sys.path:
        sys.path.insert(0, str(PLANT))
    return importlib.import_module("make")


def scenario(make: Any, seed: int, law: str, duration: float = 240.0) -> Any:
    """A healthy drive whose ground, gain, lag and noise the seed draws."""
    rng = np.random.default_rng(seed)
    return make.Scenario(
        f"{NAME}{seed}",
        seed,
        duration=duration,
        ice=float(rng.choice([0.0, 0.8])),
        slope=float(rng.choice([0.0, 0.05, 0.1])),
        gain=float(rng.uniform(2.2, 4.0)),
        tau=float(rng.uniform(0.1, 0.22)),
        meas_noise=float(rng.uniform(0.001, 0.004)),
        law=law,
    )


def has(make: Any, fault: FaultSpec) -> bool:
    """Whether the plant can have a fault: its steering has none, and a constant offset beside a share is not among its modes."""
    offset = fault.mode is FaultMode.OUTSIDE_TABLE and fault.sat != 0.0
    return fault.component in make.WHEELS and not offset


def faults_for(make: Any, faults: Sequence[FaultSpec]) -> list[Any]:
    """Faults of wheels in the plant's own terms; a varying saturation term keeps its deviation alone."""
    wheels = list(make.WHEELS)
    return [
        make.Fault(
            wheels.index(f.component),
            f.side.value,
            f.mode.value,
            f.start_s,
            f.stop_s,
            f.epsilon,
            f.sat_std if f.mode is FaultMode.NOISY else (0.15 if np.isnan(f.sat) else f.sat),
        )
        for f in faults
    ]


def missions(make: Any, drive: Any, tiers: Sequence[str]) -> list[tuple[str, Mission, Machine]]:
    """A drive as logs with more and less evidence, and their machine files."""
    out, simulated = [], make.simulate(drive)
    with tempfile.TemporaryDirectory() as folder:
        log, config = Path(folder) / "mission.mcap", Path(folder) / "machine.toml"
        for tier in tiers:
            make.write_mcap(log, simulated, drive, *_LOGGED[tier])
            config.write_text(make.machine(*_LOGGED[tier]))
            machine = load_machine(config)
            out.append((tier, load_mission([log], machine), machine))
    return out
