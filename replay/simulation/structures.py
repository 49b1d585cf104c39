"""Machines of other structures: what real valves, pumps, drives and sensors do that `PlantOptions` has no word for.

A structure says which effects a machine has; its sizes are drawn from the mission's seed within stated ranges, so that
two missions of one structure are two machines unless they share `StructureOptions.machine_seed`. Structures of kind
``tuning`` may shape methods and limits; those of kind ``reporting`` differ from them in structure and are for figures alone.
``random`` draws the effects as well (`replay.simulation.random_structures`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from replay.errors import ConfigError, check_range
from replay.simulation.random_structures import random_structure
from replay.simulation.structure import Structure

STRUCTURES: Mapping[str, Structure] = {
    "valves": Structure(
        kind="tuning",
        drive="resonant",
        asymmetry=(0.1, 0.25),
        dead_band=(0.03, 0.05),
        hysteresis=(0.015, 0.02),
        spool_lag=(0.025, 0.035),
        wheel_limit=(0.42, 0.5),
        sensor="counting",
        scale=0.003,
        steer_dead_band=(0.02, 0.04),
        steer_asymmetry=(0.05, 0.2),
        steer_backlash=(0.001, 0.004),
        law="pi",
        rate_hz=(500.0, 1000.0),
    ),
    "pump": Structure(
        kind="tuning",
        sharing="proportional",
        pump=(1.1, 1.5),
        pressure=(0.2, 0.5),
        dead_band=(0.0, 0.02),
        leakage=(1e-5, 3e-5),
        warming=(0.04, 0.1),
        sensor="tacho",
        scale=0.003,
        steer_dead_band=(0.01, 0.03),
        rate_hz=(200.0, 500.0),
    ),
    "torque": Structure(
        kind="tuning",
        drive="torque",
        coulomb=(0.1, 0.25),
        stribeck=(0.05, 0.15),
        viscous=(0.8, 2.0),
        sensor="hall",
        scale=0.003,
        steer_backlash=(0.002, 0.006),
        law="pi",
        rate_hz=(200.0, 1000.0),
    ),
    "resonant_pump": Structure(
        kind="reporting",
        drive="resonant",
        gain=(1.0, 2.0),
        resonance=(5.0, 9.0),
        sharing="least_loaded",
        pump=(1.2, 1.6),
        asymmetry=(0.05, 0.2),
        dead_band=(0.02, 0.06),
        pressure=(0.1, 0.4),
        leakage=(5e-6, 4e-5),
        warming=(0.0, 0.08),
        sensor="tacho",
        scale=0.004,
        steer_dead_band=(0.02, 0.05),
        steer_backlash=(0.002, 0.005),
        law="pi",
        rate_hz=(200.0, 500.0, 1000.0),
    ),
    "sticky_valves": Structure(
        kind="reporting",
        gain=(0.9, 1.8),
        lag=(0.05, 0.15),
        dead_band=(0.03, 0.06),
        hysteresis=(0.01, 0.04),
        spool_lag=(0.02, 0.06),
        asymmetry=(0.1, 0.3),
        wheel_limit=(0.4, 0.6),
        warming=(0.04, 0.1),
        sensor="hall",
        scale=0.004,
        steer_dead_band=(0.03, 0.06),
        steer_asymmetry=(0.1, 0.3),
        law="pi",
        rate_hz=(250.0, 500.0),
    ),
    "electric": Structure(
        kind="reporting",
        drive="torque",
        acceleration=(1.5, 5.0),
        coulomb=(0.05, 0.4),
        stribeck=(0.0, 0.2),
        viscous=(1.5, 4.0),
        asymmetry=(0.0, 0.1),
        sensor="counting",
        scale=0.004,
        steer_dead_band=(0.0, 0.03),
        steer_backlash=(0.001, 0.006),
        rate_hz=(200.0, 500.0),
    ),
}

RANDOM = "random"
STRUCTURE_NAMES: tuple[str, ...] = (*STRUCTURES, RANDOM)
_RANDOM_STREAM, _GIVEN_STREAM = 100, 101  # of the machine's random numbers, apart from those of named structures


@dataclass(frozen=True)
class StructureOptions:
    """Which structure a machine has, and which machine of it this is.

    Attributes
    ----------
    name : str or Structure
        One of `STRUCTURES`; ``random``: effects drawn by the machine's seed; or a structure of one's own.
    machine_seed : int or None
        Missions with the same number are missions of one machine; None: the mission's own seed.
    """

    name: str | Structure
    machine_seed: int | None = None

    def __post_init__(self) -> None:
        """Check values."""
        if isinstance(self.name, str) and self.name not in STRUCTURE_NAMES:
            raise ConfigError(f"structure = {self.name!r} is not known; expected one of {', '.join(STRUCTURE_NAMES)}")
        if self.machine_seed is not None:
            check_range("machine_seed", self.machine_seed, 0, 2**63 - 1, "")

    def structure(self, seed: int) -> Structure:
        """Effects of the machine, for missions with this seed."""
        if isinstance(self.name, Structure):
            return self.name
        return random_structure(self._machine(seed)) if self.name == RANDOM else STRUCTURES[self.name]

    def generator(self, seed: int) -> np.random.Generator:
        """Random numbers of the machine, for missions with this seed."""
        if isinstance(self.name, Structure):
            stream = _GIVEN_STREAM
        else:
            stream = _RANDOM_STREAM if self.name == RANDOM else list(STRUCTURES).index(self.name)
        return np.random.default_rng([self._machine(seed), 173, stream])

    def _machine(self, seed: int) -> int:
        return seed if self.machine_seed is None else self.machine_seed
