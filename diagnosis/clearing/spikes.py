"""A speed sensor whose single readings leap again and again while those beside them are right: noisy, however few of its readings leap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.leaps import heights, longest_series
from diagnosis.clearing.untold_faults import finding_of
from diagnosis.clearing.wild import wild_at
from diagnosis.results.assessment import Finding
from diagnosis.results.sizes import amount
from replay.faults import FaultMode, Side

_LEAST = 8  # leaps of one fault
_MOST = 0.12  # of the readings: more of them are no single ones, but how coarse a speed is read
_LASTS_S = 3.0
_ALIKE = 0.3  # of a leap, by which a second speed leaps the same way
_SPIKES = "Spikes: {number} of {all} readings of {name} leap from both readings beside them and back, by about {size}; the inertia of a {{wheel}} forbids that."
_SECOND = "{second} does not leap with them."


def fault_of_spikes(wheel: str, cells: Cells) -> Finding | None:
    """The longest time in which single readings of a wheel's speed leap, no fault of it being stated there; None where they hardly do.

    Parameters
    ----------
    wheel : str
        The wheel.
    cells : Cells
        The mission.
    """
    name, second = f"wheel.{wheel}.v", f"wheel.{wheel}.v_true"
    at, height = longest_series(wheel, cells, *wild_at(cells, name))
    if at.size < _LEAST:
        return None
    first, last = int(at[0]), int(at[-1]) + 1
    fresh = int(np.count_nonzero(cells.timeline.fresh[name][first:last]))
    if at.size > _MOST * fresh or (last - first) * cells.timeline.dt < _LASTS_S:
        return None
    x = cells.timeline.get(second)
    if x is not None and _leaps_too(x, at, height):
        return None
    size = amount(float(np.median(height)), "m/s", 2)
    evidence = [_SPIKES.format(number=at.size, all=fresh, name=name, size=size)]
    evidence += [] if x is None else [_SECOND.format(second=second)]
    return finding_of((first, last), FaultMode.NOISY, None, tuple(evidence), Side.SENSOR)


def _leaps_too(x: Array, at: NDArray[np.intp], height: Array) -> bool:
    """Whether a second speed, shape (n,), leaps at most of some samples, by a good part of these heights: then the wheel does."""
    inner = (at > 0) & (at < x.size - 1)
    before, after = x[at[inner]] - x[at[inner] - 1], x[at[inner]] - x[at[inner] + 1]
    leap = heights(before, after)
    return bool(leap.size and np.mean(leap > _ALIKE * height[inner]) > 0.5)
