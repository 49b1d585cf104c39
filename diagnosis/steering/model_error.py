"""By how much a machine's axles move otherwise than their model says: as much as its own motions show, and no more than they show of every axle.

Spools of second order, droop of an engine, tyres that scrub: of the sizes of a model's error that are tried, the one under which a healthy
axle explains its motions best holds. That is the median motion's, which a fault of less than half of them does not touch, and what every
axle gains by, which a fault of one of them does not give.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.steering import path_kernel
from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.model_bank import HEALTHY_MODEL, STATES
from diagnosis.steering.path import AxleFilter
from replay.arrays.quantiles import median_of

_MOTION_S, _BEFORE_S = 1.0, 0.5  # of a motion, and from where the filter starts before it
_MOVED = 0.02  # rad
_FEW, _MANY = 8, 40  # motions: without so many nothing is said, more are not asked
_LAGS = (0.3, 0.6, 1.0)
_SHARES = (0.04, 0.08, 0.15)
_GAIN = 1.0  # log-likelihood of a motion: less is none


class ModelError(NamedTuple):
    """What a model's rates err by, beside what its constants are not known by.

    Attributes
    ----------
    lag : float
        Standard deviation of the lag from motion to motion, relative to it [1].
    share : float
        Standard deviation of a rate, relative to it [1].
    """

    lag: float = 0.1
    share: float = 0.0


def model_error(axles: Sequence[Callable[[ModelError], AxleFilter]]) -> ModelError:
    """What a machine's motions show; each axle is given as its filter under an error."""
    known = [(axle, motions) for axle in axles if len(motions := _motions(axle(ModelError()))) >= _FEW]
    if not known:
        return ModelError()

    def gain(error: ModelError, before: Sequence[NDArray[np.float64]]) -> tuple[float, list[NDArray[np.float64]]]:
        now = [_evidence(axle(error), motions) for axle, motions in known]
        return min(float(median_of(n - b)) for n, b in zip(now, before, strict=True)), now

    best = ModelError()
    _, found = gain(best, [np.zeros(len(motions)) for _, motions in known])
    for field, values in (("lag", _LAGS), ("share", _SHARES)):
        for value in values:
            tried = best._replace(**{field: value})
            more, now = gain(tried, found)
            if more < _GAIN:
                break
            best, found = tried, now
    return best


def _motions(axle: AxleFilter) -> list[slice]:
    """Blocks of motions and of a moment before each, evenly over the mission."""
    blocks = axle.blocks
    length, before = max(2, round(_MOTION_S / blocks.dt)), round(_BEFORE_S / blocks.dt)
    seen = np.flatnonzero(blocks.status == PAIR)
    out = []
    for stop in range(length + before, blocks.mean.size + 1, length):
        a, b = np.searchsorted(seen, [stop - length - before, stop])
        if b - a > 2 and np.ptp(blocks.mean[seen[a:b]]) > _MOVED:
            out.append(slice(int(seen[a]), stop))
    return out[:: -(-len(out) // _MANY)] if out else out


def _evidence(axle: AxleFilter, motions: Sequence[slice]) -> NDArray[np.float64]:
    """Log-evidence of a healthy axle in each motion, shape (motions,)."""
    series, constants = axle.series, axle.constants
    none = SteeringPath(
        np.full(1, HEALTHY_MODEL, np.uint8),
        np.zeros((1, STATES)),
        np.zeros((1, STATES, STATES)),
        np.ones((1, 2)),
        np.zeros((1, 2)),
    )
    out = []
    for motion in motions:
        near = series.part(motion)
        size = near.mean.size
        healthy, first = np.full(size, HEALTHY_MODEL, np.uint8), float(near.mean[0])
        total, _ = path_kernel.path_evidence(near, healthy, 0, size, none, first, constants, False)
        out.append(total)
    return np.array(out)
