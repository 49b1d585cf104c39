"""How much a wheel's speed can change from reading to reading at all: inertia forbids more, whatever other wheels do meanwhile.

What shakes several wheels alike is ground or load, but only up to the acceleration that a wheel can have, there and back within a reading. Beyond it
each of the channels reads wrong, and a fault of all of them excuses none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples
from diagnosis.response.models import Blocks

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ACCELERATION = 70.0  # m/s², there and back from one reading to the next: no wheel does that for long
_SHARE = 0.15  # of the speed: less than that is no noise which could hide anything
_CALM, _QUIETEST, _AT_SPEED = (
    3.0,
    0.1,
    0.25,
)  # so many times calmer, in such a share of the driving, at such a share of the speed: it can be calm
_LEAST_BLOCKS = 20
_COARSE = 0.3  # of the noise: where hardly any change is smaller, readings go by steps of an encoder


def largest_roughness(blocks: Blocks, samples: Samples, dt: float) -> Array:
    """What can change from sample to sample in a wheel's speed, by its inertia [m/s]; shape (b,).

    Parameters
    ----------
    blocks, samples
        Of the channel.
    dt : float
        Step [s].
    """
    pause = float(np.median(np.diff(samples.step))) * dt if samples.step.size > 1 else np.inf
    speed = np.abs(np.nan_to_num(blocks.mean))
    return np.maximum(_ACCELERATION * pause, _SHARE * np.maximum(speed, 0.5 * float(np.quantile(speed, 0.9))))


def calm_enough(blocks: Blocks, driving: Flags, most: Array) -> bool:
    """Whether a channel is calm in a part of its driving: it is no habit of such sensors to change by as much as inertia forbids.

    Parameters
    ----------
    blocks : Blocks
        Of the channel.
    driving : Flags, shape (b,)
        Where it drives.
    most : Array, shape (b,)
        What inertia allows [m/s].
    """
    speed = np.abs(np.nan_to_num(blocks.mean))
    use = driving & (blocks.readings > 2) & ~blocks.held & (blocks.rough > 0.0)
    use &= speed > _AT_SPEED * float(np.quantile(speed, 0.9))
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return False
    return bool(np.quantile((blocks.rough / most)[use], _QUIETEST) < 1.0 / _CALM)


def coarse(samples: Samples) -> bool:
    """Whether readings go by steps, so that what changes from one to the next is a habit of the encoder."""
    size = np.abs(samples.change[np.isfinite(samples.change) & (samples.change != 0.0)])
    if not size.size:
        return False
    return bool(np.quantile(size, 0.05) > _COARSE * np.sqrt(np.mean(samples.white**2)))


def allowed(blocks: Blocks, samples: Samples, driving: Flags, dt: float, others: Sequence[bool]) -> Array:
    """Most that may be usual in a channel [m/s], shape (b,); infinite where the noise of these sensors may be their habit.

    Parameters
    ----------
    blocks, samples
        Of the channel.
    driving : Flags, shape (b,)
        Where it drives.
    dt : float
        Step [s].
    others : Sequence[bool]
        Whether the other channels are calm enough.
    """
    most = largest_roughness(blocks, samples, dt)
    if coarse(samples) or not (calm_enough(blocks, driving, most) or any(others)):
        return np.full(most.size, np.inf)
    return most / _CALM
