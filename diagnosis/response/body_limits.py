"""Machines that limit their own speed or yaw rate: beyond it no wheel does what its command makes of it, and no drive is at fault.

Controllers of differential drives clip speed and yaw rate of the body before they make speeds of wheels of them, so that one side may be far
off its command and the other one near it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.inputs import CELL_S, cells
from diagnosis.response.machine import Judged

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_BODY = 2  # commands: speed and yaw rate
_TOP, _AT, _BEYOND = (
    0.98,
    0.93,
    1.05,
)  # quantile that is the limit; shares of it at which the body is, and beyond which it is asked
_SMALL = 0.15, 0.6  # of the largest command: there nothing is limited
_LATELY_S, _LEAST_S = 1.0, 3.0
_LEAST_BLOCKS = 20


def at_body_limit(judged: Mapping[str, Judged], block_s: float) -> Flags | None:
    """Blocks in which the body goes, or turns, as fast as it ever does and is asked for more, shape (b,); None where that is not known.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    block_s : float
        Length of a block [s].
    """
    wheels = list(judged.values())
    if len(wheels) < _BODY or any(not j.response.answered or j.response.weights.size != _BODY for j in wheels):
        return None
    size = wheels[0].wheel.blocks.mean.size
    means = np.array([j.wheel.blocks.mean for j in wheels])
    sides = np.sign([j.response.weights[1] for j in wheels])
    if wheels[0].data.commands.shape[1] != _BODY or not (sides > 0.0).any() or not (sides < 0.0).any():
        return None
    per = max(1, round(block_s / CELL_S))
    told = [cells(wheels[0].data.commands[:, k], per)[:size] for k in range(_BODY)]
    if any(x.size != size for x in told):
        return None
    left, right = means[sides < 0.0].mean(axis=0), means[sides > 0.0].mean(axis=0)
    out = np.zeros(size, np.bool_)
    for done, asked in zip((0.5 * (left + right), right - left), told, strict=True):
        out |= _limited(np.nan_to_num(done), np.nan_to_num(asked), block_s)
    return out


def _limited(done: Array, asked: Array, block_s: float) -> Flags:
    """Blocks in which what the body does is at its limit, and asked to be beyond; both of shape (b,)."""
    none = np.zeros(done.size, np.bool_)
    low, high = (share * float(np.max(np.abs(asked), initial=0.0)) for share in _SMALL)
    small = (np.abs(asked) > low) & (np.abs(asked) < high)
    if np.count_nonzero(small) < _LEAST_BLOCKS:
        return none
    gain, top = float(np.median(done[small] / asked[small])), float(np.quantile(np.abs(done), _TOP))
    back = range(round(_LATELY_S / block_s) + 1)
    made = np.max([np.r_[np.zeros(k), (gain * asked * np.sign(done))[: done.size - k]] for k in back], axis=0)
    found = (np.abs(done) > _AT * top) & (made > _BEYOND * top)
    return found if np.count_nonzero(found) * block_s >= _LEAST_S else none
