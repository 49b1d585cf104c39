"""The machine: geometry, control law, limits and where its signals are recorded.

Defaults are the paper's Haulotte 16RTJ PRO with signals found automatically.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from replay.errors import ConfigError, check_range
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.axle_plant import AxlePlant
from replay.machine.drive_model import DriveModel
from replay.machine.effort_model import EffortModel
from replay.machine.geometry import Geometry, four_wheel_geometry
from replay.machine.own_channels import check_own_channels
from replay.machine.plant import Coupling as Coupling
from replay.machine.plant import Plant as Plant
from replay.machine.plant import WheelPlant as WheelPlant
from replay.machine.quantities import DEGREES
from replay.machine.signal_table import names_of, signal_of
from replay.machine.unpowered import check_name, check_unpowered

Law = Literal["auto", "signed", "opposed", "printed", "sign_abs", "none"]
PsiMode = Literal["auto", "printed", "implied", "event_reset", "forced"]
PhiDot = Literal["command", "measured", "zero"]
Drive = Literal["auto", "valve", "motor"]
MovedPart = Literal["wheel", "joint"]
SpeedUnit = Literal["m/s", "rad/s", "deg/s"]

LAWS: tuple[str, ...] = ("auto", "signed", "opposed", "printed", "sign_abs", "none")
#: What a machine has from the paper's where no machine file gives it.
ASSUMABLE: tuple[str, ...] = ("geometry", "gear_ratio", "max_speed", "max_steer", "flow", "control")
DRIVES: tuple[str, ...] = ("auto", "valve", "motor")
MOVED_PARTS: tuple[str, ...] = ("wheel", "joint")
SPEED_UNITS: tuple[str, ...] = ("m/s", "rad/s", "deg/s")
PSI_MODES: tuple[str, ...] = ("auto", "printed", "implied", "event_reset", "forced")


@dataclass(frozen=True)
class Control:
    """The MFHCA law and its readings (L15 (14), L16 (13), L17 (15)).

    Attributes
    ----------
    law : str
        ``signed`` u = −λ(v−v_c) + sgn(v_c)Ψ̂²; ``opposed`` u = −λ(v−v_c) − sgn(e)Ψ̂²; ``printed``
        u = −λ|v| + λ|v_c| + Ψ̂²; ``sign_abs`` sgn(v_c)[λ(|v_c|−|v|) + Ψ̂²]; ``auto`` fits the law to the recorded
        command; ``none`` means another controller.
    psi : str
        How Ψ̂ is replayed; see `replay.control.mfhca`.
    lambda_ : float
        λ [s/m].
    xi, beta : float
        ξ, β of L16 (13) [1/s].
    zeta : float
        Forcing of the ``forced`` mode [s/m²].
    k_ps : float
        Steering gain of L17 (15) [1/rad].
    u_max : float
        Saturation of the valve command [fraction].
    psi0 : float or None
        Ψ̂(0); None fits it where u is recorded, else 0.
    phi_dot : str
        Source of φ̇ in ω_j = ω_b + φ̇ (L1 (1)).
    phi_dot_hz : float
        Cut-off of the low-pass on φ̇ [Hz].
    """

    law: Law = "auto"
    psi: PsiMode = "auto"
    lambda_: float = 1.0
    xi: float = 1.0
    beta: float = 0.001
    zeta: float = 1000.0
    k_ps: float = 1.0
    u_max: float = 1.0
    psi0: float | None = None
    phi_dot: PhiDot = "command"
    phi_dot_hz: float = 5.0

    def __post_init__(self) -> None:
        """Check values."""
        if self.law not in LAWS:
            raise ConfigError(f"control.law = {self.law!r} is not known; expected one of {', '.join(LAWS)}")
        if self.psi not in PSI_MODES:
            raise ConfigError(f"control.psi = {self.psi!r} is not known; expected one of {', '.join(PSI_MODES)}")
        if self.phi_dot not in ("command", "measured", "zero"):
            raise ConfigError(f"control.phi_dot = {self.phi_dot!r} is not known; expected command, measured or zero")
        check_range("control.lambda", self.lambda_, 1e-6, 1e4, "s/m")
        check_range("control.xi", self.xi, 0.0, 1e3, "1/s")
        check_range("control.beta", self.beta, 0.0, 1e3, "1/s")
        check_range("control.zeta", self.zeta, 0.0, 1e9, "s/m^2")
        check_range("control.k_ps", self.k_ps, 1e-6, 1e4, "1/rad")
        check_range("control.u_max", self.u_max, 1e-6, 1e6, "of full opening")
        check_range("control.phi_dot_hz", self.phi_dot_hz, 0.01, 1e3, "Hz")


@dataclass(frozen=True)
class Noise:
    """Known noise of one signal, SI units; None where it is to be estimated."""

    std: float | None = None
    lsb: float | None = None


_MIN_OPENING = 0.02  # of full opening


@dataclass(frozen=True)
class Limits:
    """What counts as a fault, and when a verdict may be given.

    Attributes
    ----------
    brief : float
        A stuck or silent sensor that lasts no longer is tolerable (Assumption 1) [s].
    min_probability : float
        Probability from which a fault is stated [1].
    min_epsilon : float
        Smallest ε that is reported [1].
    min_sat : float
        Smallest saturation term that counts as non-zero: m/s, rad or valve fraction.
    min_assessed : float
        Decided driving time per wheel and side that ``ready`` needs [s].
    driving_speed : float
        |v_c,i| above which a wheel drives [m/s].
    clear_at : float
        Loss, or what deviates as much, that a mission must have shown to clear a machine [1].
    """

    brief: float = 1.0
    min_probability: float = 0.9
    min_epsilon: float = 0.1
    min_sat: float = 0.02
    min_assessed: float = 10.0
    driving_speed: float = 0.05
    clear_at: float = 0.25

    def __post_init__(self) -> None:
        """Check values."""
        check_range("limits.brief", self.brief, 0.0, 3600.0, "s")
        check_range("limits.min_probability", self.min_probability, 0.5, 0.9999, "")
        check_range("limits.min_epsilon", self.min_epsilon, 0.0, 1.0, "")
        check_range("limits.min_sat", self.min_sat, 0.0, 1e6, "m/s, rad or fraction")
        check_range("limits.min_assessed", self.min_assessed, 0.0, 1e6, "s")
        check_range("limits.driving_speed", self.driving_speed, 0.0, 1e6, "m/s")
        check_range("limits.clear_at", self.clear_at, 0.05, 0.9, "")

    @property
    def min_opening(self) -> float:
        """Smallest saturation term of a valve that counts [fraction of full opening]: `min_sat`, which goes with the top speed, or less."""
        return min(self.min_sat, _MIN_OPENING)


@dataclass(frozen=True)
class Machine:
    """A whole machine file.

    Attributes
    ----------
    name, id : str
        Shown name, and identity for trends across missions.
    wheels : tuple[str, ...]
        Drive wheels, or driven joints, in order (1…N).
    drive : str
        What moves them, for the words of a report: ``valve``, ``motor``, or ``auto``, which goes by the signals of the log.
    part : str
        What moves, for the words of a report: ``wheel`` or ``joint``.
    unpowered : tuple[str, ...]
        Those of `wheels` that have no drive and only roll along: of them only the speed is judged.
    speed_unit : str
        Unit in which their speeds, and all limits of speed, are given and shown: ``m/s`` at the rim, else ``rad/s`` or ``deg/s``.
    advice : Mapping[str, str]
        The operator's own instructions, by part, side and mode; see `diagnosis.decision.advice`.
    geometry : Geometry or None
        None: no kinematic evidence.
    gear_ratio : float
        Motor turns per wheel turn [1].
    max_speed : float
        Top speed at the rim [m/s], of joints in `speed_unit`.
    max_steer : float
        Largest steering angle [rad].
    signals : Mapping[str, SignalSource]
        Given signals; those absent are searched for.
    sources : Mapping[str, SourceOptions]
        Options per source, keyed by file name pattern.
    drives : Mapping[str, DriveModel]
        How single drives answer, by wheel; from healthy missions.
    efforts : Mapping[str, EffortModel]
        What effort the motion of each of several drives takes, by wheel; from healthy missions.
    steering : Mapping[str, AxlePlant]
        Valve, cylinder and sensor by steering axle; from healthy missions.
    assumed : tuple[str, ...]
        Keys that no machine file gave and that are the paper's machine's, of `ASSUMABLE`.
    questions : tuple[str, ...]
        What the draft of its file asked, and still does.
    """

    name: str
    id: str
    wheels: tuple[str, ...]
    geometry: Geometry | None
    gear_ratio: float = 1.0
    max_speed: float = 0.36
    max_steer: float = 0.7853981633974483
    control: Control = field(default_factory=Control)
    plant: Plant = field(default_factory=Plant)
    noise: Mapping[str, Noise] = field(default_factory=dict)
    limits: Limits = field(default_factory=Limits)
    sources: Mapping[str, SourceOptions] = field(default_factory=dict)
    signals: Mapping[str, SignalSource] = field(default_factory=dict)
    drives: Mapping[str, DriveModel] = field(default_factory=dict)
    efforts: Mapping[str, EffortModel] = field(default_factory=dict)
    steering: Mapping[str, AxlePlant] = field(default_factory=dict)
    drive: Drive = "auto"
    part: MovedPart = "wheel"
    speed_unit: SpeedUnit = "m/s"
    advice: Mapping[str, str] = field(default_factory=dict)
    unpowered: tuple[str, ...] = ()
    assumed: tuple[str, ...] = field(default=(), compare=False)
    questions: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        """Check values and that signals name this machine's wheels and axles."""
        for key, value, known in (
            ("drive", self.drive, DRIVES),
            ("part", self.part, MOVED_PARTS),
            ("speed_unit", self.speed_unit, SPEED_UNITS),
        ):
            if value not in known:
                raise ConfigError(f"machine.{key} = {value!r} is not known; expected one of {', '.join(known)}")
        if self.geometry is not None and (self.part != "wheel" or self.speed_unit != "m/s"):
            raise ConfigError(
                "machine.part = 'joint' and machine.speed_unit are for machines without [geometry]; leave the geometry out"
            )
        if not self.wheels or len(set(self.wheels)) != len(self.wheels):
            raise ConfigError(f"machine.wheels = {list(self.wheels)} must name each wheel once, and at least one")
        if self.geometry is not None and set(self.geometry.wheels) != set(self.wheels):
            raise ConfigError(
                f"geometry names the wheels {sorted(self.geometry.wheels)}, machine.wheels {sorted(self.wheels)}; "
                "give every wheel its place, or leave geometry out"
            )
        if self.geometry is not None:  # columns of the geometry stand in the order of the wheels
            places = {w: self.geometry.wheels[w] for w in self.wheels}
            object.__setattr__(self, "geometry", replace(self.geometry, wheels=places))
        check_range("geometry.gear_ratio", self.gear_ratio, 1e-3, 1e4, "")
        check_range("geometry.max_speed", self.max_speed, 1e-6, 1e6, self.speed_unit)
        check_range("geometry.max_steer", self.max_steer, 0.0, 3.2, "rad", mistaken=(DEGREES,))
        check_unpowered(self.unpowered, self.wheels, self.part, {"plant": self.plant.wheels, "drive": self.drives})
        self._check_drives()
        for section, names in (("signals", self.signals), ("noise", self.noise)):
            for name in names:
                self._check_name(section, name)
        check_own_channels(self.signals)

    def _check_drives(self) -> None:
        for name in self.drives:
            if name not in self.wheels:
                raise ConfigError(f"[drive] {name!r}: no such wheel; machine.wheels has {list(self.wheels)}")
        for name in self.efforts:
            if name not in self.wheels:
                raise ConfigError(f"[effort] {name!r}: no such wheel; machine.wheels has {list(self.wheels)}")
        for name in self.steering:
            if name not in self.axles:
                raise ConfigError(f"[steering] {name!r}: no such axle; the geometry has {list(self.axles)}")

    def _check_name(self, section: str, name: str) -> None:
        """Raise where a signal is not known or names no part of this machine."""
        signal_of(name)
        check_name(section, name, self.unpowered)
        group, _, rest = name.partition(".")
        part = rest.partition(".")[0]
        if group == "wheel" and part not in self.wheels:
            raise ConfigError(f"[{section}] {name!r}: no wheel {part!r}; machine.wheels has {list(self.wheels)}")
        if group == "steer" and self.geometry is not None and part not in self.axles:
            raise ConfigError(f"[{section}] {name!r}: no steering axle {part!r}; geometry has {list(self.axles)}")

    @property
    def driven(self) -> tuple[str, ...]:
        """Wheels with a drive, in the order of `wheels`."""
        return tuple(w for w in self.wheels if w not in self.unpowered)

    @property
    def driven_columns(self) -> list[int]:
        """Places of `driven` among `wheels`."""
        return [i for i, w in enumerate(self.wheels) if w not in self.unpowered]

    @property
    def axles(self) -> tuple[str, ...]:
        """Steered axles; empty without geometry."""
        return () if self.geometry is None else self.geometry.axles

    @property
    def wheel_radius(self) -> float | None:
        """Rolling radius [m], where the geometry gives it."""
        return None if self.geometry is None else self.geometry.wheel_diameter / 2

    def canonical_signals(self) -> tuple[str, ...]:
        """Every signal name that this machine can have, in reading order."""
        return names_of(self.wheels, self.axles, self.unpowered)


def haulotte() -> Machine:
    """Return the paper's machine: Haulotte 16RTJ PRO."""
    return Machine(
        name="Haulotte 16RTJ PRO",
        id="",
        wheels=("FR", "FL", "RR", "RL"),
        geometry=four_wheel_geometry(2.1, 1.46, 0.854, 0.20),
        gear_ratio=17.7,
        max_speed=0.36,
        # 63 l/min over motors of 100 cm³/rev, gear 17.7, wheel ⌀ 0.854 m
        plant=Plant(flow=1.59),
        assumed=ASSUMABLE,
    )
