"""Whether readings that stay at one value are those of a sensor that lives: they tremble as ever, and nobody asked for another speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import white_part
from replay.arrays.quantiles import median_of, quantile_of

Array = NDArray[np.float64]

_TREMBLES = 0.3  # of the usual noise
_ENDS = (0.05, 0.95)  # quantiles between which a command stays
_LEAST, _SHARE = 0.063, 0.2  # of the span and of the command: further away, or moving by more, a sensor would show it
_FEW = 10


def lives(y: Array, reference: Array, noise: float, span: float) -> bool:
    """Whether a run of readings is what a healthy sensor gives at a steady command, or at rest where none is given; False where no command is known.

    Parameters
    ----------
    y, reference : Array, shape (m,)
        Readings and commanded speed of the run [m/s]; NaN where unknown.
    noise : float
        White noise of the sensor elsewhere [m/s].
    span : float
        Largest plausible speed [m/s].
    """
    known = np.isfinite(y)
    asked = reference[np.isfinite(reference)]
    values = y[known]
    if values.size < _FEW or asked.size < known.size / 2:
        return False
    level = float(median_of(values))
    low, high = quantile_of(asked, _ENDS)
    near = max(_LEAST * span, _SHARE * float(np.max(np.abs([low, high]))))
    if max(high - low, abs(high - level), abs(low - level)) > near:
        return False
    if max(abs(low), abs(high)) <= _LEAST * span:
        return True  # nobody asked for motion
    return float(np.sqrt(np.mean(white_part(values) ** 2))) > _TREMBLES * noise
