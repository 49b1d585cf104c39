"""What is known of the wheels before a mission: lag, map of the valve, load, and the tyre's grip of each, and the pump's flow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

from replay.errors import ConfigError, check_range

Coupling = Literal["auto", "free", "ground"]


@dataclass(frozen=True)
class WheelPlant:
    """Wheel model τ v̇ = −v + K·sgn(u)·max(|u| − dead, 0) + offset + grip·(body − v) of one wheel.

    With `openings` the static map of the valve stands for K·sgn(u)·max(|u| − dead, 0), and K is its slope where the
    machine works.

    Attributes
    ----------
    K : float
        Speed per full opening [m/s].
    tau : float
        Lag [s].
    load : float or None
        Standard deviation of load and model error in healthy driving, as a speed [m/s]; None where not known.
    K_std, tau_std, load_std : float or None
        Standard deviations, same units; None where not known.
    dead : float
        Opening that static friction takes, which gives no speed [fraction].
    dead_std : float or None
        Its standard deviation [fraction].
    offset : float
        Constant load as a speed [m/s].
    offset_std : float or None
        Its standard deviation [m/s].
    openings, speeds : tuple[float, ...]
        Map of the valve: speeds without load [m/s] at rising openings [fraction]; empty: linear with a dead zone.
    unseen : tuple[float, ...]
        By how much faster the wheel may be at these openings, as nobody saw it there [m/s]; negative in reverse.
    hysteresis : float
        Width of the spool's play before the map [fraction].
    grip : float or None
        Speed that the tyre's force costs per slip against the body [1]; 0 for wheels off the ground; None: not known.
    wander : float or None
        What the model leaves unexplained from block to block [m/s/√s]; None: not known.
    """

    K: float
    tau: float
    load: float | None = None
    K_std: float | None = None
    tau_std: float | None = None
    load_std: float | None = None
    dead: float = 0.0
    dead_std: float | None = None
    offset: float = 0.0
    offset_std: float | None = None
    openings: tuple[float, ...] = ()
    speeds: tuple[float, ...] = ()
    unseen: tuple[float, ...] = ()
    hysteresis: float = 0.0
    grip: float | None = None
    wander: float | None = None

    def __post_init__(self) -> None:
        """Check values."""
        self._check_map()
        check_range("plant.K", self.K, 1e-9, 1e9, "m/s per full opening")
        check_range("plant.tau", self.tau, 1e-4, 60.0, "s")
        check_range("plant.dead", self.dead, 0.0, 1e6, "of full opening")
        check_range("plant.offset", self.offset, -1e6, 1e6, "m/s")
        check_range("plant.hysteresis", self.hysteresis, 0.0, 1.0, "of full opening")
        spreads = (("load", "m/s"), ("K_std", "m/s"), ("tau_std", "s"), ("load_std", "m/s"), ("dead_std", ""))
        for name, unit in (*spreads, ("offset_std", "m/s"), ("grip", ""), ("wander", "m/s/√s")):
            value = getattr(self, name)
            if value is not None:
                check_range(f"plant.{name}", value, 0.0, 1e9, unit)

    def _check_map(self) -> None:
        """Raise where the valve's map is none."""
        sizes = {len(self.openings), len(self.speeds)} | ({len(self.unseen)} if self.unseen else set())
        if len(sizes) > 1:
            raise ConfigError(
                f"plant.openings, speeds and unseen have {len(self.openings)}, {len(self.speeds)} and {len(self.unseen)} "
                "values; give as many speeds as openings"
            )
        if len(self.openings) == 1:
            raise ConfigError("plant.openings has one value; a map needs two at least")
        if any(b <= a for a, b in pairwise(self.openings)) or any(b < a for a, b in pairwise(self.speeds)):
            raise ConfigError("plant.openings must rise and plant.speeds must not fall")


@dataclass(frozen=True)
class Plant:
    """What is known of the wheels before the mission.

    Attributes
    ----------
    coupling : str
        ``free`` (wheels off the ground), ``ground``, or ``auto``.
    flow : float or None
        Sum of all wheels' speeds that the pump can feed [m/s]; None where every wheel has its own supply.
    wheels : Mapping[str, WheelPlant]
        Wheel models by name.
    """

    coupling: Coupling = "auto"
    flow: float | None = None
    wheels: Mapping[str, WheelPlant] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check values."""
        if self.coupling not in ("auto", "free", "ground"):
            raise ConfigError(f"plant.coupling = {self.coupling!r} is not known; expected auto, free or ground")
        if self.flow is not None:
            check_range("plant.flow", self.flow, 1e-6, 1e6, "m/s, summed over the wheels")
