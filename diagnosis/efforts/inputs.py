"""Which drives of a machine have efforts, and what these tell: what is asked of a motor, or what it gives."""

from __future__ import annotations

import numpy as np

from replay.machine.config import Machine
from replay.machine.units import known_unit
from replay.signals.timeline import Timeline

_ASKED = ("1", "fraction", "%", "V")  # units of what a bridge is told to put on its motor


def wheels_with_efforts(timeline: Timeline, machine: Machine) -> tuple[str, ...]:
    """Wheels with a drive of which speed and effort are logged, and the effort is not nothing."""
    return tuple(
        w
        for w in machine.wheels
        if w not in machine.unpowered and _moves(timeline, f"wheel.{w}.v") and _moves(timeline, f"wheel.{w}.effort")
    )


def _moves(timeline: Timeline, name: str) -> bool:
    x = timeline.get(name)
    return x is not None and bool(np.nanmax(np.abs(x), initial=0.0) > 0.0)


def is_asked(machine: Machine, wheel: str) -> bool:
    """Whether an effort is what is asked of the motor, a duty or a voltage, and no torque or current that it gives.

    A loss between what is asked and what is given shows in the former alone: a loop around the speed takes it back by asking for more.
    """
    source = machine.signals.get(f"wheel.{wheel}.effort")
    return source is not None and known_unit(source.unit or "") in _ASKED
