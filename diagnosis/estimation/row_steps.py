"""Rows of the fault table as Kalman filters in plain arithmetic: the evidence of a few hundred readings, without any package.

The models are those of `diagnosis.estimation.row_filters`, where filterpy holds them as matrices; the tests hold both against each
other. Here F and Q are diagonal and P is symmetric, so that a step is a dozen products of numbers.
"""

from __future__ import annotations

from math import exp, log, pi

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import CONSTANT, FIRST_NOISY, GAIN, MISMATCH, NOISY_MODELS, ZERO, ModeModel

Array = NDArray[np.float64]

_LOG_2PI = log(2.0 * pi)


def stepped(y: Array, x: Array, model: ModeModel, m: int) -> Array:
    """Log-likelihood of each reading given those before it, by one model of a row.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Readings and what is expected of them [unit of the channel].
    model : ModeModel
        Noise and prior of the channel.
    m : int
        Place of the model in `ROW_OF_MODEL`.

    Returns
    -------
    Array, shape (n,)
    """
    (d, c), (p, q, w), (f, walk), variance = _start(m, model)
    grows = m == GAIN and model.noise**2 > 4.0 * model.constant_noise**2
    by_x, by_one = m not in (CONSTANT, ZERO), m in (MISMATCH, *range(FIRST_NOISY, FIRST_NOISY + len(NOISY_MODELS)))
    out = []
    for measured, expected in zip(y.tolist(), x.tolist(), strict=True):
        c, q, w = f * c, f * q, f * f * w + walk  # x = F x, P = F P Fᵀ + Q
        h0, h1 = (expected, float(by_one)) if by_x else (float(m == CONSTANT), 0.0)
        r = variance * max(1.0, d * d) if grows else variance
        g0, g1 = p * h0 + q * h1, q * h0 + w * h1  # P Hᵀ
        s = h0 * g0 + h1 * g1 + r
        innovation = measured - h0 * d - h1 * c
        k0, k1 = g0 / s, g1 / s
        d, c = d + k0 * innovation, c + k1 * innovation
        a00, a01, a10, a11 = 1.0 - k0 * h0, -k0 * h1, -k1 * h0, 1.0 - k1 * h1
        p, q, w = (  # P = (I−KH)P(I−KH)ᵀ + KRKᵀ
            a00 * a00 * p + 2.0 * a00 * a01 * q + a01 * a01 * w + k0 * k0 * r,
            a00 * a10 * p + (a00 * a11 + a01 * a10) * q + a01 * a11 * w + k0 * k1 * r,
            a10 * a10 * p + 2.0 * a10 * a11 * q + a11 * a11 * w + k1 * k1 * r,
        )
        out.append(-0.5 * (innovation * innovation / s + log(s) + _LOG_2PI))
    return np.array(out)


def _start(
    m: int, model: ModeModel
) -> tuple[tuple[float, float], tuple[float, float, float], tuple[float, float], float]:
    """Mean, covariance (P₀₀, P₀₁, P₁₁), F₁₁ and Q₁₁, and R before the first reading."""
    noise, tolerance, span = model.noise**2, model.tolerance**2, model.span
    if m == MISMATCH:
        f = exp(-model.dt / model.mismatch_s)
        return (1.0, 0.0), (0.0, 0.0, tolerance), (f, (1.0 - f * f) * tolerance), noise
    if m == CONSTANT:
        return (0.0, 0.0), (span**2, 0.0, 0.0), (1.0, 0.0), model.constant_noise**2
    if m == ZERO:
        return (0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0), model.constant_noise**2
    if m == GAIN:
        return (0.5, 0.0), (0.3**2, 0.0, 0.0), (1.0, 0.0), noise
    if m >= FIRST_NOISY:
        walk, power = NOISY_MODELS[m - FIRST_NOISY]
        return (
            (0.6, 0.0), (0.3**2, 0.0, (0.3 * span) ** 2), (1.0, (walk * span) ** 2 * model.dt), noise * power**2
        )  # fmt: skip
    return (1.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0), noise
