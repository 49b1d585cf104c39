"""What a simulated mission is made of, and what comes out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from replay.controllers.choice import Controller
from replay.errors import ConfigError, check_range
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import Machine, haulotte
from replay.simulation.plant_options import PlantOptions
from replay.simulation.structures import StructureOptions
from replay.truth import MissionTruth

Scenario = Literal["paper", "brief", "random", "healthy"]
EvidenceLevel = Literal["base", "spool", "direct"]
SimulatedLaw = Literal["opposed", "signed", "printed", "sign_abs", "p", "event_reset"]

SCENARIOS: tuple[str, ...] = ("paper", "brief", "random", "healthy")
PAPER_DRIVES: tuple[str, ...] = ("paper", "brief")
EVIDENCE_LEVELS: tuple[str, ...] = ("base", "spool", "direct")
SIMULATED_LAWS: tuple[str, ...] = ("opposed", "signed", "printed", "sign_abs", "p", "event_reset")
SIMULATED_AXLES: tuple[str, ...] = ("front", "rear")


@dataclass(frozen=True)
class SimulationOptions:
    """One mission to simulate.

    Attributes
    ----------
    scenario : str
        ``paper`` (its duty cycle and faults), ``brief`` (its duty cycle, faults as brief and partial as Assumptions 1 and 2
        demand), ``random`` (joystick-like, random faults), ``healthy`` (no faults).
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
        As in `replay.machine.config.Control`; ``p`` is the proportional part alone, ``event_reset`` is ``signed`` with Ψ̂ set
        anew wherever |e| jumps.
    zeta : float or None
        Forcing of Ψ̂ [s/m²]; None: the machine's for ``opposed``, else 0 (L16 (13) as printed).
    psi0 : float
        Ψ̂(0).
    ice : float or None
        Share of the ground under ice, 0…0.9; None: 0.25 in ``paper`` and ``brief``, else 0.
    slopes : bool
        Whether the ground rises and falls.
    steepness : float
        Factor on the scenario's slopes, 0…3.
    faults : tuple[FaultSpec, ...] or None
        Faults to inject; None: those of the scenario.
    steering_faults : bool
        Whether the ``random`` scenario also faults the steering axles.
    ramp_share, ramp_max_s : float
        Share of the scenario's faults whose ε grows over 0.5 s to `ramp_max_s` [s] instead of at once.
    early_share : float
        Share of wheels that the scenario also gives a fault from the first sample on.
    silent : str
        What a silent sensor logs: ``zero``, ``nan``, or ``drop`` (no sample). The controller reads 0.
    gnss, imu : bool or None
        Whether positions and yaw rate are logged; None: unless `evidence` is ``base``.
    jitter : float
        Share of the recording step by which a stamp is late at most, 0…0.9.
    drop_share, drop_burst_s : float
        Mean share of rows that each group of channels loses, 0…0.5, and mean length of a loss [s]; 0 for single rows.
    start_ns : int
        First stamp, ns since 1970.
    machine : Machine
        Geometry, limits and control parameters.
    plant : PlantOptions
        Physics and sensors.
    structure : StructureOptions or None
        Another structure of valves, pump, drive, sensors and law; None: the default one.
    controller : Controller or None
        Another controller of the wheels' valves instead of `law` (and of the structure's); None: the law.
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
    steepness: float = 1.0
    faults: tuple[FaultSpec, ...] | None = None
    steering_faults: bool = False
    ramp_share: float = 0.0
    ramp_max_s: float = 4.0
    early_share: float = 0.0
    silent: Literal["zero", "nan", "drop"] = "zero"
    gnss: bool | None = None
    imu: bool | None = None
    jitter: float = 0.0
    drop_share: float = 0.0
    drop_burst_s: float = 0.0
    start_ns: int = 1_760_000_000_000_000_000
    machine: Machine = field(default_factory=haulotte)
    plant: PlantOptions = field(default_factory=PlantOptions)
    structure: StructureOptions | None = None
    controller: Controller | None = None

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
        check_range("psi0", self.psi0, 0.0, 10.0, "")
        check_range("steepness", self.steepness, 0.0, 3.0, "")
        check_range("ramp_share", self.ramp_share, 0.0, 1.0, "of the faults")
        check_range("ramp_max_s", self.ramp_max_s, 0.5, 60.0, "s")
        check_range("early_share", self.early_share, 0.0, 1.0, "of the wheels")
        check_range("jitter", self.jitter, 0.0, 0.9, "of the step")
        check_range("drop_share", self.drop_share, 0.0, 0.5, "of the rows")
        check_range("drop_burst_s", self.drop_burst_s, 0.0, 10.0, "s")
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
                f"fault of {fault.component}: {fault.start_s:g}…{fault.stop_s:g} s is not an interval; start must be at "
                "least 0 and before stop"
            )
        if fault.start_s >= self.duration_s:
            raise ConfigError(
                f"fault of {fault.component}: begins at {fault.start_s:g} s, but the mission ends at {self.duration_s:g} s; "
                "expected a start before that: give an earlier one, or a longer mission"
            )
        least = -1.0 if fault.mode is FaultMode.OUTSIDE_TABLE else 0.0  # a channel that reads too much
        check_range(f"fault of {fault.component}: epsilon", fault.epsilon, least, 1.0, "")
        check_range(f"fault of {fault.component}: sat_std", fault.sat_std, 0.0, 1e3, "")
        check_range(f"fault of {fault.component}: sat_tau_s", fault.sat_tau_s, 0.0, 1e6, "s")
        check_range(f"fault of {fault.component}: ramp_s", fault.ramp_s, 0.0, 1e6, "s")

    @property
    def ice_share(self) -> float:
        """Share of the ground under ice. A fraction [1]."""
        return (0.25 if self.scenario in PAPER_DRIVES else 0.0) if self.ice is None else self.ice

    @property
    def substeps(self) -> int:
        """Control steps per recorded sample; the control rate is at least 1 kHz."""
        return int(np.ceil(1000.0 / self.rate_hz - 1e-9))

    @property
    def samples(self) -> int:
        """Number of recorded samples."""
        return int(np.floor(self.duration_s * self.rate_hz + 1e-6))


_GROUPS: Mapping[str, str] = {
    "v": "sensors",
    "phi": "sensors",
    "v_ref": "references",
    "phi_ref": "references",
    "u": "valve_commands",
    "u_applied": "valve_feedback",
    "v_true": "second_sensors",
    "phi_true": "second_sensors",
}


def channel_group(name: str) -> str:
    """Group of channels that are recorded, and lost, together: ``commands``, ``sensors``, ``references`` and so on."""
    return "commands" if name.startswith("cmd.") else _GROUPS[name.rpartition(".")[2]]


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
        ns since 1970, on a uniform grid (whole microseconds), late by `SimulationOptions.jitter`.
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
    kept : Mapping[str, NDArray[np.bool_]], each of shape (n,)
        Rows of `columns` that were recorded, by group of channels (`channel_group`); empty where all were.
    """

    options: SimulationOptions
    stamps: NDArray[np.int64]
    columns: Mapping[str, NDArray[np.float64]]
    slow: tuple[SlowGroup, ...]
    truth: MissionTruth
    actual: Mapping[str, NDArray[np.float64]]
    kept: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)

    def rows(self, name: str) -> NDArray[np.bool_]:
        """Rows of a column that were recorded, shape (n,)."""
        return self.kept.get(channel_group(name), np.ones(self.stamps.size, np.bool_))

    def series(self) -> Iterator[tuple[str, NDArray[np.int64], NDArray[np.float64]]]:
        """Name, stamps [ns] and values of every recorded signal, lost rows left out. Both of shape (k,), SI."""
        for name, values in self.columns.items():
            rows = self.rows(name)
            yield name, self.stamps[rows], values[rows]
        for group in self.slow:
            for name, values in group.columns.items():
                yield name, group.stamps, values
