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
_DEAD_S, _DEAD, _SUDDEN = 0.8, 5, 3.0  # around a beginning; readings; times what its readings change by (99 of 100)
_RAMP_S, _SHARE = (
    0.6,
    0.6,
)  # around a jump, and of the change in that time that it makes: less is a step of a ramp, read now and then
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


def jumps_of(samples: Samples, blocks: Blocks, width: int, dt: float) -> tuple[Jumps, NDArray[np.bool_]]:
    """Jumps in calm moments, and which blocks are calm, shape (b,). `width` are the steps of a block, `dt` is a step [s]."""
    top = float(np.nanquantile(np.abs(samples.value), 0.99)) if samples.value.size else 0.0
    calm = (blocks.high - blocks.low) < _CALM * top
    there = calm[np.minimum(samples.step // width, calm.size - 1)]
    size = np.abs(np.nan_to_num(samples.change))
    usual = float(np.quantile(size[there], 0.99)) if there.any() else top
    place = np.flatnonzero(there & (size > max(_STRONG * usual, _LEAST * top)))
    place = place[_alone(samples, place, dt)]
    before = samples.value[place] - samples.change[place]
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return Jumps(place, np.where(before != 0.0, samples.value[place] / before, np.inf)), calm


def _alone(samples: Samples, place: NDArray[np.intp], dt: float) -> NDArray[np.bool_]:
    """Which jumps, shape (k,), are most of how the readings change around them, rather than one step of a ramp."""
    out = np.ones(place.size, np.bool_)
    for i, k in enumerate(place.tolist()):
        first, last = np.searchsorted(samples.step, samples.step[k] + np.array([-1, 1]) * round(_RAMP_S / dt))
        before, after = (x[np.isfinite(x)] for x in (samples.value[first:k], samples.value[k : last + 1]))
        if before.size and after.size:
            whole = np.median(after[-3:]) - np.median(before[:3])
            out[i] = samples.change[k] * whole <= 0.0 or abs(samples.change[k]) >= _SHARE * abs(whole)
    return out


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


def falls_dead(samples: Samples, at: int, dt: float) -> bool:
    """Whether readings fall to 0 from one to the next, calm or not, and stay there to the last digit: no drive without power stops a wheel like that.

    Parameters
    ----------
    samples : Samples
        Of the channel.
    at : int
        Timeline step at which it begins to stand still, about.
    dt : float
        Step [s].
    """
    size = np.abs(np.nan_to_num(samples.change))
    turning = size[np.nan_to_num(samples.value) != 0.0]
    if not turning.size:
        return False
    sudden = size > _SUDDEN * float(np.quantile(turning, 0.99))
    near = np.flatnonzero(sudden & (samples.value == 0.0) & (np.abs(samples.step - at) * dt <= _DEAD_S))
    return any(bool((samples.value[k : k + _DEAD] == 0.0).all()) for k in near.tolist())
