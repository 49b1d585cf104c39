"""A channel and an independent measurement of the same quantity, taken from the mission."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.habit import EVERY_SAMPLE, Habit
from diagnosis.channels.liveness import alive
from diagnosis.channels.noise import usual_distance
from replay.arrays.column_store import ColumnStore
from replay.faults import Side
from replay.machine.config import Machine, Noise
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_MUCH_RARER, _FEW = 2.0, 3


@dataclass(frozen=True, eq=False)
class Pair:
    """A channel and its reference.

    Attributes
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`.
    y, x : Array, shape (n,)
        Measured value and reference, SI; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new sample of y; where x comes at less than half of y's rate, those of them at which x is new too: what
        x was in between is not known, unless it is a command that stands.
    alive : NDArray[np.bool_], shape (n,)
        Whether another channel of y's source delivers.
    quiet : NDArray[np.bool_], shape (n,)
        Where the component is neither commanded nor moving.
    dt : float
        Step [s].
    unit : str
        Unit of y.
    span : float
        Largest plausible magnitude [unit].
    y_name, x_name : str
        Canonical names, for the text.
    known_noise : Noise
        From the machine file.
    instruments : Callable or None
        Gives signals that drive x but know nothing of the fault, shape (n, k), for a pair that has one; see
        `diagnosis.estimation.fault_size`.
    habit : Habit
        How y is updated.
    store : ColumnStore
        Where long columns stand.
    """

    side: Side
    y: Array
    x: Array
    fresh: NDArray[np.bool_]
    alive: NDArray[np.bool_]
    quiet: NDArray[np.bool_]
    dt: float
    unit: str
    span: float
    y_name: str
    x_name: str
    known_noise: Noise
    instruments: Callable[[], Array | None] | None = None
    habit: Habit = EVERY_SAMPLE
    store: ColumnStore = field(default_factory=ColumnStore, repr=False)


def make_pair(
    timeline: Timeline,
    counts: dict[str, NDArray[np.int16]],
    side: Side,
    y_name: str,
    x_name: str,
    quiet: NDArray[np.bool_],
    unit: str,
    span: float,
    machine: Machine,
) -> Pair:
    """Channel and reference of one component and side.

    Parameters
    ----------
    timeline : Timeline
        The aligned mission.
    counts : dict[str, NDArray[np.int16]]
        From `diagnosis.channels.liveness.alive_sources`.
    side : Side
        `SENSOR` or `ACTUATOR`.
    y_name, x_name : str
        Canonical names of the channel and of its reference.
    quiet : NDArray[np.bool_], shape (n,)
        Where the component is neither commanded nor moving.
    unit : str
        Unit of both.
    span : float
        Largest plausible magnitude [unit]; larger where the log has larger values.
    machine : Machine
        Its file may give the channel's noise.
    """
    y, x = timeline.signals[y_name], timeline.signals[x_name]
    largest = 0.0
    if np.isfinite(y).any():
        largest = max(float(np.nanmax(np.abs(z[part]), initial=0.0)) for z in (y, x) for part in timeline.blocks())
    return Pair(
        side=side,
        y=y,
        x=x,
        fresh=timeline.fresh[y_name]
        if x_name in timeline.stands
        else _beside(timeline.fresh[y_name], timeline.fresh[x_name]),
        alive=alive(timeline, counts, y_name),
        quiet=quiet,
        dt=timeline.dt,
        unit=unit,
        span=max(span, largest),
        y_name=y_name,
        x_name=x_name,
        known_noise=machine.noise.get(y_name, Noise()),
        store=timeline.store,
    )


def _beside(y: NDArray[np.bool_], x: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """New samples of y beside a new one of a reference that comes much more rarely; all of them beside any other."""
    if min(np.count_nonzero(y), np.count_nonzero(x)) < _FEW or usual_distance(x) < _MUCH_RARER * usual_distance(y):
        return y
    later = np.r_[False, x[:-1]]  # stamps of one moment may fall into two steps
    return max(y & x, y & later, key=np.count_nonzero)
