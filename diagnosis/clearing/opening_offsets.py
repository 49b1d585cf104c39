"""Opening that a wheel needs for its speed, beside the other wheels': a valve that is off by a constant asks for as much more or less of it.

Per opening such a valve is too quick one way and too slow the other, and both the less the faster it drives; as a difference of openings
it is the same everywhere.
"""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import lowest_passed
from diagnosis.clearing.responses import LAG_S, SETTLED, SETTLED_S, USUAL_TOP

_MOVING = 0.06  # of the top speed
_LEAST_CELLS, _LEAST_SHARE = 40, 0.5  # of the other wheels, one way; of a window
_ROUNDS, _NEAR = 5, 0.01  # of the fit to what most readings agree on; of full opening


def opening_offsets(cells: Cells, speed: Array, opening: Array) -> tuple[Array, Array]:
    """Opening of each wheel less what the other wheels have at its speed [1]: from the usual one, and the usual one.

    Parameters
    ----------
    cells : Cells
        The mission.
    speed, opening : Array, shape (cells, wheels)
        Speeds [m/s] and openings [1]; NaN where unknown or not to be looked at.

    Returns
    -------
    tuple[Array, Array], shapes (windows, wheels) and (wheels,)
        NaN where there is nothing to compare.
    """
    top, back = cells.machine.max_speed, max(1, round(SETTLED_S / cells.dt))
    u = np.where(np.isfinite(opening), lowest_passed(opening, cells.dt, LAG_S), np.nan)
    motion = np.where(np.isfinite(cells.reference), cells.reference, speed)
    before = np.concatenate([np.full((min(back, len(motion)), motion.shape[1]), np.nan), motion[:-back]])
    with np.errstate(invalid="ignore"):
        settled = (np.abs(motion - before) < SETTLED * top / USUAL_TOP) & (np.abs(speed) > _MOVING * top)
    settled &= np.isfinite(u)
    off = np.full(speed.shape, np.nan)
    for i in range(speed.shape[1]):
        for sign in (1.0, -1.0):
            way = settled & (sign * np.nan_to_num(speed) > 0.0)
            others = np.delete(way, i, axis=1)
            if others.sum() < _LEAST_CELLS:
                continue
            gain, add = _fitted(np.delete(speed, i, axis=1)[others], np.delete(u, i, axis=1)[others])
            off[way[:, i], i] = (u[:, i] - gain * speed[:, i] - add)[way[:, i]]
    known = np.isfinite(off)
    usual = np.array([np.median(x[k]) if k.any() else np.nan for x, k in zip(off.T, known.T, strict=True)])
    frame = cells.frame
    count = frame.sums(known.astype(np.float64))
    enough = count >= _LEAST_SHARE * min(frame.length, frame.cells)
    mean = frame.sums(np.where(known, off, 0.0)) / np.maximum(count, 1.0)
    return np.where(enough, np.abs(mean - usual), np.nan), np.abs(usual)


def _fitted(v: Array, u: Array) -> tuple[float, float]:
    """Opening as a gain times the speed plus a constant, of what most readings agree on; both of shape (n,)."""
    weight, gain, add = np.ones(v.size), 0.0, 0.0
    for _ in range(_ROUNDS + 1):
        total = float(weight.sum())
        mean_v, mean_u = float(weight @ v) / total, float(weight @ u) / total
        power = float(weight @ (v - mean_v) ** 2)
        gain = float(weight @ ((v - mean_v) * (u - mean_u))) / power if power > 0.0 else 0.0
        add = mean_u - gain * mean_v
        weight = 1.0 / np.maximum(np.abs(u - gain * v - add), _NEAR)
    return gain, add
