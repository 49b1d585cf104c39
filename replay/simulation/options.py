"""What a simulated mission is made of, and what comes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from replay.checks import check_range
from replay.errors import ConfigError
from replay.faults import FaultSpec, Side
from replay.machine import Machine, haulotte
from replay.truth import MissionTruth

Scenario = Literal["paper", "random", "healthy"]
EvidenceLevel = Literal["base", "spool", "direct"]
SimulatedLaw = Literal["opposed", "signed", "printed", "sign_abs", "p"]

SCENARIOS: tuple[str, ...] = ("paper", "random", "healthy")
EVIDENCE_LEVELS: tuple[str, ...] = ("base", "spool", "direct")
SIMULATED_LAWS: tuple[str, ...] = ("opposed", "signed", "printed", "sign_abs", "p")
SIMULATED_AXLES: tuple[str, ...] = ("front", "rear")


@dataclass(frozen=True)
class PlantOptions:
    """The machine's physics and its sensors.

    Attributes
    ----------
    K : float
        Wheel speed per full valve opening, before the pump's limit [m/s].
    tau : float
        Lag from valve to wheel speed [s].
    wheel_spread : float
        Relative standard deviation of K and tau from wheel to wheel [1].
    dead_zone : float
        Valve opening without flow [fraction].
    valve_lag : float
        Lag of the spool [s]; 0 for none.
    droop : float
        Speed lost to leakage per force at the rim [m/s/N].
    pump_flow, motor_displacement : float
        Flow shared by all motors [m³/s]; motor volume per turn [m³].
    mass : float
        Of the body [kg].
    friction, ice_friction : float
        Tyre friction on firm ground and on ice [1].
    slip_stiffness : float
        Tyre force per slip ratio of one wheel [N].
    rolling_resistance : float
        Share of the weight [1].
    steer_gain, steer_rate, steer_lag : float
        Steering speed per full valve opening [rad/s], its limit [rad/s], and lag [s].
    v_std, v_lsb : float
        Noise and resolution of the speed sensor [m/s]; None for 12 bit over 2500 rpm of the motor.
    phi_std, phi_lsb : float
        Noise and resolution of the steering encoder [rad].
    """

    K: float = 2.4
    tau: float = 0.25
    wheel_spread: float = 0.03
    dead_zone: float = 0.0
    valve_lag: float = 0.0
    droop: float = 1e-5
    pump_flow: float = 63e-3 / 60
    motor_displacement: float = 100e-6
    mass: float = 6650.0
    friction: float = 0.6
    ice_friction: float = 0.05
    slip_stiffness: float = 5e4
    rolling_resistance: float = 0.03
    steer_gain: float = 4.0
    steer_rate: float = 0.25
    steer_lag: float = 0.05
    v_std: float = 0.004
    v_lsb: float | None = None
    phi_std: float = 0.0005
    phi_lsb: float = 0.0004

    def __post_init__(self) -> None:
        """Check values."""
        check_range("plant.K", self.K, 0.1, 20.0, "m/s per full opening")
        check_range("plant.tau", self.tau, 0.02, 5.0, "s")
        check_range("plant.wheel_spread", self.wheel_spread, 0.0, 0.2, "")
        check_range("plant.dead_zone", self.dead_zone, 0.0, 0.5, "of full opening")
        check_range("plant.valve_lag", self.valve_lag, 0.0, 1.0, "s")
        check_range("plant.droop", self.droop, 0.0, 1e-4, "m/s/N")
        check_range("plant.mass", self.mass, 500.0, 1e5, "kg")
        check_range("plant.friction", self.friction, 0.01, 2.0, "")
        check_range("plant.ice_friction", self.ice_friction, 0.001, 2.0, "")


@dataclass(frozen=True)
class SimulationOptions:
    """One mission to simulate.

    Attributes
    ----------
    scenario : str
        ``paper`` (its duty cycle and faults), ``random`` (joystick-like, random faults), ``healthy`` (no faults).
    seed : int
        The same seed gives the same mission.
    duration_s, rate_hz : float
        Length [s] and recorded rate, 50…1000 [Hz].
    evidence : str
        ``base``: commands, v, u, φ; ``spool``: also the measured valve positions; ``direct``: also a second speed
        and steering sensor.
    coupling : str
        ``ground`` (wheels share the body through their tyres) or ``free`` (wheels off the ground).
    law : str
        As in `replay.machine.Control`; ``p`` is the proportional part alone.
    zeta : float or None
        Forcing of Ψ̂ [s/m²]; None: the machine's for ``opposed``, else 0 (L16 (13) as printed).
    psi0 : float
        Ψ̂(0).
    ice : float or None
        Share of the ground under ice, 0…0.9; None: 0.25 in ``paper``, else 0.
    slopes : bool
        Whether the ground rises and falls.
    faults : tuple[FaultSpec, ...] or None
        Faults to inject; None: those of the scenario.
    steering_faults : bool
        Whether the ``random`` scenario also faults the steering axles.
    silent : str
        What a silent sensor logs: ``zero``, ``nan``, or ``drop`` (no sample). The controller reads 0.
    gnss, imu : bool or None
        Whether positions and yaw rate are logged; None: unless `evidence` is ``base``.
    start_ns : int
        First stamp, ns since 1970.
    machine : Machine
        Geometry, limits and control parameters.
    plant : PlantOptions
        Physics and sensors.
    """

    scenario: Scenario = "random"
    seed: int = 1
    duration_s: float = 240.0
    rate_hz: float = 1000.0
    evidence: EvidenceLevel = "direct"
    coupling: Literal["free", "ground"] = "ground"
    law: SimulatedLaw = "opposed"
    zeta: float | None = None
    psi0: float = 0.0
    ice: float | None = None
    slopes: bool = True
    faults: tuple[FaultSpec, ...] | None = None
    steering_faults: bool = False
    silent: Literal["zero", "nan", "drop"] = "zero"
    gnss: bool | None = None
    imu: bool | None = None
    start_ns: int = 1_760_000_000_000_000_000
    machine: Machine = field(default_factory=haulotte)
    plant: PlantOptions = field(default_factory=PlantOptions)

    def __post_init__(self) -> None:
        """Check values."""
        for key, value, known in (
            ("scenario", self.scenario, SCENARIOS),
            ("evidence", self.evidence, EVIDENCE_LEVELS),
            ("coupling", self.coupling, ("free", "ground")),
            ("law", self.law, SIMULATED_LAWS),
            ("silent", self.silent, ("zero", "nan", "drop")),
        ):
            if value not in known:
                raise ConfigError(f"{key} = {value!r} is not known; expected one of {', '.join(known)}")
        check_range("seed", self.seed, 0, 2**63 - 1, "")
        check_range("duration_s", self.duration_s, 0.1, 1e6, "s")
        check_range("rate_hz", self.rate_hz, 50.0, 1000.0, "Hz")
        if self.ice is not None:
            check_range("ice", self.ice, 0.0, 0.9, "of the ground")
        if self.zeta is not None:
            check_range("zeta", self.zeta, 0.0, 1e9, "s/m^2")
        if self.machine.geometry is None or set(self.machine.geometry.axles) != set(SIMULATED_AXLES):
            raise ConfigError("[geometry] the simulator needs wheels on a steered front and a steered rear axle")
        for fault in self.faults or ():
            self._check_fault(fault)

    def _check_fault(self, fault: FaultSpec) -> None:
        """Raise where a fault names no part of the machine or has no length."""
        parts = (*self.machine.wheels, *SIMULATED_AXLES)
        if fault.component not in parts:
            raise ConfigError(f"fault component {fault.component!r} is not known; expected one of {', '.join(parts)}")
        if fault.side is Side.SENSOR_OR_ACTUATOR:
            raise ConfigError(f"fault of {fault.component}: side must be sensor or actuator")
        if not 0.0 <= fault.start_s < fault.stop_s:
            raise ConfigError(
                f"fault of {fault.component}: {fault.start_s:g}…{fault.stop_s:g} s is no interval; start must be at "
                "least 0 and before stop"
            )
        check_range(f"fault of {fault.component}: epsilon", fault.epsilon, 0.0, 1.0, "")
        check_range(f"fault of {fault.component}: sat_std", fault.sat_std, 0.0, 1e3, "")
        check_range(f"fault of {fault.component}: sat_tau_s", fault.sat_tau_s, 0.0, 1e6, "s")

    @property
    def ice_share(self) -> float:
        """Share of the ground under ice."""
        return (0.25 if self.scenario == "paper" else 0.0) if self.ice is None else self.ice

    @property
    def substeps(self) -> int:
        """Control steps per recorded sample; the control rate is at least 1 kHz."""
        return int(np.ceil(1000.0 / self.rate_hz - 1e-9))

    @property
    def samples(self) -> int:
        """Number of recorded samples."""
        return int(np.floor(self.duration_s * self.rate_hz + 1e-6))


@dataclass(frozen=True)
class SlowGroup:
    """Signals recorded together at their own, slower stamps.

    Attributes
    ----------
    name : str
        ``gnss`` or ``imu``.
    stamps : NDArray[np.int64], shape (m,)
        ns since 1970.
    columns : Mapping[str, NDArray[np.float64]], each of shape (m,)
        By canonical name, SI.
    """

    name: str
    stamps: NDArray[np.int64]
    columns: Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True)
class SimulatedMission:
    """What the machine logged, and what truly happened.

    Attributes
    ----------
    options : SimulationOptions
        How it was made.
    stamps : NDArray[np.int64], shape (n,)
        ns since 1970, on a uniform grid (whole microseconds).
    columns : Mapping[str, NDArray[np.float64]], each of shape (n,)
        Logged signals by canonical name, SI; NaN where a silent sensor logs NaN or nothing.
    slow : tuple[SlowGroup, ...]
        Positions and yaw rate.
    truth : MissionTruth
        What ``truth.json`` holds.
    actual : Mapping[str, NDArray[np.float64]], each of shape (n,)
        True signals, never logged: ``wheel.<W>.v``, ``v_ref``, ``u_applied``, ``psi``, ``slip`` (rim over ground
        [m/s]), ``steer.<A>.phi``, ``steer.<A>.u_applied``, ``body.v``, ``body.x``, ``body.y``, ``body.yaw``,
        ``body.omega``.
    """

    options: SimulationOptions
    stamps: NDArray[np.int64]
    columns: Mapping[str, NDArray[np.float64]]
    slow: tuple[SlowGroup, ...]
    truth: MissionTruth
    actual: Mapping[str, NDArray[np.float64]]
