"""Speeds and openings of all wheels as the mission has them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.control.loop import any_finite, stack
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WheelChannels:
    """Speeds and openings of all wheels, shape (n, wheels), and which of them are measured by two instruments (wheels,)."""

    v: Array
    u: Array
    true: Array
    applied: Array
    store: ColumnStore = field(default_factory=ColumnStore, repr=False)

    def without_speed(self, wheels: Sequence[int]) -> WheelChannels:
        """The same with the measured speeds of some wheels left out."""
        v = np.array(self.v)
        v[:, wheels] = np.nan
        return replace(self, v=v)

    @cached_property
    def has_true(self) -> NDArray[np.bool_]:
        """Wheels with a second speed. Shape (wheels,)."""
        return any_finite(self.true)

    @cached_property
    def has_applied(self) -> NDArray[np.bool_]:
        """Wheels whose opening is measured. Shape (wheels,)."""
        return any_finite(self.applied)

    def names(self, wheels: Sequence[str]) -> list[tuple[str, str]]:
        """Names of the better speed and opening of each wheel."""
        return [
            (f"wheel.{w}.{'v_true' if true else 'v'}", f"wheel.{w}.{'u_applied' if applied else 'u'}")
            for w, true, applied in zip(wheels, self.has_true, self.has_applied, strict=True)
        ]

    @cached_property
    def speed(self) -> Array:
        """The better speed of each wheel [m/s]. Shape (n, wheels)."""
        if not self.has_true.any():
            return self.v
        return self.store.map(lambda true, v: np.asarray(np.where(self.has_true, true, v)), self.true, self.v)

    @cached_property
    def opening(self) -> Array:
        """The better opening of each wheel [fraction]. Shape (n, wheels)."""
        if not self.has_applied.any():
            return self.u
        return self.store.map(
            lambda applied, u: np.asarray(np.where(self.has_applied, applied, u)), self.applied, self.u
        )


def wheel_channels(timeline: Timeline, machine: Machine) -> WheelChannels:
    """Channels of all wheels; NaN where a wheel lacks one."""
    v, u, true, applied = (
        stack(timeline, [f"wheel.{w}.{x}" for w in machine.wheels]) for x in ("v", "u", "v_true", "u_applied")
    )
    return WheelChannels(v, u, true, applied, timeline.store)
