"""Whether a deviation came within one sample, as only a sensor's does: drives and ground take their time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples
from diagnosis.response.models import Blocks

Array = NDArray[np.float64]

_SEARCH_S = 2.5
_CALM = 0.15  # of the top speed: by as much may the expected speed change around a calm moment
_STRONG, _LEAST = 2.0, 0.08  # times what a calm sample changes by (99 of 100); of the top speed
_ALIKE = 1.35  # by which the ratio of a jump may differ from the deviation's


class Jumps(NamedTuple):
    """Sudden changes of a channel while nothing asked for them.

    Attributes
    ----------
    place : NDArray[np.intp], shape (k,)
        Sample behind each jump.
    ratio : Array, shape (k,)
        Reading after a jump by the one before.
    """

    place: NDArray[np.intp]
    ratio: Array


def jumps_of(samples: Samples, blocks: Blocks, width: int) -> tuple[Jumps, NDArray[np.bool_]]:
    """Jumps in calm moments, and which blocks are calm, shape (b,)."""
    top = float(np.nanquantile(np.abs(samples.value), 0.99)) if samples.value.size else 0.0
    calm = (blocks.high - blocks.low) < _CALM * top
    there = calm[np.minimum(samples.step // width, calm.size - 1)]
    size = np.abs(np.nan_to_num(samples.change))
    usual = float(np.quantile(size[there], 0.99)) if there.any() else top
    place = np.flatnonzero(there & (size > max(_STRONG * usual, _LEAST * top)))
    before = samples.value[place] - samples.change[place]
    with np.errstate(divide="ignore", invalid="ignore"):
        return Jumps(place, np.where(before != 0.0, samples.value[place] / before, np.inf)), calm


def onset_of(jumps: Jumps, samples: Samples, at: int, ratio: float, dt: float) -> int | None:
    """Sample behind the jump by about `ratio` that is nearest to a timeline step; None where there is none.

    Parameters
    ----------
    jumps, samples
        Of the channel.
    at : int
        Timeline step.
    ratio : float
        Of the readings after and before; 0: to standstill, infinite: from it.
    dt : float
        Step [s].
    """
    far = np.abs(samples.step[jumps.place] - at) * dt
    if ratio == 0.0:
        fits = np.abs(jumps.ratio) < 0.05
    elif np.isinf(ratio):
        fits = ~(np.abs(jumps.ratio) < 20.0)
    else:
        fits = (jumps.ratio > ratio / _ALIKE) & (jumps.ratio < ratio * _ALIKE)
    near = np.flatnonzero(fits & (far <= _SEARCH_S))
    return int(jumps.place[near[np.argmin(far[near])]]) if near.size else None
