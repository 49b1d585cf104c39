"""What healthy missions say about the effort of one of several drives: what its motion takes, and by how much it is off that."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from replay.errors import ConfigError, check_range
from replay.machine.number_tables import numbers_of

#: Lengths over which an effort is held against its motion [driven s]; the last one stands for the whole mission.
LENGTHS_S = (6, 15, 60)


@dataclass(frozen=True)
class EffortModel:
    """Effort that the motion of one of several wheels takes: e = offset + friction·way + viscous·v + inertia·v̇ + turn·d + scrub·way of d.

    d is what the wheel's speed differs from the mean of all wheels: what a turn makes of it.

    Attributes
    ----------
    offset, friction, viscous, inertia, turn, scrub : float
        [unit of effort], [unit], [unit per m/s], [unit per m/s²], [unit per m/s], [unit].
    usual : float
        Root mean square of the effort while driven [unit of effort].
    off : tuple[float, ...]
        Largest share by which a healthy wheel of this machine was off, in missions that were left out of the fit, over each of `LENGTHS_S` [1].
    fastest, quickest : float
        Largest speed [m/s] and change of speed [m/s²] of these missions.
    held : float
        What is left of the effort at steady commands beside what command and error of the moment make of it, as a share of the usual one [1]: what an
        integral part holds. 0: no loop holds the speed, or one without memory.
    missions : float
        How many missions there were.
    """

    offset: float
    friction: float
    viscous: float
    inertia: float
    turn: float
    scrub: float
    usual: float
    off: tuple[float, ...]
    fastest: float
    quickest: float
    held: float
    missions: float

    def __post_init__(self) -> None:
        """Check values."""
        check_range("effort.usual", self.usual, 1e-12, 1e12, "unit of effort")
        if len(self.off) != len(LENGTHS_S):
            raise ConfigError(
                f"effort.off = {list(self.off)!r}; expected {len(LENGTHS_S)} numbers, as `mfhca fit` writes them"
            )
        for x in self.off:
            check_range("effort.off", x, 0.0, 1e6, "")

    @property
    def terms(self) -> tuple[float, ...]:
        """The coefficients in the order of `diagnosis.efforts.windows.TERMS`."""
        return self.offset, self.friction, self.viscous, self.inertia, self.turn, self.scrub


def effort_table(model: EffortModel) -> dict[str, Any]:
    """Table of one wheel in a machine file's [effort]; see `effort_from_table`."""
    return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(model).items()}


def effort_from_table(key: str, table: Any) -> EffortModel:
    """Effort model from a machine file.

    Parameters
    ----------
    key : str
        Where the table stands, for messages: ``effort.<wheel>``.
    table : Any
        All fields of `EffortModel`.

    Raises
    ------
    ConfigError
        Where a key is missing, unknown or no finite number.
    """
    return EffortModel(**numbers_of(key, table, EffortModel, ("off",)))
