"""Deviations that vary by more than a healthy channel's noise, and yet are those of a steady row but for hardly anything."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import INEFFICIENT, STUCK

Array = NDArray[np.float64]

_USUAL = 0.9  # of the samples: the timing of quick moves makes the others
_OF_DEVIATION = 0.15  # what a steady row may leave, root mean square


def calm_row(y: Array, x: Array, min_sat: float, zero: float = 0.0) -> int | None:
    """The steady row that leaves hardly anything of a deviation: a share of the reference, or one value; None where none does.

    Where dynamics are lost with the gain, what is left is more than a healthy channel's noise, and yet no saturation term that counts.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Channel and reference at the same times [unit of y].
    min_sat : float
        Smallest saturation term that counts [unit of y].
    zero : float
        As far apart may two healthy instruments have their zero [unit of y].
    """
    power = float(x @ x)
    if power == 0.0:
        return None
    most = _OF_DEVIATION * float(np.sqrt(np.mean((y - x) ** 2)))
    spread, middle = float(np.std(y)), float(np.mean(x))
    slope = float(np.mean((x - middle) * y)) / max(power / x.size - middle**2, 1e-300)
    y = y - np.clip(float(np.mean(y)) - slope * middle, -zero, zero)
    share = float(x @ y) / power
    off = (y - share * x) ** 2
    usual = int(_USUAL * off.size)
    left = float(np.sqrt(np.mean(np.partition(off, usual)[:usual]))) if usual else 0.0
    if spread <= min(most, left, min_sat, _OF_DEVIATION * float(np.std(x))):
        return STUCK
    return INEFFICIENT if left <= min(most, (1.0 - share) * min_sat) and share >= 0.0 else None


def is_one_value(y: Array, x: Array, min_sat: float) -> bool:
    """Whether a channel keeps to one value beside a reference that hardly moves, by so much elsewhere that what it varies by is nothing.

    `y` and `x` of shape (n,) [unit of y], `min_sat` as of `calm_row`.
    """
    if not y.size:
        return False
    level = float(np.median(y))
    varies = float(np.quantile(np.abs(y - level), _USUAL))
    return varies <= min(_OF_DEVIATION * abs(level - float(np.median(x))), min_sat)
