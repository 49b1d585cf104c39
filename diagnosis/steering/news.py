"""Readings that a logger writes more often than the sensor renews them: a repeated value is no second measurement.

A controller reads its sensors once in a cycle, and what is recorded in between says the same again. While an axle turns by more
than the rounding from row to row every renewed reading is another one, so that the rows between two changes tell the cycle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.held import news_alone
from diagnosis.channels.sample_status import PAIR, SKIP
from replay.machine.config import Machine
from replay.signals.resolution import rounding_step
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_LEAVES = ("phi", "phi_true", "u_applied")
_TURNS = 8  # rows over which a channel turns
_STEPS = 2.0  # rounding steps from row to row, from which on every new reading is another one
_LOOKED = 2_000_000  # steps: a controller keeps its cycle, and the columns of a long mission stay where they are
_FEW = 30  # rows in which it turns
_LONGEST_S = 0.1  # of a controller's cycle
_OFTEN = 1.5  # rows to a reading: less is no cycle


def with_news(timeline: Timeline, machine: Machine) -> Timeline:
    """A timeline on which only renewed readings of the steering are fresh; the same one where all of them are.

    One controller reads the sensors of all axles: what one of them renews more rarely than another one is its fault.
    """
    found = {}
    for leaf in _LEAVES:
        names = [f"steer.{axle}.{leaf}" for axle in machine.axles]
        known = [(name, y) for name in names if (y := timeline.get(name)) is not None]
        cycles = [cycle(y, timeline.fresh[name]) for name, y in known]
        held = min((c for c in cycles if c is not None), default=0.0)
        if not held or None in cycles or held * timeline.dt > _LONGEST_S:
            continue
        for name, y in known:
            status = np.where(timeline.fresh[name] & np.isfinite(y), PAIR, SKIP).astype(np.int8)
            found[name] = news_alone(status, y, np.full(y.size, held), 1.0) == PAIR
    return replace(timeline, fresh={**timeline.fresh, **found}) if found else timeline


def cycle(y: Array, fresh: NDArray[np.bool_]) -> float | None:
    """Steps between two renewed readings, None where every row is one, or nothing tells.

    Parameters
    ----------
    y : Array, shape (n,)
        A channel; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a row of it.
    """
    at = np.flatnonzero(fresh[:_LOOKED] & np.isfinite(y[:_LOOKED]))
    if at.size <= 2 * _TURNS:
        return None
    values = y[at]
    least = max(_STEPS * rounding_step(values), float(np.spacing(np.abs(values).max()))) * 2 * _TURNS
    turns = np.zeros(at.size, dtype=np.bool_)
    turns[_TURNS:-_TURNS] = np.abs(values[2 * _TURNS :] - values[: -2 * _TURNS]) > least
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    runs = np.diff(changes)
    runs = runs[turns[changes[:-1]] & turns[changes[1:] - 1]]
    if runs.sum() < _FEW or float(np.mean(runs)) < _OFTEN:
        return None
    return float(np.median(runs)) * float(np.median(np.diff(at)))
