"""Constants of a steering axle's plant by robust least squares: what most windows agree on, with a covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.valve_map import ValveMap
from diagnosis.steering.windows import Windows

Array = NDArray[np.float64]

#: Places of the constants: logarithms of slopes and limits of both directions, dead bands, logarithm of the lag, play.
SLOPES, DEAD, LIMITS, LAG, PLAY = slice(0, 2), slice(2, 4), slice(4, 6), 6, 7
SIZE = 8
TOLERANCES = (0.3, 0.12, 0.05)
_JUDGED = (0.03, 0.12)
_ROUNDS = 8
_CLUSTER_S = 3.0
_INDEPENDENT_S = 1.0  # windows within it are one observation: faults and what a plant leaves unexplained last


@dataclass(frozen=True)
class Belief:
    """A normal distribution of the constants.

    Attributes
    ----------
    mean : Array, shape (8,)
        Centre.
    cov : Array, shape (8, 8)
        Covariance.
    """

    mean: Array
    cov: Array


@dataclass(frozen=True)
class FittedPlant:
    """What the windows say of the constants.

    Attributes
    ----------
    x : Array, shape (8,)
        Constants.
    cov : Array, shape (8, 8)
        Their covariance, windows of some seconds taken as one observation.
    loss : float
        Mean robust loss per window in which the axle moves or should, 0…1, and what the prior charges for each.
    """

    x: Array
    cov: Array
    loss: float


def unpacked(x: Array) -> tuple[ValveMap, float, float]:
    """Valve map, lag [s] and half the play [rad] of a vector of constants. `x` of shape (8,)."""
    slope, limit = np.exp(x[SLOPES]), np.exp(x[LIMITS])
    dead = np.maximum(x[DEAD], 0.0)
    valve = ValveMap(float(slope[0]), float(slope[1]), float(dead[0]), float(dead[1]), float(limit[0]), float(limit[1]))
    return valve, float(np.exp(x[LAG])), float(max(x[PLAY], 0.0))


def packed(valve: ValveMap, lag: float, play: float) -> Array:
    """Vector of constants. Shape (8,); lag in s, play in rad."""
    logs = np.log([valve.slope_up, valve.slope_down, valve.limit_up, valve.limit_down, max(lag, 1e-3)])
    return np.array([logs[0], logs[1], valve.dead_up, valve.dead_down, logs[2], logs[3], logs[4], play])


def predicted_by(part: Windows, x: Array) -> Array:
    """Rates of a window's axle by a vector of constants [rad/s]. Shape (w,); `x` of shape (8,)."""
    return part.predicted(*unpacked(x))


def predicted_with_slopes(part: Windows, x: Array) -> tuple[Array, Array]:
    """Rates of a window's axle by a vector of constants [rad/s], and their derivatives by it, shape (w, 8)."""
    valve, lag, play = unpacked(x)
    rates, slopes = part.slopes(valve, lag, play)
    slopes *= np.array([valve.slope_up, valve.slope_down, 1.0, 1.0, valve.limit_up, valve.limit_down, lag, 1.0])
    return rates, slopes


def tolerance_of(part: Windows, scale: float, share: float) -> Array:
    """What a window's rate may differ by: noise, and a share of the rate [rad/s]. Shape (w,)."""
    return np.asarray(np.hypot(2 * part.noise, share * np.maximum(np.abs(part.rate), 0.1 * scale)))


def moving(part: Windows, predicted: Array, scale: float) -> NDArray[np.bool_]:
    """Windows in which the axle turns, or should. Shape (w,); rates and `scale` in rad/s."""
    return np.asarray(part.good & (np.maximum(np.abs(predicted), np.abs(part.rate)) > 0.1 * scale))


def robust_loss(parts: Sequence[Windows], x: Array, scale: float, share: float) -> float:
    """Mean of r²/(1 + r²) over the windows in which an axle moves or should; inf where there are none.

    `x` of shape (8,), `scale` in rad/s, `share` a fraction.
    """
    total, count = 0.0, 0
    for part in parts:
        predicted = predicted_by(part, x)
        use = moving(part, predicted, scale)
        r2 = ((part.rate - predicted)[use] / tolerance_of(part, scale, share)[use]) ** 2
        total += float((r2 / (1 + r2)).sum())
        count += int(np.count_nonzero(use))
    return total / count if count else np.inf


def fit_plant(
    parts: Sequence[Windows],
    start: Array,
    prior: Belief,
    scale: float,
    shares: Sequence[float] = TOLERANCES,
) -> FittedPlant:
    """Levenberg–Marquardt with Geman–McClure's weights, whose tolerance shrinks from round to round.

    Parameters
    ----------
    parts : Sequence[Windows]
        Windows of one or several axles or missions that share the constants.
    start : Array, shape (8,)
        Where to begin.
    prior : Belief
        What is believed before.
    scale : float
        Usual rate of the mission [rad/s].
    shares : Sequence[float]
        Tolerances of the rounds, as shares of a rate.
    """
    inverse = np.asarray(np.linalg.inv(prior.cov), dtype=np.float64)
    x, tolerances = start.copy(), []
    for share in shares:
        damping = 1e-3
        tolerances = [tolerance_of(part, scale, share) for part in parts]
        value = _objective(parts, x, prior.mean, inverse, tolerances)
        for _ in range(_ROUNDS):
            hessian, gradient, _ = _normal_equations(parts, x, tolerances)
            hessian, gradient = hessian + inverse, gradient + inverse @ (prior.mean - x)
            improved = False
            for _ in range(4):
                step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), gradient)
                trial = x + np.clip(step, -0.5, 0.5)
                trial[DEAD], trial[PLAY] = np.maximum(trial[DEAD], 0.0), max(trial[PLAY], 0.0)
                found = _objective(parts, trial, prior.mean, inverse, tolerances)
                if found < value:
                    improved = value - found > 1e-4 * abs(value)
                    x, value, damping = trial, found, damping / 5
                    break
                damping *= 10
            if not improved:
                break
    hessian, _, clusters = _normal_equations(parts, x, tolerances)
    bread = np.linalg.inv(hessian + inverse)
    meat = clusters.T @ clusters + inverse
    loss = float(np.mean([robust_loss(parts, x, scale, share) for share in _JUDGED]))
    observations = sum(_independent(p) * np.count_nonzero(p.good) for p in parts)
    charge = float((x - prior.mean) @ inverse @ (x - prior.mean)) / max(observations, 1.0)
    return FittedPlant(x, bread @ meat @ bread, loss + charge)


def _objective(parts: Sequence[Windows], x: Array, centre: Array, inverse: Array, tolerances: list[Array]) -> float:
    """Half the robust sum of squares and of the prior."""
    total = float((x - centre) @ inverse @ (x - centre))
    for part, tolerance in zip(parts, tolerances, strict=True):
        r2 = ((part.rate - predicted_by(part, x)) / tolerance)[part.good] ** 2
        total += _independent(part) * float((r2 / (1 + r2)).sum())
    return total / 2


def _independent(part: Windows) -> float:
    """Independent observations per window."""
    return min(1.0, part.length * part.dt / _INDEPENDENT_S)


def _normal_equations(parts: Sequence[Windows], x: Array, tolerances: list[Array]) -> tuple[Array, Array, Array]:
    """JᵀWJ, JᵀWr, and JᵀWr of stretches of some seconds, shape (c, 8)."""
    hessian, gradient, clusters = np.zeros((SIZE, SIZE)), np.zeros(SIZE), []
    for part, tolerance in zip(parts, tolerances, strict=True):
        predicted, jacobian = predicted_with_slopes(part, x)
        jacobian /= tolerance[:, None]
        r = (part.rate - predicted) / tolerance
        weight = np.where(part.good, 1 / (1 + r * r) ** 2, 0.0)
        weight *= _independent(part)
        pull = jacobian * (weight * r)[:, None]
        hessian += (jacobian * weight[:, None]).T @ jacobian
        gradient += pull.sum(axis=0)
        width = max(1, round(_CLUSTER_S / (part.length * part.dt)))
        clusters.append(np.add.reduceat(pull, np.arange(0, r.size, width), axis=0))
    return hessian, gradient, np.concatenate(clusters)
