"""Rows of the sensor's table for a speed beside an independent reading of it, as states on a grid.

Unlike `diagnosis.estimation.fault_models`, whose filters estimate gain and bias as they go, the unknowns lie on a grid here:
every state has its own ε, or its own bias and power. Nothing has to be learned after an onset, so that a few samples
decide, onsets stay sharp, and noise with heavy tails does no harm.

healthy      y = x + n
stuck        y as one sample before
no_signal    y = 0
inefficient  y = (1 − ε)·x + n
noisy        y = x + m + n + w, bias m, noise w

A reading of the speed that rests on another channel is exact for most samples and a step late for the rest, so n is
small with probability q and large otherwise; a few samples are larger still.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import HEALTHY, INEFFICIENT, NO_SIGNAL, NOISY, STUCK

Array = NDArray[np.float64]

_EPSILONS = np.r_[np.arange(3, 10), np.arange(10, 97, 2)] / 100
_HALF_STEPS = np.where(_EPSILONS < 0.1, 0.005, 0.01)
_POWERS = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])  # of the added noise [healthy noise]
_BIASES = np.arange(-3.0, 3.5)  # of the noisy row [its noise]

#: Row, ε [1] and half the distance to the next ε [1] of each state.
ROW = np.r_[
    HEALTHY, STUCK, NO_SIGNAL, np.full(_EPSILONS.size, INEFFICIENT), np.full(_POWERS.size * _BIASES.size, NOISY)
].astype(np.int64)
EPSILON = np.r_[np.zeros(3), _EPSILONS, np.zeros(_POWERS.size * _BIASES.size)]
HALF_STEP = np.r_[np.zeros(3), _HALF_STEPS, np.zeros(_POWERS.size * _BIASES.size)]
STATES = ROW.size


class GridNoise(NamedTuple):
    """Constants of the compiled recursion, of one drive.

    Attributes
    ----------
    core, late : float
        Standard deviation of y − x of the exact samples and of those a step late [m/s].
    exact : float
        Share of the exact samples [1].
    constant : float
        Standard deviation of y while stuck [m/s].
    span : float
        Largest plausible speed [m/s].
    switch_cost : float
        Minus the log-probability of entering a row at one sample.
    """

    core: float
    late: float
    exact: float
    constant: float
    span: float
    switch_cost: float


class Disturbance(NamedTuple):
    """What the noisy row's states add to the speed, shape (states,) [m/s]; 0 for the other rows.

    Attributes
    ----------
    bias, added : Array
        Bias m, and standard deviation of the noise w.
    """

    bias: Array
    added: Array


@dataclass(frozen=True)
class RowModel:
    """Noise and prior of a speed.

    Attributes
    ----------
    noise : float
        Root mean square of y − x while healthy [m/s].
    core, exact : float
        Standard deviation of the samples that are exact [m/s], and their share [1].
    constant_noise : float
        Standard deviation of y while stuck [m/s].
    span : float
        Largest plausible speed [m/s].
    switch_cost : float
        Minus the log-probability of entering a row at one sample.
    """

    noise: float
    core: float
    exact: float
    constant_noise: float
    span: float
    switch_cost: float

    @property
    def added(self) -> Array:
        """Noise w of each state [m/s]; 0 outside the noisy row. Shape (states,)."""
        out: Array = np.r_[np.zeros(3 + _EPSILONS.size), np.repeat(_POWERS * self.noise, _BIASES.size)]
        return out

    @property
    def bias(self) -> Array:
        """Bias m of each state [m/s]; 0 outside the noisy row. Shape (states,)."""
        out: Array = np.r_[np.zeros(3 + _EPSILONS.size), (_POWERS[:, None] * self.noise * _BIASES).ravel()]
        return out

    @property
    def disturbance(self) -> Disturbance:
        """Bias and noise of each state."""
        return Disturbance(self.bias, self.added)

    def grid_noise(self) -> GridNoise:
        """Constants of the compiled recursion."""
        rest = (self.noise**2 - self.exact * self.core**2) / max(1 - self.exact, 1e-3)
        late = np.sqrt(max(rest, self.core**2))
        scalars = (self.core, late, self.exact, self.constant_noise, self.span, self.switch_cost)
        return GridNoise(*(float(value) for value in scalars))
