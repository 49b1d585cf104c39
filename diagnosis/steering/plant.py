"""The plant of a steering axle, and how well it says what the axle does at an opening."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.plant_fit import LAG, packed, unpacked
from diagnosis.steering.valve_map import ValveMap, rates_at

Array = NDArray[np.float64]

LEAST_WINDOWS = 8  # of steering
OPEN_LIMIT, OPEN_LIMIT_STD = 1.5, 0.3  # a limit that was not seen: times the largest rate, and its relative std
_LEAST_MISFIT = 0.02
_BEYOND = 0.5  # of what a rate grows beyond the openings that were seen: its standard deviation


@dataclass(frozen=True)
class SteeringPlant:
    """Valve and cylinder of an axle: ṙ = (f(u) − r)/lag, φ̇ = r, and the sensor follows φ with a play.

    Attributes
    ----------
    valve : ValveMap
        f, the rate by opening.
    lag : float
        Lag [s].
    play : float
        Half of the sensor's play [rad].
    cov : Array, shape (8, 8)
        Covariance of the constants, in the order of `diagnosis.steering.plant_fit`.
    misfit : float
        Share of a rate that the model does not explain, in the windows that it explains better.
    windows : int
        Windows of steering behind it.
    seen : tuple[float, float]
        Smallest and largest opening at which the axle was seen to obey it [fraction].
    """

    valve: ValveMap
    lag: float
    play: float
    cov: Array
    misfit: float
    windows: int
    seen: tuple[float, float]

    @property
    def gain(self) -> float:
        """Rate per opening beyond the dead band, mean of both directions [rad/s per full opening]."""
        return self.valve.gain

    @property
    def rate(self) -> float:
        """Largest rate [rad/s]."""
        return self.valve.limit

    @property
    def lag_std(self) -> float:
        """Standard deviation of the lag's logarithm, at most 1. Of ln(lag), so without a unit [1]."""
        return float(min(np.sqrt(self.cov[LAG, LAG]), 1.0))

    @property
    def reliable(self) -> bool:
        """Whether valves can be judged by it."""
        return self.windows >= LEAST_WINDOWS and self.misfit < 0.25

    def spread(self, u: Array) -> Array:
        """Standard deviation of the rate that is expected at openings [rad/s], shape of u."""
        grid = np.unique(np.concatenate([np.linspace(u.min(), u.max(), 201), [0.0]])) if u.size else np.zeros(1)
        x = packed(self.valve, self.lag, self.play)
        rates = rates_at(grid, self.valve)
        variance = (max(self.misfit, _LEAST_MISFIT) * rates) ** 2
        jacobian = np.empty((grid.size, 6))
        for i in range(6):
            h = np.sqrt(self.cov[i, i])
            up, down = x.copy(), x.copy()
            up[i] += h
            down[i] -= h
            jacobian[:, i] = (rates_at(grid, unpacked(up)[0]) - rates_at(grid, unpacked(down)[0])) / (2 * h)
        variance += np.einsum("ki,ij,kj->k", jacobian, self.cov[:6, :6], jacobian)
        edges = rates_at(np.clip(grid, *self.seen), self.valve)
        variance += (_BEYOND * (rates - edges)) ** 2
        return np.asarray(np.interp(u, grid, np.sqrt(variance)))
