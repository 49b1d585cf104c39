"""ε̂ and the saturation term of a steering fault, from the states along the path."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.sample_status import PAIR
from diagnosis.results.result import Epsilon, Sat
from diagnosis.steering.filter_state import Array, SteeringPath
from diagnosis.steering.isolation import stuck_opening
from diagnosis.steering.model_bank import INEFFICIENT, NO_SIGNAL, STUCK
from diagnosis.steering.path import AxleFilter
from replay.faults import Side

_GONE = Epsilon(1.0, 1.0, 1.0)
_OPENING = "of full opening"
_LEAST_MISFIT = 0.01
_CONSTANT = 0.01  # of full opening, by which a healthy valve's zero is off (one standard deviation); set by hand


def estimate_size(
    side: Side, row: int, a: int, b: int, axle: AxleFilter, path: SteeringPath
) -> tuple[Epsilon | None, Sat | None]:
    """ε̂ and the saturation term of a row of the filter over blocks [a, b)."""
    if side is Side.SENSOR:
        return _sensor_size(row, a, b, axle, path)
    return _valve_size(row, a, b, axle, path)


def level_of(a: int, b: int, axle: AxleFilter) -> tuple[float, float, int]:
    """Median of the blocks' means in a run, their spread without the ends [rad], and the number of samples."""
    blocks = axle.blocks
    use = np.flatnonzero(blocks.status[a:b] == PAIR) + a
    if not use.size:
        return 0.0, 0.0, 0
    values = blocks.mean[use[1:-1] if use.size > 2 else use]
    return float(np.median(values)), float(np.ptp(values)), int(blocks.count[use].sum())


def _sensor_size(row: int, a: int, b: int, axle: AxleFilter, path: SteeringPath) -> tuple[Epsilon | None, Sat | None]:
    if row in (STUCK, NO_SIGNAL):
        level, spread, count = level_of(a, b, axle)
        half = 1.96 * float(np.sqrt(axle.model.noise.step)) + spread
        return _GONE, Sat(level, abs(level), level - half, level + half, "rad") if count else None
    last, var = path.mean[b - 1], path.variance[b - 1]
    epsilon = _epsilon(float(last[4]), float(np.sqrt(var[4])), axle)
    if row == INEFFICIENT:
        return epsilon, None
    use = axle.blocks.status[a:b] == PAIR
    residual = (axle.blocks.mean[a:b] - last[4] * path.mean[a:b, 0])[use]
    return epsilon, _sat(residual / max(epsilon.value, 0.1), "rad")


def _valve_size(row: int, a: int, b: int, axle: AxleFilter, path: SteeringPath) -> tuple[Epsilon | None, Sat | None]:
    if row == NO_SIGNAL:
        return _GONE, None
    last, var = path.mean[b - 1], path.variance[b - 1]
    if row == STUCK:
        gain = axle.model.plant.gain
        level, half = stuck_opening(float(last[3]), axle), 1.96 * float(np.sqrt(var[3])) / gain
        return _GONE, Sat(level, abs(level), level - half, level + half, _OPENING)
    epsilon = _epsilon(float(last[2]), float(np.hypot(np.sqrt(var[2]), _by_a_constant(axle.blocks.u[a:b]))), axle)
    if row == INEFFICIENT:
        return epsilon, None
    return epsilon, _sat(path.mean[a:b, 3] / axle.model.plant.gain / max(epsilon.value, 0.1), _OPENING)


def _epsilon(gain: float, std: float, axle: AxleFilter) -> Epsilon:
    """ε̂ = 1 − δ̂ with its 95 % bounds: what the plant leaves unexplained does not average out over a fault."""
    half = 1.96 * float(np.hypot(std, gain * max(axle.model.plant.misfit, _LEAST_MISFIT)))
    return Epsilon(1 - gain, 1 - gain - half, 1 - gain + half)


def _by_a_constant(u: Array) -> float:
    """Standard deviation of a valve's share by what its opening is off by at rest, of openings u, shape (k,) [1]."""
    opened = np.abs(u[np.abs(u) > _CONSTANT])
    return _CONSTANT / float(np.sqrt(np.mean(opened**2))) if opened.size else 0.0


def _sat(values: Array, unit: str) -> Sat | None:
    """Mean of a saturation term with its 95 % bounds, and its root mean square."""
    if not values.size:
        return None
    mean, rms = float(values.mean()), float(np.sqrt(np.mean(values**2)))
    half = 1.96 * float(values.std()) / np.sqrt(max(1.0, values.size / 50))
    return Sat(mean, rms, mean - half, mean + half, unit)
