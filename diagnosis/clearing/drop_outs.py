"""A speed that drops to 0 and comes back at once, again and again, as behind a loose contact: no wheel stops and starts like that."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.leaps import longest_series
from diagnosis.clearing.untold_faults import finding_of
from diagnosis.results.assessment import Finding
from diagnosis.results.sizes import amount
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side

_LONGEST_S, _OF_TOP = 0.15, 0.1  # of a drop, and share of the top speed that is read before and after it
_LEAST, _LASTS_S = 8, 3.0  # drops of one fault; which lasts at least
_ALIKE = 0.5  # of the drops, in which a second speed drops, too
_DROPS = "{name} drops to 0 and back {number} times within {longest:g} s each, from about {size}, as behind a loose contact: the inertia of a {{wheel}} forbids that."
_SECOND = "{second} does not drop with it."


def fault_of_drop_outs(wheel: str, cells: Cells) -> Finding | None:
    """The longest time in which a wheel's speed drops out again and again, no fault of it being stated there; None where it hardly does."""
    name, second, dt = f"wheel.{wheel}.v", f"wheel.{wheel}.v_true", cells.timeline.dt
    at, height = longest_series(wheel, cells, *_drops(cells, name))
    if at.size < _LEAST:
        return None
    first, last = int(at[0]), int(at[-1]) + 1
    if (last - first) * dt < _LASTS_S:
        return None
    x = cells.timeline.get(second)
    if x is not None and np.mean(np.abs(x[at]) < 0.5 * height) > _ALIKE:
        return None
    size = amount(float(np.median(height)), "m/s", 2)
    evidence = [_DROPS.format(name=name, number=at.size, longest=_LONGEST_S, size=size)]
    evidence += [] if x is None else [_SECOND.format(second=second)]
    return finding_of((first, last), FaultMode.NOISY, None, tuple(evidence), Side.SENSOR)


def _drops(cells: Cells, name: str) -> tuple[NDArray[np.intp], Array]:
    """First samples of the drops of a speed to 0, and what is read beside them [m/s], each of shape (k,)."""
    y, timeline = cells.timeline.get(name), cells.timeline
    if y is None:
        return np.zeros(0, np.intp), np.zeros(0)
    at = np.flatnonzero(timeline.fresh[name] & np.isfinite(y))
    v = y[at]
    runs = [
        (a, b)
        for a, b in runs_of(v == 0.0)
        if a > 0 and b < v.size and (at[b] - at[a - 1]) * timeline.dt <= _LONGEST_S and v[a - 1] * v[b] > 0.0
    ]
    height = np.array([min(abs(v[a - 1]), abs(v[b])) for a, b in runs])
    high = height > _OF_TOP * cells.machine.max_speed if runs else np.zeros(0, np.bool_)
    return np.array([at[a] for a, _ in runs], np.intp)[high], height[high]
