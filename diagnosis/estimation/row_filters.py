"""Rows of the fault table as filterpy's Kalman filters, each stepped sample by sample: the readable definition of the models.

Of a measured y beside what is expected of it, x, every row says something else (L4 for sensors, L8 for actuators, with
ε = 1 − δ and the saturation term δ̄):

=============  ==================  ==============  =======================================  =======================
row            unknowns            H               P₀                                       R
=============  ==================  ==============  =======================================  =======================
healthy        [1, b]              [x, 1]          b: tolerance²                            noise²
stuck          [c, –]              [1, 0]          c: span²                                 constant noise²
no signal      –                   [0, 0]          –                                        constant noise²
inefficient    [δ, –]              [x, 0]          δ: .3² around .5                         noise²·max(1, δ²)
noisy          [δ, δ̄]              [x, 1]          δ: .3² around .6, δ̄: (.3 span)²          (power·noise)²
=============  ==================  ==============  =======================================  =======================

F is 1 but for b, which passes: exp(−dt/mismatch_s). Q is zero but for b and for the random walk of δ̄. The compiled filters of
`diagnosis.estimation.filter_kernel` compute the same numbers for whole missions, which the tests hold against these.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import (
    CONSTANT,
    FIRST_NOISY,
    GAIN,
    MISMATCH,
    NOISY_MODELS,
    ROW_OF_MODEL,
    ZERO,
    ModeModel,
)
from diagnosis.estimation.filterpy_loading import kalman_filter

Array = NDArray[np.float64]

LOG_2PI = float(np.log(2.0 * np.pi))


def models_of(row: int) -> tuple[int, ...]:
    """Models of a row, by their places in `ROW_OF_MODEL`."""
    return tuple(int(m) for m in np.flatnonzero(row == ROW_OF_MODEL))


class RowFilter:
    """One model of a row, as filterpy's filter of [δ or c, δ̄ or b].

    Parameters
    ----------
    m : int
        Place of the model in `ROW_OF_MODEL`.
    model : ModeModel
        Noise and prior of the channel.
    """

    def __init__(self, m: int, model: ModeModel) -> None:
        self.m, self.noise = m, model.noise
        self.grows = m == GAIN and model.noise**2 > 4.0 * model.constant_noise**2
        kf = kalman_filter()(dim_x=2, dim_z=1)
        kf.F, kf.Q, kf.P = np.eye(2), np.zeros((2, 2)), np.zeros((2, 2))
        kf.x = np.array([[1.0], [0.0]])
        noise = model.noise
        if m == MISMATCH:
            f = float(np.exp(-model.dt / model.mismatch_s))
            kf.P[1, 1] = model.tolerance**2
            kf.F, kf.Q = np.diag([1.0, f]), np.diag([0.0, (1.0 - f * f) * model.tolerance**2])
        elif m == CONSTANT:
            kf.x[0, 0], kf.P[0, 0], noise = 0.0, model.span**2, model.constant_noise
        elif m == ZERO:
            kf.x[0, 0], noise = 0.0, model.constant_noise
        elif m == GAIN:
            kf.x[0, 0], kf.P[0, 0] = 0.5, 0.3**2
        elif m >= FIRST_NOISY:
            walk, power = NOISY_MODELS[m - FIRST_NOISY]
            kf.x[0, 0], kf.P = 0.6, np.diag([0.3**2, (0.3 * model.span) ** 2])
            kf.Q = np.diag([0.0, (walk * model.span) ** 2 * model.dt])
            noise *= power
        kf.R = np.array([[noise**2]])
        self.still = not kf.Q.any() and m != MISMATCH
        self.kf = kf

    def row(self, x: float) -> list[float]:
        """H for a reference x. `x` is in the channel's unit [m/s, rad or 1]."""
        if self.m == CONSTANT:
            return [1.0, 0.0]
        if self.m == ZERO:
            return [0.0, 0.0]
        return [x, 1.0] if self.m == MISMATCH or self.m >= FIRST_NOISY else [x, 0.0]

    def step(self, y: float, x: float, white: float = 1.0) -> float:
        """Take one sample; returns the log-likelihood of its innovation.

        Parameters
        ----------
        y, x : float
            Measured value and reference [unit of the channel].
        white : float
            Variance of the healthy noise at this sample, as a share of the model's [1].
        """
        kf = self.kf
        if not self.still:  # F = 1 and Q = 0 change nothing
            kf.predict()
        r = None
        if self.grows or white != 1.0:
            r = float(kf.R[0, 0]) * white * (max(1.0, float(kf.x[0, 0]) ** 2) if self.grows else 1.0)
        kf.update(y, R=r, H=np.array([self.row(x)]))
        s = float(kf.S[0, 0])
        return -0.5 * (float(kf.y[0, 0]) ** 2 / s + float(np.log(s)) + LOG_2PI)

    @property
    def gain(self) -> tuple[float, float]:
        """δ̂ and its standard deviation [1]."""
        return float(self.kf.x[0, 0]), float(np.sqrt(max(self.kf.P[0, 0], 0.0)))
