"""What a machine of another structure is made of: effects of valves, pump, drive and sensors, with their ranges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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
