"""A judged mission of a machine, and how long a part of it was judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from diagnosis.audit.fleet.parts import PartKey
from diagnosis.audit.fleet.read import FoundFault, Result
from diagnosis.results.machine_words import HYDRAULIC, MachineWords
from diagnosis.results.vocabulary import Severity
from replay.faults import Side


@dataclass(frozen=True)
class Limits:
    """What a report says of limits, steering components, leave to go out (None: it does not say), and words.

    The defaults are those of the paper's machine. `found` has the share of places of the mission at which a fault of ten
    seconds would have been found, by component, side and mode; what is not there was not said. `not_cleared` is why faults to watch
    give no leave; `open_points` what it leaves open without a fault, each with its parts, and `suspected` those of them in which something
    deviates, each with its components and sides; `holds_open` whether an audit has written into the
    report that a fault of an earlier mission is open.
    """

    min_epsilon: float = 0.1
    min_assessed: float = 10.0
    wheels: tuple[str, ...] = ("FR", "FL", "RR", "RL")
    axles: tuple[str, ...] = ("front", "rear")
    cleared: bool | None = None
    not_cleared: str = ""
    open_points: tuple[str, ...] = ()
    suspected: tuple[tuple[tuple[PartKey, ...], str], ...] = ()
    holds_open: bool = False
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

    def assessed_parts(self, limits: Limits) -> set[PartKey]:
        """Components and sides that were judged for as long as a verdict of ``ready`` takes."""
        rows = self.result.parts.rows()
        assessed = self.result.parts.table.assessed(np.array(list(rows.values()), np.intp), limits.min_assessed)
        return {key for key, enough in zip(rows, assessed.tolist(), strict=True) if enough}

    def assessed(self, component: str, side: str, limits: Limits) -> bool:
        """Whether a part, or both sides of it, were."""
        return {(component, s) for s in sides_of(side)} <= self.assessed_parts(limits)


def sides_of(side: str) -> tuple[str, ...]:
    """The two sides of a fault that may be of either."""
    return (Side.SENSOR, Side.ACTUATOR) if side == Side.SENSOR_OR_ACTUATOR else (side,)
