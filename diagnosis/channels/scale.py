"""The small error of scale by which a healthy channel differs from its reference, found beside faults of any share of the mission."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_known, quantile_known

Array = NDArray[np.float64]

_USUAL, _LARGE = 0.35, 3.0
#: Quantile of the smallest misfits, and times that: of noise it is a little more than the usual one.
_FEW, _OF_FEW = 0.1, 4.0
_MOSTLY, _REPEATS = 0.5, 10  # of the places; of an estimate of the scale
_LARGEST_SCALE = 0.02  # what differs by more is a loss of effectiveness


def scale_of(x: Array, y: Array) -> float:
    """Scale by least squares over places that a healthy channel explains; 1 where it is no mere error of scale.

    A fault may last for most of a mission: then large values count alone, for a loss of small ones is as small as noise.

    Parameters
    ----------
    x, y : Array, shape (k,)
        What is expected of a channel with the scale 1, and the channel, at some places in order of time [unit].
    """
    large = np.abs(x) >= median_known(np.abs(x))
    white = _white(y - x)
    gain, near = _explained(x[large], y[large], lambda misfit: _usual_of_few(misfit, white))
    if np.mean(np.abs(y - gain * x) <= near) >= _MOSTLY:
        gain, _ = _explained(x, y, lambda misfit: float(quantile_known(misfit, _USUAL)))
    return gain if abs(gain - 1.0) < 0.99 * _LARGEST_SCALE else 1.0


def _explained(x: Array, y: Array, usual: Callable[[Array], float]) -> tuple[float, float]:
    """Scale of y against x, of the places that it explains, and by how much these may be off it."""
    gain, near = 1.0, 0.0
    for _ in range(_REPEATS):
        misfit = np.abs(y - gain * x)
        near = _LARGE * usual(misfit)
        good = misfit <= near
        power = float(x[good] @ x[good])
        if power <= 0.0:
            return 1.0, near
        gain = float(np.clip((x[good] @ y[good]) / power, 1.0 - _LARGEST_SCALE, 1.0 + _LARGEST_SCALE))
    return gain, near


def _usual_of_few(misfit: Array, white: float) -> float:
    """Usual size of a misfit (n,) by its smallest ones: a fault of most places leaves those alone.

    Of these, what differs from place to place by itself is enough, `white` [unit of the misfit].
    """
    few = misfit[misfit > 0.0]
    usual = float(quantile_known(misfit, _USUAL))
    if not few.size:
        return usual
    least = float(quantile_known(few, _FEW))
    return min(usual, _OF_FEW * least, max(least, white))


def _white(misfit: Array) -> float:
    """Usual size, as a median, of what a misfit (n,) has from place to place: a fault that lasts moves two neighbours alike."""
    return float(median_known(np.abs(np.diff(misfit)))) / math.sqrt(2.0) if misfit.size > 1 else 0.0
