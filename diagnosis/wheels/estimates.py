"""ε̂ and the saturation term of a run, from the state of its model at the end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.result import Epsilon, Sat
from diagnosis.wheels.models import A_BIAS, A_GAIN, A_NONE, A_STUCK, S_GAIN, S_NONE, TOTAL_SENSOR, WheelFilterModel

Array = NDArray[np.float64]

_NOISY_LOSS = 0.6  # 95 % of the errors of a noisy sensor's ε̂ on tuning seeds
_DRAGGED = 0.95  # of a stuck opening's usual size: the ground, and who drives it, hide it by as much on tuning seeds (49 of 52)
_BIASED_LOSS = 0.3  # and of that of a valve with a disturbance


def estimate(m: int, y: Array, z: Array, P: Array, model: WheelFilterModel) -> tuple[Epsilon | None, Sat | None]:
    """ε̂ and the saturation term of a run.

    Parameters
    ----------
    m : int
        Model of the run.
    y : Array, shape (n,)
        Measured speed [m/s] where there is one.
    z, P : Array, shape (4,) and (4, 4)
        State of the model at the end of the run and its covariance.
    model : WheelFilterModel
        The wheel.

    Returns
    -------
    tuple[Epsilon | None, Sat | None]
        Saturation in [m/s] of a sensor, [fraction of full opening] of a valve; None where the row has none.
    """
    g, g_std = float(z[1]), float(np.sqrt(max(P[1, 1], 0.0)))
    loss = Epsilon(1 - g, 1 - g - 1.96 * g_std, 1 - g + 1.96 * g_std)
    if m in TOTAL_SENSOR:
        if not y.size:
            return Epsilon(1.0, 1.0, 1.0), None
        # of a silent sensor readings at the ends, before it fell silent or when it came back, are none of its own
        level = float(np.median(y) if m == S_NONE else np.mean(y))
        rms = float(np.sqrt(np.mean(y**2)))
        half = 1.96 * model.rounding
        return Epsilon(1.0, 1.0, 1.0), Sat(level, rms, level - half, level + half, "m/s")
    if m in (S_GAIN, A_GAIN):
        return loss, None
    half = 1.96 * float(np.sqrt(max(P[3, 3], 0.0)))
    if m in (A_STUCK, A_NONE):
        level = float(z[3]) / model.K if m == A_STUCK else 0.0
        half = max(half / model.K, _DRAGGED * model.valve_span) if m == A_STUCK else half / model.K
        return Epsilon(1.0, 0.0, 1.0), Sat(level, abs(level), level - half, level + half, "of full opening")
    eps = max(1 - g, 0.05)
    if m == A_BIAS:
        loss = _at_least(1 - g, max(1.96 * g_std, _BIASED_LOSS))
        level, half = float(z[3]) / model.K, half / model.K
        return loss, Sat(level / eps, abs(level) / eps, (level - half) / eps, (level + half) / eps, "of full opening")
    # gain and bias of a noisy sensor trade off against each other while the speed hardly changes
    loss = _at_least(1 - g, max(1.96 * g_std, _NOISY_LOSS))
    noise = float(np.sqrt(np.mean((y - np.mean(y)) ** 2))) if y.size else 0.0
    level = float(z[3]) / eps
    return loss, Sat(level, float(np.hypot(level, noise / eps)), level - half / eps, level + half / eps, "m/s")


def _at_least(loss: float, half: float) -> Epsilon:
    """A loss with bounds that are a fault's, between 0 and 1."""
    return Epsilon(loss, min(loss, max(0.0, loss - half)), max(loss, min(1.0, loss + half)))
