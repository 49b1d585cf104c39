"""Whether the machine turns, by its gyro, all the time by one share of what each steering angle reads: its sensor then has not come to read another share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells, Frame
from diagnosis.clearing.responses import growth, largest_change
from diagnosis.clearing.yaw import turn_of_ends

_WINDOW_S, _LEAST_S = 8.0, 1.5  # of a window, and steered in it
_LEAST_WINDOWS = 16
_SPAN = 0.75  # of the time from the first window in which it is steered to the last
_STEERED = 0.05  # tangent of an angle
#: Of an angle: a change between parts of the mission, and the range of all windows. Tyres that give way had up to 0.13 and 0.21 on six healthy
#: machines (tuning), sensors that come to read 0.6 or 1.4 from 0.17 and 0.27 on.
_CHANGED, _RANGE = 0.12, 0.25
#: Of what a sensor that makes a rate change would make of that share. Sensors that came to read 1.4 on three machines (tuning) left 0.31 of it and more,
#: the two healthy axles whose rates changed 0.1 and 0.2.
_OF_RATES = 0.3


def turned_as_read(cells: Cells, steered: NDArray[np.bool_]) -> list[float | None]:
    """Of every axle, by how much the share of its angle that the turn beyond that by all angles is changes in the mission [1].

    None where it is not one share from the start to the end: without a gyro, of what is no end of the machine, and where windows that tell
    are few or lie in one part of those in which it is `steered`, of shape (windows, axles).
    """
    ends = turn_of_ends(cells)
    if ends is None:
        return [None] * len(cells.machine.axles)
    beyond, angles = ends
    frame = Frame(cells.size, max(1, round(_WINDOW_S / cells.dt)), cells.frame.hop)
    return [
        _change(frame, cells.dt, beyond, angles[name], steered[:, j]) if name in angles else None
        for j, name in enumerate(cells.machine.axles)
    ]


def read_as_before(turned: float | None, rates: Sequence[float | None]) -> bool:
    """Whether a gyro shows that a sensor reads as it did, so that what changes in its axle's rates is not its doing.

    Parameters
    ----------
    turned : float or None
        As of `turned_as_read`.
    rates : Sequence[float or None]
        By how much the axle's rate per opening changes in the mission, by several measures [ln].
    """
    if turned is None:
        return False
    return turned <= _OF_RATES * -float(np.expm1(-max((abs(r) for r in rates if r is not None), default=0.0)))


def _change(frame: Frame, dt: float, beyond: Array, tangent: Array, steered: NDArray[np.bool_]) -> float | None:
    """By how much the share of a tangent that a turn is changes, `steered` of shape (windows,); both of shape (cells,)."""
    use: NDArray[np.bool_] = np.isfinite(beyond) & (np.abs(np.nan_to_num(tangent)) > _STEERED)
    turned = frame.sums(np.where(use, beyond * np.sign(tangent), 0.0))
    read = frame.sums(np.where(use, np.abs(tangent), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(frame.sums(use.astype(np.float64)) * dt >= _LEAST_S, turned / read, np.nan)
    at, needed = np.flatnonzero(np.isfinite(share)), np.flatnonzero(steered)
    if at.size < _LEAST_WINDOWS or needed.size == 0 or at[-1] - at[0] < _SPAN * (needed[-1] - needed[0]):
        return None
    known = share[at]
    every = [np.ones(share.size, np.bool_)]
    change = float(max(largest_change(share, every), growth(share, every)))
    return change if change <= _CHANGED and np.ptp(known) <= _RANGE else None
