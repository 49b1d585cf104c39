"""Machines of other structures: what real valves, pumps, drives and sensors do that `PlantOptions` has no word for.

A structure says which effects a machine has; its sizes are drawn from the mission's seed within stated ranges, so that
two missions of one structure are two machines unless they share `StructureOptions.machine_seed`. Structures of kind
``tuning`` may shape methods and limits; those of kind ``reporting`` differ from them in structure and are for figures alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from replay.errors import ConfigError, check_range

Span = tuple[float, float]
Drive = Literal["first_order", "resonant", "torque"]
Sharing = Literal["none", "proportional", "least_loaded"]
SpeedSensor = Literal["sampled", "counting", "tacho", "hall"]

DRIVES: tuple[str, ...] = ("first_order", "resonant", "torque")
SHARINGS: tuple[str, ...] = ("none", "proportional", "least_loaded")
SPEED_SENSORS: tuple[str, ...] = ("sampled", "counting", "tacho", "hall")


@dataclass(frozen=True)
class Structure:
    """Effects of one structure; every span is drawn evenly, per wheel where the text says so.

    Attributes
    ----------
    kind : str
        ``tuning`` or ``reporting``.
    drive : str
        ``first_order`` (flow sets the speed with a lag), ``resonant`` (with a hydraulic resonance), ``torque`` (the
        opening accelerates, the speed is its integral).
    gain, lag : Span
        Speed [m/s] per full opening and lag [s] of the hydraulic drives.
    asymmetry : Span
        Gain in reverse less that forward, as a share of it, per wheel, of either sign.
    dead_band, hysteresis : Span
        Opening without flow, per wheel and direction, and play of the spool [fraction of full opening].
    spool_lag : Span
        Lag of the spool [s].
    resonance, damping : Span
        Of the ``resonant`` drive [Hz], [1].
    wheel_limit : Span
        Largest speed of each wheel, whatever its opening [m/s]; 0: none.
    sharing : str
        What one pump does where the wheels want more than it gives: ``none`` (it always suffices), ``proportional``,
        ``least_loaded`` (the wheel with the lightest load takes what it wants first).
    pump : Span
        Sum of speeds that the pump feeds [m/s].
    pressure : Span
        Share of the gain that full load costs: the flow follows the root of the pressure that is left.
    leakage : Span
        Speed lost per force at the rim [m/s/N].
    acceleration : Span
        Of the ``torque`` drive at full opening [m/s²].
    coulomb, stribeck, viscous : Span
        Friction in the drive: at any speed [m/s²], what standstill adds to it, and per speed [1/s].
    warming : Span
        Share of the gain that is lost by the end of the mission.
    tyre : Span
        Factor on the tyre's stiffness.
    sensor : str
        ``sampled`` (noise and rounding), ``counting`` (steps within a window), ``tacho`` (lag, noise in proportion to
        the speed), ``hall`` (time between two poles: stepwise at low speed).
    scale : float
        Standard deviation of the sensors' scale errors, per wheel.
    steer_dead_band, steer_asymmetry, steer_backlash : Span
        Opening without motion, gain in reverse less forward, and play of the steering encoder [rad].
    law : str
        ``recorded`` (the mission's law) or ``pi`` (proportional, integral and feed-forward, in steering too).
    rate_hz : tuple[float, ...]
        Recorded rates to draw from.
    """

    kind: Literal["tuning", "reporting"]
    drive: Drive = "first_order"
    gain: Span = (1.6, 3.2)
    lag: Span = (0.12, 0.3)
    asymmetry: Span = (0.0, 0.0)
    dead_band: Span = (0.0, 0.0)
    hysteresis: Span = (0.0, 0.0)
    spool_lag: Span = (0.0, 0.0)
    resonance: Span = (4.0, 8.0)
    damping: Span = (0.3, 0.6)
    wheel_limit: Span = (0.0, 0.0)
    sharing: Sharing = "none"
    pump: Span = (1.5, 1.9)
    pressure: Span = (0.0, 0.0)
    leakage: Span = (5e-6, 1.5e-5)
    acceleration: Span = (2.0, 4.0)
    coulomb: Span = (0.0, 0.0)
    stribeck: Span = (0.0, 0.0)
    viscous: Span = (0.0, 0.0)
    warming: Span = (0.0, 0.0)
    tyre: Span = (0.7, 1.4)
    sensor: SpeedSensor = "sampled"
    scale: float = 0.0
    steer_dead_band: Span = (0.0, 0.0)
    steer_asymmetry: Span = (0.0, 0.0)
    steer_backlash: Span = (0.0, 0.0)
    law: Literal["recorded", "pi"] = "recorded"
    rate_hz: tuple[float, ...] = (1000.0,)


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


@dataclass(frozen=True)
class StructureOptions:
    """Which structure a machine has, and which machine of it this is.

    Attributes
    ----------
    name : str
        One of `STRUCTURES`.
    machine_seed : int or None
        Missions with the same number are missions of one machine; None: the mission's own seed.
    """

    name: str
    machine_seed: int | None = None

    def __post_init__(self) -> None:
        """Check values."""
        if self.name not in STRUCTURES:
            raise ConfigError(f"structure = {self.name!r} is not known; expected one of {', '.join(STRUCTURES)}")
        if self.machine_seed is not None:
            check_range("machine_seed", self.machine_seed, 0, 2**63 - 1, "")

    @property
    def structure(self) -> Structure:
        """Effects of the structure."""
        return STRUCTURES[self.name]

    def generator(self, seed: int) -> np.random.Generator:
        """Random numbers of the machine, for missions with this seed."""
        machine = seed if self.machine_seed is None else self.machine_seed
        return np.random.default_rng([machine, 173, list(STRUCTURES).index(self.name)])
