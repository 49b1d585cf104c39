"""ε̂ and the saturation term of one fault, with 95 % bounds, from the samples of its interval."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation import fault_models
from diagnosis.results.result import Epsilon, Sat
from replay.arrays.compiling import njit

Array = NDArray[np.float64]

_PRIOR = np.array([0.7, 0.0])  # of [δ, mean δ̄] of a noisy channel


def estimate_fault(
    row: int, y: Array, x: Array, model: fault_models.ModeModel, unit: str, instruments: Array | None
) -> tuple[Epsilon | None, Sat | None, float] | None:
    """ε̂ and the saturation term of one row of the table with 95 % bounds, and δ̂.

    Parameters
    ----------
    row : int
        Row of the table.
    y, x : Array, shape (n,)
        Samples of the run.
    model : ModeModel
        Noise of the channel.
    unit : str
        Unit of the saturation term.
    instruments : Array, shape (n, k), or None
        Signals that drive x but know nothing of the fault, such as the commanded speed and what a wheel makes of it.
    """
    if y.size < 3:
        return (Epsilon(1.0, 0.0, 1.0), None, 0.0) if row == fault_models.NO_SIGNAL else None
    if row in fault_models.TOTAL_ROWS:
        level = float(np.mean(y))
        spread = float(np.std(y))
        # what moved says what is left of it; of a silent channel, whose saturation term is 0, any command does
        driven = float(np.sqrt(np.mean(x**2))) if row == fault_models.NO_SIGNAL else float(np.std(x))
        slack = min(1.0, 1.96 * (model.constant_noise + spread) / max(1e-300, driven * np.sqrt(y.size)))
        se = 1.96 * max(model.constant_noise, spread) / np.sqrt(y.size)
        sat = Sat(level, float(np.sqrt(np.mean(y**2))), level - se, level + se, unit)
        return Epsilon(1.0, 1.0 - slack, 1.0), sat, 0.0
    if row in fault_models.SCALED_ROWS:
        sxx = float(x @ x)
        if sxx <= 0:
            return None
        delta = float(x @ y) / sxx
        residual = y - delta * x
        se = 1.96 * np.sqrt(_long_run_variance(residual) / sxx)
        return _epsilon(delta, se), None, delta
    # a share and a saturation term, of which δ̄ drifts
    if instruments is None:
        delta, delta_se = _gain_with_drift(y, x, model)
    else:
        delta, delta_se = _gain_by_instruments(y, x, instruments, model)
    bias = y - delta * x
    epsilon = _epsilon(delta, 1.96 * delta_se)
    if epsilon.value < 0.1:
        return epsilon, None, delta  # δ̄ is known, but not what share of the saturation term it is
    eps = epsilon.value
    mean, rms = float(np.mean(bias)), float(np.sqrt(np.mean(bias**2)))
    half = 1.96 * np.sqrt(_long_run_variance(bias) / bias.size) + 1.96 * delta_se * abs(float(np.mean(x)))
    return epsilon, Sat(mean / eps, rms / eps, (mean - half) / eps, (mean + half) / eps, unit), delta


def _epsilon(delta: float, half: float) -> Epsilon:
    value = 1.0 - delta
    return Epsilon(float(value), float(value - half), float(value + half))


def _long_run_variance(residual: Array) -> float:
    """Variance of the mean times n: AR(1) inflation of the sample variance."""
    if residual.size < 2:
        return 0.0
    now, before, both = _moments(np.stack((residual - residual.mean(), np.ones_like(residual))))[:3]
    power = float(now[0, 0] + before[0, 0]) / 2
    var = power / (residual.size - 1)
    if var <= 0 or residual.size < 8:
        return var
    rho = min(0.999, max(0.0, float(both[0, 0]) / power))
    return var * (1 + rho) / (1 - rho)


@njit(cache=True)
def _moments(rows):  # type: ignore[no-untyped-def]
    """Products summed over the samples from the second on: rows now, rows before, now with before; (k, k) each."""
    k, n = rows.shape
    now, before, both = np.zeros((k, k)), np.zeros((k, k)), np.zeros((k, k))
    for t in range(1, n):
        for i in range(k):
            for j in range(k):
                now[i, j] += rows[i, t] * rows[j, t]
                before[i, j] += rows[i, t - 1] * rows[j, t - 1]
                both[i, j] += rows[i, t] * rows[j, t - 1]
    return now, before, both


def _gain_by_instruments(y: Array, x: Array, instruments: Array, model: fault_models.ModeModel) -> tuple[float, float]:
    """δ of y = δ·x + δ̄ + n by two-stage least squares.

    The loop answers to a sensor's noise, so that x and δ̄ are correlated and a plain regression takes δ too small; the
    part of x that follows the command is free of that. The noise enters by its long-run variance over 0.25 s.
    """
    base = np.column_stack([instruments, np.ones_like(x)])
    gram = np.einsum("ni,nj->ij", base, base)
    driven = np.einsum("ni,i->n", base, np.linalg.lstsq(gram, np.einsum("ni,n->i", base, x), rcond=None)[0])
    ones = float(x.size)
    across = float(driven.sum())
    normal = np.array([[float(np.sum(driven * driven)), across], [across, ones]])
    seen = np.array([float(np.sum(driven * y)), float(y.sum())])
    rest = y - _PRIOR[0] * x
    rest = rest - rest.mean()
    length = max(1, round(0.25 / model.dt))
    count = rest.size // length
    if count >= 2:
        variance = float(np.var(rest[: count * length].reshape(count, length).mean(axis=1))) * length
    else:
        variance = float(np.var(rest)) * length / 5
    variance = max(variance, model.noise**2)
    ridge = np.diag([1 / 0.3**2, 1 / (0.06 * model.span) ** 2])
    covariance = np.linalg.inv(ridge + normal / variance)
    theta = covariance @ (ridge @ _PRIOR + seen / variance)
    return float(theta[0]), float(np.sqrt(covariance[0, 0]))


def _gain_with_drift(y: Array, x: Array, model: fault_models.ModeModel) -> tuple[float, float]:
    """δ of y = δ·x + δ̄ + n with an AR(1) δ̄ around a constant: Cochrane–Orcutt steps from a ridge on [δ, mean]."""
    spread = float(np.std(y - 0.7 * x)) + model.noise
    ridge = np.diag([1 / 0.3**2, 1 / (0.1 * model.span) ** 2])
    rho, sigma = 0.0, spread
    theta: Array = _PRIOR
    now, before, both = _moments(np.stack((x, np.ones_like(x), y)))
    covariance = np.asarray(np.linalg.inv(ridge), dtype=np.float64)
    for _ in range(6):
        # products of what is left of [x, 1, y] when ρ times the sample before is taken away
        left = now - rho * (both + both.T) + rho**2 * before
        covariance = np.asarray(np.linalg.inv(ridge + left[:2, :2] / sigma**2), dtype=np.float64)
        theta = np.asarray(covariance @ (ridge @ _PRIOR + left[:2, 2] / sigma**2), dtype=np.float64)
        weights = np.append(-theta, 1.0)
        norm = float(weights @ before @ weights)
        rho = min(0.9995, max(0.0, float(weights @ both @ weights) / norm)) if norm > 0 else 0.0
        left = now - rho * (both + both.T) + rho**2 * before
        mean = float(weights @ (now[:, 1] - rho * before[:, 1])) / (y.size - 1)
        power = float(weights @ left @ weights) / (y.size - 1) - mean**2
        sigma = max(float(np.sqrt(max(power, 0.0))), 1e-9 * model.span)
    return float(theta[0]), float(np.sqrt(covariance[0, 0]))
