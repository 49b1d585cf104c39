"""How the noise of a channel grows with what it measures and with how fast that changes, found from the mission itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of, quantile_of

Array = NDArray[np.float64]

_WINDOW_S, _LEAST = 0.25, 4
_CLASSES, _LEAST_WINDOWS = 6, 4
_SOUND = 0.4  # quantile of windows of one class that stands for healthy ones
_NOTICED = 1.2  # times the floor: growth below is none


class NoiseGrowth(NamedTuple):
    """Standard deviation of the noise: √(floor² + (share·size)²).

    Attributes
    ----------
    floor : float
        Noise of a channel that measures nothing [its unit].
    share : float
        What comes to it per size of what is measured [1].
    """

    floor: float
    share: float

    def variance(self, size: Array) -> Array:
        """Variance at some sizes [unit²]. Both of one shape (k,)."""
        return np.asarray(self.floor**2 + (self.share * size) ** 2)


def noise_growth(power: Array, size: Array, dt: float) -> NoiseGrowth | None:
    """Growth of the noise with a size, by classes of it; None where no class has enough windows.

    Of the windows of one class a low quantile of the mean power stands for healthy ones; floor² and share² are by the
    median slope of all pairs of classes (Theil and Sen), so that faults in half of the mission leave them alone.

    Parameters
    ----------
    power : Array, shape (n,)
        Squared noise of each new sample [unit²]; NaN where not known.
    size : Array, shape (n,)
        What the noise may grow with.
    dt : float
        Distance of samples [s].
    """
    length = max(_LEAST, round(_WINDOW_S / dt))
    count = power.size // length
    if count < _LEAST_WINDOWS:
        return None
    windows, sizes = (x[: count * length].reshape(count, length) for x in (power, size))
    known = np.isfinite(windows) & np.isfinite(sizes)
    number = known.sum(axis=1)
    mean = np.where(known, windows, 0.0).sum(axis=1) / np.maximum(number, 1)
    at = np.where(known, sizes**2, 0.0).sum(axis=1) / np.maximum(number, 1)
    use = (number >= length / 2) & (mean > 0.0)
    if np.count_nonzero(use) < _LEAST_WINDOWS:
        return None
    mean, at = mean[use], at[use]
    classes = np.array_split(np.argsort(at), min(_CLASSES, mean.size // _LEAST_WINDOWS))
    x = np.array([median_of(at[c]) for c in classes])
    y = np.array([quantile_of(mean[c], _SOUND) for c in classes])
    i, j = np.triu_indices(x.size, 1)
    apart = np.abs(x[i] - x[j]) > 0.1 * x.max(initial=0.0)
    slope = float(median_of((y[i] - y[j])[apart] / (x[i] - x[j])[apart])) if apart.any() else 0.0
    slope = max(slope, 0.0)
    floor = float(median_of(y - slope * x))
    least = float(y.min())
    if slope * x.max() < (_NOTICED**2 - 1.0) * max(floor, least):
        return NoiseGrowth(float(np.sqrt(quantile_of(mean, _SOUND))), 0.0)
    return NoiseGrowth(float(np.sqrt(max(floor, 0.25 * least))), float(np.sqrt(slope)))
