"""Speed per opening of each wheel against the other wheels over a whole mission, for trends across missions.

A valve that wears gives its wheel less speed for the same opening, mission after mission, long before that is a fault. What
changes for all wheels alike (oil that warms, a slope, a load) cancels against the median of the wheels; what direction and
turning do to a wheel is taken out by regression. How unlike valves are made stays in it: the figure says nothing by itself,
its change over the machine's missions does. A speed sensor that loses gain looks the same; under tyre grip the other wheels
drag a weak one along and hide a part of its loss, about a tenth where tyres are stiff.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.lag import low_passed
from diagnosis.results.loss import Loss
from diagnosis.results.result import Epsilon

Array = NDArray[np.float64]

_STEP_S, _WINDOW_S = 0.02, 1.0
_LEAST_WINDOWS, _LEAST_WHEELS = 12, 3
_OPEN = 0.95  # opening beyond which a valve is at its end
_LEAST_OPENING = 0.01
_RIDGE = (0.01, 0.3)  # of levels, and of the turning terms
_ROUNDS, _TUNE = 8, 2.0
_UNEXPLAINED = 0.01  # least standard deviation from mission to mission, as a share of the gain


def relative_losses(
    y: Array, u: Array, ratio: Array, usable: NDArray[np.bool_], tau: float, least: float, dt: float
) -> list[Loss | None]:
    """Loss of each wheel's speed per opening against the median of all wheels.

    Parameters
    ----------
    y, u : Array, shape (n, wheels)
        Measured speed [m/s] and opening [fraction].
    ratio : Array, shape (n, wheels)
        Wheel speed per speed of the body [1]; NaN where the geometry is not known.
    usable : NDArray[np.bool_], shape (n,)
        Samples in which no wheel has a fault.
    tau : float
        Lag of the wheels [s].
    least : float
        Speed from which wheels drive [m/s].
    dt : float
        Step [s].

    Returns
    -------
    list[Loss or None]
        Per wheel, `relative`; None for fewer than three wheels, or fewer than twelve steady seconds.
    """
    wheels = y.shape[1]
    if wheels < _LEAST_WHEELS:
        return [None] * wheels
    width = max(1, round(_STEP_S / dt))
    y, u, ratio, use = (_means(x, width) for x in (y, u, ratio, usable[:, None].astype(np.float64)))
    fed = np.column_stack([low_passed(x, tau, dt * width) for x in u.T])
    good = (use[:, 0] == 1.0) & np.isfinite(y).all(axis=1) & (np.abs(np.nan_to_num(u, nan=1.0)) < _OPEN).all(axis=1)
    good &= (np.abs(y) > least).all(axis=1) & (np.abs(np.sign(y).sum(axis=1)) == wheels)
    length = max(1, round(_WINDOW_S / (dt * width)))
    kept = _means(good[:, None].astype(np.float64), length)[:, 0] > 0.95
    y, fed, ratio = (_means(x, length)[kept] for x in (y, fed, ratio))
    sound = (np.sign(y) * fed > _LEAST_OPENING).all(axis=1)
    y, fed, ratio = y[sound], fed[sound], ratio[sound]
    if len(y) < _LEAST_WINDOWS:
        return [None] * wheels
    gain = np.log(y / fed)
    gain -= np.median(gain, axis=1, keepdims=True)
    forward = y[:, 0] > 0
    turning = np.nan_to_num(ratio - np.sign(ratio))
    return [_loss(gain[:, i], forward, turning[:, i], length * width * dt) for i in range(wheels)]


def _loss(gain: Array, forward: NDArray[np.bool_], turning: Array, window_s: float) -> Loss:
    """Level of a wheel's log gain straight ahead, the mean of both directions, by a robust ridge regression."""
    ways = [way for way in (forward, ~forward) if way.any()]
    x = np.column_stack([*ways, *(turning * way for way in ways)]).astype(np.float64)
    ridge = np.diag(np.repeat(_RIDGE, len(ways)))
    mean = np.repeat([1.0 / len(ways), 0.0], len(ways))
    weight = np.ones(gain.size)
    for _ in range(_ROUNDS):
        inverse = np.linalg.inv(x.T @ (x * weight[:, None]) + ridge)
        rest = gain - x @ (inverse @ (x.T @ (gain * weight)))
        scale = 1.4826 * float(np.median(np.abs(rest))) + 1e-4
        weight = 1.0 / (1.0 + (rest / (_TUNE * scale)) ** 2)
    level = float(mean @ (inverse @ (x.T @ (gain * weight))))
    std = float(np.hypot(scale * np.sqrt(mean @ inverse @ mean), _UNEXPLAINED))
    low, value, high = (1.0 - float(np.exp(level + k * std)) for k in (1.96, 0.0, -1.96))
    return Loss(Epsilon(value, low, high), gain.size * window_s, relative=True)


def _means(x: Array, length: int) -> Array:
    """Means over blocks of so many rows; NaN where one is."""
    count = x.shape[0] // length
    return np.asarray(np.mean(np.reshape(x[: count * length], (count, length, *x.shape[1:])), axis=1), np.float64)
