"""The wheel models of a mission, as they were identified or given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from replay.faults import Side
from replay.machine.config import WheelPlant

#: Loss of each side below which evidence weaker than a second measurement mostly shows none, on machines that nothing was tuned on.
RESOLUTION: Mapping[Side, float] = MappingProxyType({Side.SENSOR: 0.25, Side.ACTUATOR: 0.5})


@dataclass(frozen=True)
class WheelModelFit:
    """Wheel models of one mission.

    Attributes
    ----------
    plants : tuple[WheelPlant or None, ...]
        Per wheel; None where nothing can be identified.
    spread : float
        Relative spread of the windows' gains (robust standard deviation over median).
    windows : int
        Windows used.
    reliable : bool
        Whether gains may be judged by it.
    note : str
        The figures in words.
    identified : bool
        Whether a wheel's model comes from this mission rather than from the machine file.
    may_hold : float
        Share of its speed that the ground may give a wheel although its model is free of the ground [1].
    """

    plants: tuple[WheelPlant | None, ...]
    spread: float
    windows: int
    reliable: bool
    note: str
    identified: bool = True
    may_hold: float = 0.0
