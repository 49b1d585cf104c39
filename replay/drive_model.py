"""What healthy missions say about a single drive: how its controller answers to speed, and what effort a speed takes."""

from __future__ import annotations

from dataclasses import dataclass

from replay.checks import check_range
from replay.errors import ConfigError


@dataclass(frozen=True)
class EchoModel:
    """How the effort of a proportional-integral speed controller echoes the speed that the controller saw.

    u = Kp·[w·r − v + ∫(r − v)/Ti]: high-passed with Ti, the effort is −Kp times the tracking error, so that the speed
    can be read back from command and effort alone: v̂ = r + Σ gᵢ·HP(u)(t + (first + i)·step) + (w − 1)·HP(r).

    Attributes
    ----------
    gains : tuple[float, ...]
        gᵢ [m/s per unit of effort].
    first : int
        Lead of the first gain: steps by which the effort answers later than the speed [1].
    memory_s : float
        Ti, the controller's integral time [s].
    setpoint : float
        w − 1: what the proportional part leaves out of the command [1].
    noise : float
        Root mean square of measured minus echoed speed [m/s].
    exact, core : float
        Share of samples for which the log holds just the speed that the controller used [1], and their noise [m/s];
        the others are a step late.
    step_s : float
        Step for which the gains hold [s].
    """

    gains: tuple[float, ...]
    first: int
    memory_s: float
    setpoint: float
    noise: float
    exact: float
    core: float
    step_s: float

    def __post_init__(self) -> None:
        """Check values."""
        if not self.gains:
            raise ConfigError("drive.gains is empty; expected at least one gain, or no echo model at all")
        check_range("drive.memory_s", self.memory_s, 1e-3, 1e3, "s")
        check_range("drive.noise", self.noise, 1e-12, 1e9, "m/s")
        check_range("drive.exact", self.exact, 0.0, 1.0, "")
        check_range("drive.core", self.core, 1e-12, 1e9, "m/s")
        check_range("drive.step_s", self.step_s, 1e-5, 10.0, "s")


@dataclass(frozen=True)
class EffortMap:
    """Effort that a healthy drive needs to hold a speed: |u| = offset + slope·|v|.

    Attributes
    ----------
    offset, slope : float
        Effort at standstill [unit of effort], and effort per speed [unit of effort per m/s].
    between : float
        Standard deviation of a mission's own offset from the map: temperature, wear, load of the day [unit of effort].
    drift : float
        Random walk of that offset within a mission [unit of effort per √s].
    noise : float
        Standard deviation of the mean over one second [unit of effort].
    """

    offset: float
    slope: float
    between: float
    drift: float
    noise: float

    def __post_init__(self) -> None:
        """Check values."""
        for name in ("between", "drift", "noise"):
            check_range(f"drive.{name}", getattr(self, name), 0.0, 1e9, "unit of effort")


@dataclass(frozen=True)
class DriveModel:
    """Both models of a drive; None where its missions did not show them."""

    echo: EchoModel | None = None
    effort: EffortMap | None = None
