"""Which fault of either side holds on a wheel of which only u and v are known: mode-conditioned Kalman filters.

Wheel: τ·v̇ = −v + K(δ_a·u + b_a) + load; sensor: y = δ_s·v + b_s + n. The state of every model is [ν, g, b, c]:
ν the speed as the sensor scales it, g the unknown gain, b the load or actuator bias as a speed, c the stuck value or
the sensor's bias. A sensor's loss of gain scales ν at once when the model is entered; an actuator's only bends it, so
the shape of an onset tells the two apart without a test of its own. As in `modes`, Viterbi's recursion keeps the most
probable entry of each model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.modes import PAIR, STAY, trace
from diagnosis.wheel_scan import HEALTHY, MODELS, WHITE, enter, scan, scan_evidence

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WheelFilterModel:
    """Constants of one wheel.

    Attributes
    ----------
    K : float
        Speed per full opening [m/s].
    tau : float
        Lag [s].
    noise : float
        White noise of the speed sensor [m/s].
    constant_noise : float
        Noise left in a stuck sensor: its rounding [m/s].
    load : float
        Standard deviation of load and model error, as a speed [m/s].
    load_s : float
        Correlation time of the load [s].
    span : float
        Largest plausible speed [m/s].
    valve_span : float
        Standard deviation of a stuck valve's opening [fraction].
    switch_cost : float
        Minus the log-probability of entering a model at one sample.
    dt : float
        Step [s].
    """

    K: float
    tau: float
    noise: float
    constant_noise: float
    load: float
    load_s: float
    span: float
    valve_span: float
    switch_cost: float
    dt: float

    def packed(self) -> Array:
        """Parameters in the order of the compiled scan."""
        return np.array(
            [
                self.K,
                np.exp(-self.dt / self.tau),
                self.noise,
                self.constant_noise,
                self.load,
                np.exp(-self.dt / self.load_s),
                self.span,
                self.valve_span * self.K,
                self.switch_cost,
                self.dt,
            ]
        )


@dataclass(frozen=True)
class WheelPath:
    """Most probable models of a wheel.

    Attributes
    ----------
    model : NDArray[np.uint8], shape (n,)
        Index into `NAMES`.
    entered : NDArray[np.bool_], shape (n,)
        Samples at which a model was entered.
    track : Array, shape (6, n)
        Predicted healthy speed and its variance, gain and its variance, bias and its variance of the best model.
    """

    model: NDArray[np.uint8]
    entered: NDArray[np.bool_]
    track: Array


def start_state(first: float, p: Array) -> tuple[Array, Array, Array]:
    """Scores, means and covariances before the first sample of a mission that may begin with a fault."""
    score = np.full(MODELS, -0.5 * p[8])
    score[HEALTHY] = 0.0
    z, P = np.zeros((MODELS, 4)), np.zeros((MODELS, 4, 4))
    z[HEALTHY] = [first, 1.0, 0.0, 0.0]
    P[HEALTHY, 0, 0], P[HEALTHY, 2, 2] = p[6] ** 2, p[4] ** 2
    for m in range(1, MODELS):
        enter(m, HEALTHY, p, z, P)
    return score, z, P


@dataclass(frozen=True)
class WheelFilterState:
    """What the recursion carries from block to block: score, mean and covariance of every model."""

    score: Array
    mean: Array
    cov: Array


def initial_state(first: float, model: WheelFilterModel) -> WheelFilterState:
    """State before the first sample of a mission that may begin with a fault; `first` is the first speed [m/s]."""
    return WheelFilterState(*start_state(first, model.packed()))


def forward(
    y: Array,
    u: Array,
    common: Array,
    slack: Array,
    status: NDArray[np.int8],
    quiet: NDArray[np.bool_],
    model: WheelFilterModel,
    state: WheelFilterState,
) -> tuple[NDArray[np.uint8], Array, WheelFilterState]:
    """Run the recursion over one block; see `most_probable` for the arguments.

    Returns
    -------
    back : NDArray[np.uint8], shape (n, models)
        Back-pointers.
    track : Array, shape (6, n)
        As in `WheelPath`.
    state : WheelFilterState
        For the next block.
    """
    back = np.full((y.size, MODELS), STAY, dtype=np.uint8)
    track = np.zeros((6, y.size))
    score, z, P = state.score.copy(), state.mean.copy(), state.cov.copy()
    scan(y, u, common, slack, status, quiet, model.packed(), WHITE, score, z, P, back, track)
    return back, track, WheelFilterState(score, z, P)


def most_probable(
    y: Array,
    u: Array,
    common: Array,
    slack: Array,
    status: NDArray[np.int8],
    quiet: NDArray[np.bool_],
    model: WheelFilterModel,
) -> WheelPath:
    """Most probable models of a wheel over a mission.

    Parameters
    ----------
    y, u : Array, shape (n,)
        Measured speed [m/s] and valve opening [fraction] in force since the step before.
    common : Array, shape (n,)
        Load shared with the other wheels, as a speed [m/s].
    slack : Array, shape (n,)
        Standard deviation of the wheel model's error beyond the load [m/s]; 0 where it holds.
    status : NDArray[np.int8], shape (n,)
        As in `diagnosis.modes`.
    quiet : NDArray[np.bool_], shape (n,)
        Where the wheel is neither commanded nor moving.
    model : WheelFilterModel
        Constants.
    """
    known = np.flatnonzero(status == PAIR)
    state = initial_state(float(y[known[0]]) if known.size else 0.0, model)
    back, track, state = forward(y, u, common, slack, status, quiet, model, state)
    path, entered = trace(back, int(np.argmax(state.score)))
    return WheelPath(path, entered, track)


def segment_evidence(
    y: Array,
    u: Array,
    common: Array,
    slack: Array,
    status: NDArray[np.int8],
    quiet: NDArray[np.bool_],
    begin: int,
    model: WheelFilterModel,
) -> tuple[Array, Array, Array]:
    """Log-evidence of every model over samples from `begin` on, after a healthy run-in before it.

    Returns
    -------
    evidence : Array, shape (models,)
        Natural log.
    mean, covariance : Array, shape (models, 4) and (models, 4, 4)
        States [ν, g, b, c] at the end.
    """
    p = model.packed()
    known = np.flatnonzero(status == PAIR)
    _, z, P = start_state(float(y[known[0]]) if known.size else 0.0, p)
    return scan_evidence(y, u, common, slack, status, quiet, begin, p, WHITE, z, P)  # type: ignore[no-any-return]
