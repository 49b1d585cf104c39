"""Rounding step and white noise of a channel, found from its own samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.arrays.quantiles import median_of, quantile_of

Array = NDArray[np.float64]

_WINDOW_S = 0.25
# values that tell where a low quantile lies, and times its share, up to which values are ranked
_SOME, _WIDER = 4_000, 2.0


def rounding_step(values: Array) -> float:
    """Rounding step (LSB) of a channel; 0 where the values lie on no grid.

    In the unit of the values.

    Parameters
    ----------
    values : Array, shape (n,)
        New samples only; NaN are left out.
    """
    known = _first_known(values, 200_000)
    steps = np.diff(known)
    np.abs(steps, out=steps)
    largest = max(-float(np.min(known, initial=0.0)), float(np.max(known, initial=0.0)))
    steps = steps[steps > 1e-12 * max(1.0, largest)]
    if steps.size < 20:
        return 0.0
    smallest = _low_quantile(steps, 0.01)
    step = float(median_of(steps[steps < 1.5 * smallest]))
    multiple = steps / step
    whole = np.rint(multiple)
    multiple *= whole
    whole *= whole
    step *= float(np.sum(multiple) / max(float(np.sum(whole)), 1e-300))
    small = steps[steps < 50 * step] / step
    if small.size < 20:
        return 0.0
    off = np.rint(small)
    off -= small
    np.abs(off, out=off)
    return step if np.count_nonzero(off < 0.1) / small.size > 0.97 else 0.0


def _low_quantile(values: Array, share: float) -> float:
    """`np.quantile` of many finite values, without its search for the largest one; some of them tell below what the few lie that are ranked."""
    place = share * (values.size - 1)
    k = int(place)
    some = values[:: max(1, values.size // _SOME)]
    near = min(int(_WIDER * share * some.size) + 1, some.size - 1)
    few = values[values <= np.partition(some, near)[near]]
    ranked = np.partition(few if few.size > k + 1 else values, k)
    a, b, t = float(ranked[k]), float(ranked[k + 1 :].min()), place - k
    return a + (b - a) * t if t < 0.5 else b - (b - a) * (1.0 - t)


def _first_known(values: Array, count: int) -> Array:
    """The first `count` values that are known, or all."""
    if np.isfinite(values[:count]).all():
        return values[:count]
    found: list[Array] = []
    for part in blocks(values.size):
        near = values[part]
        found.append(near[np.isfinite(near)])
        count -= found[-1].size
        if count <= 0:
            break
    known = np.concatenate(found) if found else values
    return known[: known.size + min(count, 0)]


def windows(values: Array, length: int) -> Array:
    """Consecutive windows of `length` samples, shape (n // length, length); the rest is left out."""
    count = values.size // length
    return values[: count * length].reshape(count, length)


def white_noise(values: Array, dt: float, quantile: float = 0.4) -> float:
    """Standard deviation of the white part of a sampled signal, from its second differences.

    Parameters
    ----------
    values : Array, shape (n,)
        Consecutive samples; windows with NaN or without change are left out.
    dt : float
        Distance of samples [s].
    quantile : float
        Which window stands for the signal.

    Returns
    -------
    float
        The quantile over windows of 0.25 s (at least 12 samples); NaN where no window is usable.
    """
    length = max(12, round(_WINDOW_S / dt))
    found = []
    for part in blocks(values.size - 2, length):
        near = values[part.start : part.stop + 2]
        second = windows(near[2:] - 2 * near[1:-1] + near[:-2], length)
        if second.size:
            moving = np.mean(np.abs(second) > 0, axis=1) > 0.3
            found.append(np.where(moving, np.sqrt(np.mean(second**2, axis=1) / 6.0), np.nan))
    if not found:
        return float("nan")
    rms = np.concatenate(found)
    rms = rms[np.isfinite(rms)]
    return float(quantile_of(rms, quantile)) if rms.size >= 3 else float("nan")
