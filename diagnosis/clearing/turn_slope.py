"""How a wheel's speed per opening depends on its share in a turn: outer wheels of a healthy machine differ from inner ones alike.

Valves overlap, oil flows to where it is asked for least, and inner wheels carry less: the speed per opening ν of a wheel beside the others' goes with a
power β of what the wheel is told beside the others, ln ν = c + β·ln(v_c / v_c of the others), with one β for all wheels of a machine. What is fitted
alike to all of them takes nothing of a fault of one; what commands say, no sensor's fault changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_known, median_of, quantile_of

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_WHEELS, _LEAST_WINDOWS = 3, 8  # with a slope; of a way, and in turns
_TURNS = 0.03  # [ln], from which on a wheel is told to go further than the others
#: Slopes of the wheels, all but one of which must agree. Healthy ones of twelve machines (tuning) had -0.1 to 0.71, and agreed within 0.06. Speeds
#: that are exchanged across the machine would have -1 and less.
_LEAST, _MOST, _AGREE, _AGREE_SHARE = -0.25, 0.85, 0.06, 0.2
_BETTER, _OFTEN = 0.9, 0.9  # what it must leave of the deviations, and of how many windows
_STEPS = 6


def turn_slope(log: Array, asked: Array, ahead: Flags) -> float:
    """The common power β [1], 0 where none is to be had: of few windows in turns, of few wheels, or where wheels disagree.

    Parameters
    ----------
    log : Array, shape (windows, wheels)
        ln of speed per opening over that of the other wheels; NaN where too little is known.
    asked : Array, shape (windows, wheels)
        ln of the commanded speed over that of the other wheels; NaN where it is not known.
    ahead : NDArray[np.bool_], shape (windows, wheels)
        Whether a wheel drives forward; both ways have an intercept of their own.
    """
    slopes = np.array([_slope(*of) for of in zip(log.T, asked.T, ahead.T, strict=True)])
    known = slopes[np.isfinite(slopes)]
    if known.size < _WHEELS:
        return 0.0
    middle = float(median_of(known))
    agree = np.count_nonzero(np.abs(known - middle) <= max(_AGREE, _AGREE_SHARE * abs(middle)))
    if not _LEAST <= middle <= _MOST or agree < max(known.size - 1, 2):
        return 0.0
    before, after = (_usually_off(log - b * np.nan_to_num(asked), asked, ahead) for b in (0.0, middle))
    return middle if after <= _BETTER * before else 0.0


def _slope(log: Array, asked: Array, ahead: Flags) -> float:
    """Slope of least absolute deviations of one wheel; NaN where it hardly turns. All of shape (windows,)."""
    known = np.isfinite(log) & np.isfinite(asked)
    ways = [k for way in (ahead, ~ahead) if np.count_nonzero(k := known & way) >= _LEAST_WINDOWS]
    if sum(np.count_nonzero(np.abs(asked[k]) > _TURNS) for k in ways) < _LEAST_WINDOWS:
        return np.nan
    slope = 0.0
    for _ in range(_STEPS):
        x, y = (np.concatenate(z) for z in zip(*(_centred(log[k], asked[k], slope) for k in ways), strict=True))
        turned = np.abs(x) > _TURNS
        slope = _weighted_median(y[turned] / x[turned], np.abs(x[turned]))
    return slope


def _centred(log: Array, asked: Array, slope: float) -> tuple[Array, Array]:
    """Both of a way, from where most windows of it lie by such a slope on: `asked` from straight on, `log` less its intercept."""
    return asked, log - float(median_of(log - slope * asked))


def _weighted_median(x: Array, weight: Array) -> float:
    order = np.argsort(x)
    total = np.cumsum(weight[order])
    return float(x[order][np.searchsorted(total, 0.5 * total[-1])])


def _usually_off(log: Array, asked: Array, ahead: Flags) -> float:
    """What most windows of most wheels are off their usual one at most [ln]; arguments as of `turn_slope`."""
    off = []
    for y, x, way in zip(log.T, asked.T, ahead.T, strict=True):
        known = np.isfinite(y) & np.isfinite(x)
        parts = [np.abs(y[k] - median_of(y[k])) for k in (known & way, known & ~way) if np.count_nonzero(k)]
        off.append(float(quantile_of(np.concatenate(parts), _OFTEN)) if parts else np.nan)
    return float(median_known(off))
