"""A judged mission of a machine, and how long a part of it was judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from diagnosis.audit.fleet.read import FoundFault, Part, Result
from diagnosis.results.machine_words import HYDRAULIC, MachineWords
from diagnosis.results.vocabulary import Severity
from replay.faults import Side

_LEAST_SHARE = 0.8


@dataclass(frozen=True)
class Limits:
    """What a report says of limits, steering components, leave to go out (None: it does not say), and words.

    The defaults are those of the paper's machine. `found` has the share of places of the mission at which a fault of ten
    seconds would have been found, by component, side and mode; what is not there was not said.
    """

    min_epsilon: float = 0.1
    min_assessed: float = 10.0
    wheels: tuple[str, ...] = ("FR", "FL", "RR", "RL")
    axles: tuple[str, ...] = ("front", "rear")
    cleared: bool | None = None
    found: Mapping[tuple[str, str, str], float] = field(default_factory=dict, hash=False)
    words: MachineWords = HYDRAULIC


@dataclass(frozen=True)
class Run:
    """A judged mission of a machine; `name` is that of the first of its copies."""

    name: str
    result: Result
    copies: int = 0

    @cached_property
    def faults(self) -> tuple[FoundFault, ...]:
        """Faults that count: those of at least low severity."""
        return tuple(f for f in self.result.faults if f.severity != Severity.INFO)

    @property
    def worst(self) -> FoundFault | None:
        """The most severe and longest of them."""
        return max(self.faults, key=lambda f: (f.severity.rank, f.seconds), default=None)

    @cached_property
    def parts(self) -> dict[tuple[str, str], Part]:
        """Its parts by component and side."""
        return {(p.component, p.side): p for p in self.result.parts}

    def assessed(self, component: str, side: str, limits: Limits) -> bool:
        """Whether a part was judged for as long as a verdict of ``ready`` takes."""
        keys = [(component, s) for s in sides_of(side)]
        return all(k in self.parts and is_assessed(self.parts[k], limits) for k in keys)


def sides_of(side: str) -> tuple[str, ...]:
    """The two sides of a fault that may be of either."""
    return (Side.SENSOR, Side.ACTUATOR) if side == Side.SENSOR_OR_ACTUATOR else (side,)


def is_assessed(part: Part, limits: Limits) -> bool:
    """Whether a part was judged for `min_assessed` seconds and four fifths of its driving."""
    return part.decided_s > 0 and part.decided_s >= max(limits.min_assessed, _LEAST_SHARE * part.driving_s)
