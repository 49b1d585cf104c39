"""What a channel's deviation from its reference looks like: an offset, a scale, a delay, a drift, or spikes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.plain_numbers import plain
from diagnosis.results.sizes import amount

Array = NDArray[np.float64]

_EXPLAINED = 0.85  # of the mean square, by one shape alone
_LEAST = 20  # samples
_SPIKES = 0.12  # of the samples
_SHIFTED, _ADDED = 1.3, 0.05  # times what scale and offset leave together; of the reference's root mean square
_OUTLIER = 6.0  # times the usual deviation


def shape_sentence(y: Array, x: Array, dt: float, names: tuple[str, str], unit: str) -> str:
    """The one shape that explains how y is off x, in a sentence; empty where none does.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Channel and reference at the same times.
    dt : float
        Sample time [s].
    names : tuple[str, str]
        Of channel and reference.
    unit : str
        Of both.
    """
    if y.size < _LEAST:
        return ""
    off = y - x
    whole = float(np.mean(off**2))
    if whole <= 0.0:
        return ""
    channel, reference = names
    offset = float(np.mean(off))
    if offset**2 > _EXPLAINED * whole:
        more = "more" if offset > 0.0 else "less"
        return f"An offset: {channel} reads {amount(abs(offset), unit)} {more} than {reference}."
    if _without(off, x) < (1.0 - _EXPLAINED) * whole:
        (gain, add), *_ = np.linalg.lstsq(np.column_stack([x, np.ones(x.size)]), y, rcond=None)
        both = float(np.mean((y - gain * x - add) ** 2))
        if _without(off, x) > _SHIFTED * both and abs(add) > _ADDED * float(np.sqrt(np.mean(x**2))):
            sign = "more" if add > 0.0 else "less"
            return f"A scale and an offset: {channel} is {plain(gain)} × {reference}, and {amount(abs(float(add)), unit)} {sign}."
        return f"A scale: {channel} is {plain(1.0 + float(off @ x) / float(x @ x))} × {reference}, without an offset."
    change = np.asarray(np.gradient(x, dt), dtype=np.float64)
    if (
        _without(off, change) < (1.0 - _EXPLAINED) * whole
        and (late := -float(off @ change) / float(change @ change)) > 0
    ):
        return f"A delay: {channel} comes {late * 1e3:.0f} ms after {reference}."
    t: Array = (np.arange(y.size, dtype=np.float64) - 0.5 * y.size) * dt
    slope = float(off @ t) / float(t @ t)
    if _without(off - offset, t) < (1.0 - _EXPLAINED) * float(np.mean((off - offset) ** 2)):
        return f"A drift: {channel} departs from {reference} by {amount(slope, unit, 2)} a second."
    usual = 1.4826 * float(np.median(np.abs(off - np.median(off))))
    spikes = np.abs(off - np.median(off)) > max(_OUTLIER * usual, 1e-9)
    if 0 < np.count_nonzero(spikes) <= _SPIKES * y.size and np.sum(off[spikes] ** 2) > _EXPLAINED * np.sum(off**2):
        size = float(np.median(np.abs(off[spikes])))
        return f"Spikes: {np.count_nonzero(spikes)} of {y.size} samples are off by about {amount(size, unit, 2)}, the others are not."
    return ""


def _without(off: Array, shape: Array) -> float:
    """Mean square that a multiple of `shape` leaves of `off`."""
    power = float(shape @ shape)
    rest = off - (float(off @ shape) / power) * shape if power > 0.0 else off
    return float(np.mean(rest**2))
