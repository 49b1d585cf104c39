"""What a steering valve gives at an opening: a monotone map with a dead band, a slope and a limit of each direction (compiled)."""

from __future__ import annotations

from math import erf, exp, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit

Array = NDArray[np.float64]

_ROOT_2 = sqrt(2.0)
_ROOT_2PI = sqrt(2.0 * pi)
# Standard deviations beyond which the normal distribution's tail is lost in rounding, and beyond which its density is 0 in a double:
# what is left out there changes no bit.
_SURE, _NEVER = 9.0, 39.0


class ValveMap(NamedTuple):
    """Rate of an axle by opening: slope·(|u| − dead), at least 0 and at most the limit, of either sign.

    Attributes
    ----------
    slope_up, slope_down : float
        Rate per opening beyond the dead band, of positive and of negative openings [rad/s].
    dead_up, dead_down : float
        Opening that gives no motion [fraction].
    limit_up, limit_down : float
        Largest rate [rad/s].
    """

    slope_up: float
    slope_down: float
    dead_up: float
    dead_down: float
    limit_up: float
    limit_down: float

    @property
    def gain(self) -> float:
        """Mean slope of both directions [rad/s per full opening]."""
        return (self.slope_up + self.slope_down) / 2

    @property
    def limit(self) -> float:
        """The larger of both limits [rad/s]."""
        return max(self.limit_up, self.limit_down)

    @property
    def dead(self) -> float:
        """Mean dead band [fraction]."""
        return (self.dead_up + self.dead_down) / 2


@njit(cache=True, error_model="numpy", forceinline=True)
def rate_at(u: float, valve: ValveMap) -> float:
    """Rate at an opening [rad/s]."""
    if u > valve.dead_up:
        return min(valve.slope_up * (u - valve.dead_up), valve.limit_up)
    if u < -valve.dead_down:
        return max(valve.slope_down * (u + valve.dead_down), -valve.limit_down)
    return 0.0


@njit(cache=True, error_model="numpy")
def rates_at(u: Array, valve: ValveMap) -> Array:
    """Rates at openings [rad/s], shape of u."""
    out = np.empty(u.size)
    for k in range(u.size):
        out[k] = rate_at(u[k], valve)
    return out


@njit(cache=True, error_model="numpy")
def _beyond(u: float, std: float, edge: float) -> tuple[float, float]:
    """Mean of max(x − edge, 0) and probability of x > edge, for x normal with mean u."""
    z = (u - edge) / std
    if z > _SURE:
        return u - edge, 1.0
    if z < -_NEVER:
        return 0.0, 0.0
    above = 0.5 * (1.0 + erf(z / _ROOT_2)) if z > -_SURE else 0.0
    return (u - edge) * above + std * exp(-0.5 * z * z) / _ROOT_2PI, above


@njit(cache=True, error_model="numpy")
def expected_rate(u: float, std: float, valve: ValveMap) -> tuple[float, float]:
    """Mean rate of an opening that is normal about u, and its slope by u: statistical linearisation [rad/s]."""
    if std < 1e-7:
        step = 1e-6
        return rate_at(u, valve), (rate_at(u + step, valve) - rate_at(u - step, valve)) / (2 * step)
    first, p1 = _beyond(u, std, valve.dead_up)
    last, p2 = _beyond(u, std, valve.dead_up + valve.limit_up / valve.slope_up)
    mean, slope = valve.slope_up * (first - last), valve.slope_up * (p1 - p2)
    first, p1 = _beyond(-u, std, valve.dead_down)
    last, p2 = _beyond(-u, std, valve.dead_down + valve.limit_down / valve.slope_down)
    return mean - valve.slope_down * (first - last), slope + valve.slope_down * (p1 - p2)


def opening_for(rate: float, valve: ValveMap) -> float:
    """Opening that gives a rate [fraction]: the smallest one at the limit, 0 at rest."""
    if rate > 0:
        return valve.dead_up + min(rate, valve.limit_up) / valve.slope_up
    if rate < 0:
        return -valve.dead_down - min(-rate, valve.limit_down) / valve.slope_down
    return 0.0
