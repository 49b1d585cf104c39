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
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

HEALTHY, S_STUCK, S_NONE, S_GAIN, S_DRIFT, S_WHITE_3, S_WHITE_8, S_WHITE_25, A_GAIN, A_STUCK, A_NONE, A_BIAS = range(12)
MODELS = 12
NAMES = (
    ("none", "healthy"),
    ("sensor", "stuck"),
    ("sensor", "no_signal"),
    ("sensor", "inefficient"),
    ("sensor", "noisy"),
    ("sensor", "noisy"),
    ("sensor", "noisy"),
    ("sensor", "noisy"),
    ("actuator", "inefficient"),
    ("actuator", "stuck"),
    ("actuator", "no_signal"),
    ("actuator", "noisy"),
)
ROW = np.array([0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8])
_WHITE = np.array([1.0, 3.0, 8.0, 25.0])
_STAY = 255
_OUTLIER = -18.0
_LEARNING_COST = 10.0
_SKIP, _PAIR, _SILENT = 0, 1, 2
_SILENT_COST = -6.0


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


@njit(cache=True)
def _enter(m, old, p, z, P):  # type: ignore[no-untyped-def]
    """Start model m from the state of model `old`: speed and load are carried over, the unknowns get their priors."""
    v, var = z[old, 0], P[old, 0, 0]
    load, load_var = z[old, 2], P[old, 2, 2]
    if old == S_GAIN:
        g = max(z[old, 1], 0.05)
        v, var = v / g, var / (g * g) + (v / g) ** 2 * P[old, 1, 1] / (g * g)
        load, load_var = load / g, load_var / (g * g)
    elif old in (S_STUCK, S_NONE):
        var += (0.1 * p[6]) ** 2  # the model alone has carried the speed
    elif old in (A_STUCK, A_BIAS):
        load, load_var = 0.0, p[4] ** 2
    load_var = min(load_var, p[4] ** 2)
    for i in range(4):
        z[m, i] = 0.0
        for j in range(4):
            P[m, i, j] = 0.0
    z[m, 0], P[m, 0, 0] = v, var
    z[m, 1] = 1.0
    z[m, 2], P[m, 2, 2] = load, load_var
    if m == S_STUCK:
        P[m, 3, 3] = p[6] ** 2
    elif m >= S_DRIFT and m <= S_WHITE_25:
        P[m, 3, 3] = (0.3 * p[6]) ** 2
    elif m == S_GAIN:
        z[m, 0], z[m, 1], z[m, 2] = 0.5 * v, 0.5, 0.5 * load
        P[m, 0, 0], P[m, 1, 1] = 0.09 * v * v + 0.34 * var, 0.09
        P[m, 0, 1] = P[m, 1, 0] = 0.09 * v
        P[m, 2, 2] = 0.34 * load_var
    elif m == A_GAIN:
        z[m, 1], P[m, 1, 1] = 0.5, 0.09
    elif m == A_NONE:
        z[m, 1] = 0.0
    elif m == A_STUCK:
        z[m, 1], z[m, 2], P[m, 2, 2] = 0.0, 0.0, p[7] ** 2
    elif m == A_BIAS:
        z[m, 1], P[m, 1, 1] = 0.6, 0.09
        z[m, 2], P[m, 2, 2] = 0.0, (0.5 * p[7]) ** 2


@njit(cache=True)
def _predict(m, u, common, p, z, P):  # type: ignore[no-untyped-def]
    """z = F z, P = F P Fᵀ + Q of one model over one step with valve command u and common load."""
    a, dt = p[1], p[9]
    f_b, q_b = p[5], (1 - p[5] * p[5]) * p[4] ** 2
    if m == A_STUCK:
        f_b, q_b = 1.0, (0.02 * p[7]) ** 2 * dt
    elif m == A_BIAS:
        f_b = np.exp(-dt / 0.8)
        q_b = (1 - f_b * f_b) * (0.5 * p[7]) ** 2
    k_u = (1 - a) * p[0] * u
    # row of ν: [a, (1−a)K u, 1−a, 0]
    v = a * z[m, 0] + k_u * z[m, 1] + (1 - a) * (z[m, 2] + common)
    r0 = np.empty(4)
    for j in range(4):
        r0[j] = a * P[m, 0, j] + k_u * P[m, 1, j] + (1 - a) * P[m, 2, j]
    p00 = a * r0[0] + k_u * r0[1] + (1 - a) * r0[2] + p[2] ** 2 * dt * 0.05
    z[m, 0] = v
    z[m, 2] *= f_b
    P[m, 0, 0] = p00
    P[m, 0, 1] = P[m, 1, 0] = r0[1]
    P[m, 0, 2] = P[m, 2, 0] = f_b * r0[2]
    P[m, 0, 3] = P[m, 3, 0] = r0[3]
    P[m, 1, 2] = P[m, 2, 1] = f_b * P[m, 1, 2]
    P[m, 2, 2] = f_b * f_b * P[m, 2, 2] + q_b
    P[m, 2, 3] = P[m, 3, 2] = f_b * P[m, 2, 3]
    if m >= S_DRIFT and m <= S_WHITE_25:
        P[m, 3, 3] += (0.06 * p[6]) ** 2 * dt


@njit(cache=True)
def _update(m, y, p, white, z, P):  # type: ignore[no-untyped-def]
    """Kalman update of one model with the measured speed; returns the innovation's log-likelihood."""
    h0, h3, r = 1.0, 0.0, p[2] ** 2
    if m == S_STUCK:
        h0, h3, r = 0.0, 1.0, p[3] ** 2
    elif m == S_NONE:
        h0, r = 0.0, p[3] ** 2
    elif m >= S_DRIFT and m <= S_WHITE_25:
        h3, r = 1.0, r * white[m - S_DRIFT] ** 2
    # S = H P Hᵀ + R, K = P Hᵀ / S, P = P − K S Kᵀ
    g = np.empty(4)
    for i in range(4):
        g[i] = P[m, i, 0] * h0 + P[m, i, 3] * h3
    s = h0 * g[0] + h3 * g[3] + r
    innovation = y - h0 * z[m, 0] - h3 * z[m, 3]
    for i in range(4):
        z[m, i] += g[i] * innovation / s
        for j in range(4):
            P[m, i, j] -= g[i] * g[j] / s
    return -0.5 * (innovation * innovation / s + np.log(2 * np.pi * s))


@njit(cache=True)
def _advance(y, u, common, slack, status, quiet, p, white, z, P, gain):  # type: ignore[no-untyped-def]
    """One step of all models; writes each one's log-likelihood into `gain`."""
    floor = _OUTLIER - np.log(p[6])
    for m in range(MODELS):
        if slack > 0.0 and m != A_STUCK and m != A_BIAS:
            # while the wheel model is in doubt, the load is as wide as the doubt and changes within half a second
            f = np.exp(-p[9] / 0.5)
            z[m, 2] *= f
            for j in range(4):
                P[m, 2, j] *= f
                P[m, j, 2] *= f
            P[m, 2, 2] += (1 - f * f) * (slack * slack + p[4] * p[4])
        _predict(m, u, common, p, z, P)
        gain[m] = 0.0
        if status == _SILENT:
            gain[m] = 0.0 if m == S_NONE else _SILENT_COST
        elif status == _PAIR:
            gain[m] = max(_update(m, y, p, white, z, P), floor)
            if m >= S_DRIFT and m <= S_WHITE_25:
                gain[m] -= 0.05
            elif m >= S_GAIN:
                gain[m] -= 0.02
    if quiet and status == _PAIR:
        if abs(z[S_STUCK, 3]) < 3 * p[2]:
            gain[S_STUCK] = min(gain[S_STUCK], gain[HEALTHY])
        gain[S_NONE] = min(gain[S_NONE], gain[HEALTHY])


@njit(cache=True)
def _scan(y, u, common, slack, status, quiet, p, white, score, z, P, back, track):  # type: ignore[no-untyped-def]
    gain = np.zeros(MODELS)
    for k in range(y.size):
        best = 0
        for m in range(1, MODELS):
            if score[m] > score[best]:
                best = m
        top = score[best]
        if status[k] != _SKIP:
            for m in range(MODELS):
                if m == best:
                    continue
                cost = p[8]
                if m >= S_DRIFT and m <= S_WHITE_25 and best >= S_DRIFT and best <= S_WHITE_25:
                    cost = 3.0
                if m not in (HEALTHY, S_NONE, A_NONE):
                    cost += _LEARNING_COST
                if top - cost > score[m]:
                    score[m] = top - cost
                    if m not in (HEALTHY, S_NONE, A_NONE):
                        score[m] += _LEARNING_COST
                    back[k, m] = best
                    _enter(m, best, p, z, P)
        _advance(y[k], u[k], common[k], slack[k], status[k], quiet[k], p, white, z, P, gain)
        top = -1e300
        for m in range(MODELS):
            score[m] += gain[m]
            top = max(top, score[m])
        best = 0
        for m in range(MODELS):
            score[m] -= top
            if score[m] > score[best]:
                best = m
        track[0, k] = z[HEALTHY, 0]
        track[1, k] = P[HEALTHY, 0, 0]
        track[2, k] = z[best, 1]
        track[3, k] = P[best, 1, 1]
        track[4, k] = z[best, 2] if best >= A_GAIN else z[best, 3]
        track[5, k] = P[best, 2, 2] if best >= A_GAIN else P[best, 3, 3]


@njit(cache=True)
def _trace(back, last):  # type: ignore[no-untyped-def]
    n = back.shape[0]
    path = np.empty(n, dtype=np.uint8)
    entered = np.zeros(n, dtype=np.bool_)
    m = last
    for k in range(n - 1, -1, -1):
        path[k] = m
        if back[k, m] != _STAY:
            entered[k] = True
            m = back[k, m]
    return path, entered


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
        _enter(m, HEALTHY, p, z, P)
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
    back = np.full((y.size, MODELS), _STAY, dtype=np.uint8)
    track = np.zeros((6, y.size))
    score, z, P = state.score.copy(), state.mean.copy(), state.cov.copy()
    _scan(y, u, common, slack, status, quiet, model.packed(), _WHITE, score, z, P, back, track)
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
    known = np.flatnonzero(status == _PAIR)
    state = initial_state(float(y[known[0]]) if known.size else 0.0, model)
    back, track, state = forward(y, u, common, slack, status, quiet, model, state)
    path, entered = _trace(back, int(np.argmax(state.score)))
    return WheelPath(path, entered, track)


@njit(cache=True)
def _scan_evidence(y, u, common, slack, status, quiet, begin, p, white, z, P):  # type: ignore[no-untyped-def]
    """Run healthy up to `begin`, enter every model there, and sum their log-likelihoods to the end."""
    gain, out = np.zeros(MODELS), np.zeros(MODELS)
    for k in range(y.size):
        if k == begin:
            for m in range(1, MODELS):
                _enter(m, HEALTHY, p, z, P)
        _advance(y[k], u[k], common[k], slack[k], status[k], quiet[k], p, white, z, P, gain)
        if k >= begin:
            out += gain
    return out, z, P


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
    known = np.flatnonzero(status == _PAIR)
    _, z, P = start_state(float(y[known[0]]) if known.size else 0.0, p)
    return _scan_evidence(y, u, common, slack, status, quiet, begin, p, _WHITE, z, P)  # type: ignore[no-any-return]
