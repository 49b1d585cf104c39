"""What healthy missions say about a single drive: how its controller answers to speed, and what effort a speed takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.errors import ConfigError, check_range
from replay.machine.number_tables import numbers_of

_NEARLY = 0.05  # of a speed: means over a second scatter about the one that is commanded


@dataclass(frozen=True)
class InverseController:
    """Inverse model of a proportional-integral speed controller: its effort implies the speed that it saw.

    u = Kp·[w·r − v + ∫(r − v)/Ti]: high-passed with Ti, the effort is −Kp times the tracking error, so that the speed
    can be read back from command and effort alone: v̂ = r + Σ gᵢ·HP(u)(t + (first + i)·step) + (w − 1)·HP(r).

    Attributes
    ----------
    gains : tuple[float, ...]
        gᵢ [m/s per unit of effort].
    first : int
        Lead of the first gain: steps by which the effort answers later than the speed [1].
    memory_s, memory_std_s : float
        Ti, the controller's integral time, and its standard deviation [s].
    setpoint : float
        w − 1: what the proportional part leaves out of the command [1].
    noise : float
        Root mean square of measured minus implied speed [m/s].
    exact, core : float
        Share of samples for which the log holds just the speed that the controller used [1], and their noise [m/s];
        the others are a step late.
    step_s : float
        Step for which the gains hold [s].
    """

    gains: tuple[float, ...]
    first: int
    memory_s: float
    memory_std_s: float
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
        check_range("drive.memory_std_s", self.memory_std_s, 0.0, 1e3, "s")
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
    slowest, fastest : float
        Speeds between which healthy missions drove [m/s].
    """

    offset: float
    slope: float
    between: float
    drift: float
    noise: float
    slowest: float
    fastest: float

    def __post_init__(self) -> None:
        """Check values."""
        for name in ("between", "drift", "noise"):
            check_range(f"drive.{name}", getattr(self, name), 0.0, 1e9, "unit of effort")
        check_range("drive.slowest", self.slowest, 0.0, 1e9, "m/s")
        check_range("drive.fastest", self.fastest, self.slowest, 1e9, "m/s")

    def covers(self, speed: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether healthy missions drove at speeds |v| [m/s], or nearly so; both of one shape. Beyond them the line is a guess."""
        return np.asarray(
            (speed >= (1.0 - _NEARLY) * self.slowest) & (speed <= (1.0 + _NEARLY) * self.fastest), dtype=np.bool_
        )


@dataclass(frozen=True)
class DriveModel:
    """Both models of a drive; None where its missions did not show them."""

    echo: InverseController | None = None
    effort: EffortMap | None = None


def drive_table(model: DriveModel) -> dict[str, dict[str, Any]]:
    """Tables ``echo`` and ``effort`` of a machine file's [drive.<wheel>]; see `drive_from_table`."""
    out: dict[str, dict[str, Any]] = {}
    for name, part in (("echo", model.echo), ("effort", model.effort)):
        if part is not None:
            out[name] = {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(part).items()}
    return out


def drive_from_table(key: str, table: Mapping[str, Any]) -> DriveModel:
    """Drive model from a machine file.

    Parameters
    ----------
    key : str
        Where the table stands, for messages: ``drive.<wheel>``.
    table : Mapping[str, Any]
        With ``echo``, ``effort`` or both.

    Raises
    ------
    ConfigError
        Where a key is missing, unknown or no finite number.
    """
    unknown = sorted(set(table) - {"echo", "effort"})
    if unknown:
        raise ConfigError(f"{key}.{unknown[0]} is not known; expected echo or effort")
    echo, effort = table.get("echo"), table.get("effort")
    return DriveModel(
        echo=None if echo is None else InverseController(**_numbers(f"{key}.echo", echo, InverseController)),
        effort=None if effort is None else EffortMap(**_numbers(f"{key}.effort", effort, EffortMap)),
    )


def _numbers(key: str, table: Any, kind: type) -> dict[str, Any]:
    """Fields of one part, each a number (``gains``: a list of them, ``first``: a whole one)."""
    out = numbers_of(key, table, kind, ("gains",))
    if "first" in out:
        if not out["first"].is_integer():
            raise ConfigError(f"{key}.first = {out['first']!r}; expected a whole number of steps")
        out["first"] = int(out["first"])
    return out
