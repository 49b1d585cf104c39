"""Motion and efforts of all drives in steps of a second: what a relation between them is found from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

STEP_S = 1.0
_KNOWN = 0.8  # of a step that must be known
TERMS = ("offset", "friction", "viscous", "inertia", "turn", "scrub")


class EffortSteps(NamedTuple):
    """Means over steps of a second, each of shape (steps, wheels).

    Attributes
    ----------
    effort : Array
        Effort of each drive [its unit].
    speed, rate : Array
        Speed [m/s] and what it changes by [m/s²].
    apart : Array
        What each speed differs from the mean of all of them [m/s].
    use : Flags
        Where a wheel is driven one way all the step, and all is known.
    length : int
        Samples in a step.
    command : Array
        Commanded speed [m/s]; NaN where unknown.
    """

    effort: Array
    speed: Array
    rate: Array
    apart: Array
    use: Flags
    length: int
    command: Array

    def terms(self, wheel: int, least_speed: float) -> Array:
        """What the effort of a wheel is a sum of, shape (steps, len(`TERMS`)): 1, the way, speed, change, what it turns by, and the way of that.

        `least_speed` [m/s]: by which a way is told.
        """
        v, d = self.speed[:, wheel], self.apart[:, wheel]
        columns = [np.ones(v.size), np.sign(v), v, self.rate[:, wheel], d, d / (np.abs(d) + least_speed)]
        return np.asarray(np.nan_to_num(np.column_stack(columns)), dtype=np.float64)


def steps_of(timeline: Timeline, machine: Machine, wheels: Sequence[str], v_ref: Array | None = None) -> EffortSteps:
    """Steps of a mission.

    Parameters
    ----------
    timeline : Timeline
        The aligned mission.
    machine : Machine
        ``limits.driving_speed``.
    wheels : Sequence[str]
        Those with speed and effort.
    v_ref : Array or None, shape (n, wheels of the machine)
        Commanded speeds [m/s].
    """
    length = max(1, round(STEP_S / timeline.dt))
    count = timeline.size // length
    least = machine.limits.driving_speed

    def cut(name: str) -> Array:
        found = timeline.get(name)
        x = np.full(timeline.size, np.nan) if found is None else found
        return np.asarray(x[: count * length], dtype=np.float64).reshape(count, length)

    speeds = [cut(f"wheel.{w}.v") for w in wheels]
    efforts = [cut(f"wheel.{w}.effort") for w in wheels]
    v, e = (np.column_stack([_mean(x) for x in xs]) for xs in (speeds, efforts))
    ends = [(_mean(x[:, : max(1, length // 5)]), _mean(x[:, -max(1, length // 5) :])) for x in speeds]
    rate = np.column_stack([(b - a) / (0.8 * STEP_S) for a, b in ends])
    one_way = np.column_stack([np.nanmin(np.abs(np.where(np.isfinite(x), x, np.inf)), axis=1) > least for x in speeds])
    same = np.column_stack([np.abs(_mean(np.sign(x))) > 0.999 for x in speeds])
    known = np.isfinite(v) & np.isfinite(e)
    places = [machine.wheels.index(w) for w in wheels]
    asked = (
        np.full(v.shape, np.nan)
        if v_ref is None
        else np.column_stack([_mean(v_ref[: count * length, i].reshape(count, length)) for i in places])
    )
    return EffortSteps(e, v, rate, v - _mean(v)[:, np.newaxis], one_way & same & known, length, asked)


def _mean(x: Array) -> Array:
    """Mean of each row of what is known, NaN where less than `_KNOWN` is."""
    known = np.isfinite(x)
    count = known.sum(axis=1)
    total = np.where(known, x, 0.0).sum(axis=1)
    return np.asarray(np.where(count >= _KNOWN * x.shape[1], total / np.maximum(count, 1), np.nan))
