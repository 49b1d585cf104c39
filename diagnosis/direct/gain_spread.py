"""By how much the gain of a healthy channel varies from second to second beside its second measurement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.estimation.samples import Samples
from replay.arrays.numeric import without_nan
from replay.arrays.quantiles import median_of, quantile_of

Array = NDArray[np.float64]

_GAIN_S, _GAIN_DRIVEN, _GAIN_WINDOWS = 1.0, 0.1, 6  # windows; of the span, from which on they move; the fewest of them
_MOST_SPREAD = 0.1  # of a gain: as much may a healthy one vary; more of it is a fault in other windows
LEAST_SPREAD = 0.005  # of a gain: two instruments agree no better, however steady they are
_OF_FEW = 1.6  # times as wide are 95 % bounds by four channels (Student's t) as by many
_NORMAL_MEDIAN = 0.6745  # of the size of a normal variable of unit variance


class GainSpread(NamedTuple):
    """By how much y per reference of a healthy channel varies from second to second: that lasts, and does not average out.

    Attributes
    ----------
    share : float
        Standard deviation of the gain [1].
    size : float
        Root mean square of the reference where that was seen [unit of y].
    """

    share: float
    size: float


class GainWindows(NamedTuple):
    """Sums over windows of a second.

    Attributes
    ----------
    power, moved : Array, shape (windows,)
        Σx² and Σxy [unit²].
    width : int
        Samples in a window.
    """

    power: Array
    moved: Array
    width: int

    def spread(self, span: float, start: int = 0, stop: int = 0) -> GainSpread | None:
        """Robust standard deviation of the gain Σxy/Σx² about 1; None where few windows move.

        Parameters
        ----------
        span : float
            Of the channel [unit of y].
        start, stop : int
            Samples of a fault: one that lasts for most of the driving would else be taken for the usual spread.
        """
        driven = self.power > self.width * (_GAIN_DRIVEN * span) ** 2
        driven[start // self.width : -(-stop // self.width)] = False
        if np.count_nonzero(driven) < _GAIN_WINDOWS:
            return None
        usual = float(median_of(np.abs(self.moved[driven] / self.power[driven] - 1.0)) / _NORMAL_MEDIAN)
        size = float(np.sqrt(median_of(self.power[driven]) / self.width))
        return GainSpread(min(max(usual, LEAST_SPREAD), _MOST_SPREAD), size)


def usual_spread(own: Sequence[GainSpread | None]) -> GainSpread:
    """Spread of a healthy one of several channels of one kind, by that of each: the lower middle one, wider since they are few."""
    known = [s for s in own if s is not None]
    if not known:
        return GainSpread(LEAST_SPREAD, 0.0)
    share, size = (float(x) for x in quantile_of(np.array(known), 0.5, axis=0, method="lower"))
    return GainSpread(min(_OF_FEW * share, _MOST_SPREAD), size)


def gain_windows(samples: Samples, dt: float) -> GainWindows:
    """Windows of a channel and its reference, of samples of `dt` s."""
    width = max(2, round(_GAIN_S / dt))
    size = samples.y.size // width * width
    use = (samples.status[:size] == PAIR) & ~samples.quiet[:size]
    x, y = (np.where(use, without_nan(z[:size]), 0.0).reshape(-1, width) for z in (samples.x, samples.y))
    return GainWindows(np.einsum("ij,ij->i", x, x), np.einsum("ij,ij->i", x, y), width)
