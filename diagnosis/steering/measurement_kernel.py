"""Measurements of one block for every steering model (compiled): the angle with its noise, and what is redundant.

The models are those of `diagnosis.steering.step_kernel`: x = [φ, r, a, b, d, c], y = d·φ + c + n.
"""

from __future__ import annotations

from math import lgamma, log, pi

import numpy as np

from diagnosis.steering.filter_constants import AxleConstants, SensorConstants
from diagnosis.steering.filter_state import (
    Array,
    Block,
    FilterBank,
    RedundantBlock,
    known,
    known_covariances,
    known_states,
)
from diagnosis.steering.model_bank import (
    ACTUATOR,
    HEALTHY,
    INEFFICIENT,
    NO_SIGNAL,
    NOISY,
    SENSOR,
    STATES,
    STUCK,
)
from replay.arrays.compiling import njit

_OUTLIER = -18.0
_LOST_S = 0.03  # how long an axle may turn unseen
_LEAST_GAIN, _MOST_GAIN = 0.1, 0.92  # of an inefficient part


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _known_noise(
    s: int, d: float, sensor: SensorConstants, nu: float, power: float, count: float
) -> tuple[float, float]:
    """Log-likelihood of the white power where the row says what it is, and the variance of the block's mean."""
    white, constant = sensor.white, sensor.constant
    if s in (STUCK, NO_SIGNAL):
        if not sensor.resolved:  # rounding hides the noise: an axle at rest reads as constant as a stuck sensor
            return -0.5 * nu * (log(white) + power / white) - sensor.rest_cost, white / count + sensor.mean_rounding
        return -0.5 * nu * (log(constant) + power / constant), constant
    if s == HEALTHY:
        return -0.5 * nu * (log(white) + power / white), white / count + sensor.mean_rounding
    # the sensor scales its noise before it rounds
    v = d * d * max(white - sensor.rounding, 0.0) + sensor.rounding
    v = max(v, constant)
    if not sensor.resolved:
        v = white
    return -0.5 * nu * (log(v) + power / v), v / count + sensor.mean_rounding


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _learned_noise(alpha: float, beta: float, nu: float, power: float) -> float:
    """Log-likelihood of the white power with V ~ inverse gamma (α, β).

    p(power) = Γ(α+ν/2)/Γ(α) · β^α/(β+ν·power/2)^(α+ν/2)
    """
    after, scaled = alpha + 0.5 * nu, beta + 0.5 * nu * power
    if alpha > 10.0:  # Γ(α+h)/Γ(α) ≈ (α + (h−1)/2)^h
        return 0.5 * nu * log((alpha + 0.25 * nu - 0.5) / scaled) + alpha * log(beta / scaled)
    return lgamma(after) - lgamma(alpha) + alpha * log(beta) - after * log(scaled)


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _learn(m: int, gain: Array, total: float, innovation: float, z: Array, P: Array) -> None:
    """x += K·innovation, P −= K·gainᵀ with K = gain/total; what a model does not free has no gain and stays."""
    g0, g1, g2, g3, g4, g5 = gain[0], gain[1], gain[2], gain[3], gain[4], gain[5]
    for i in range(STATES):
        if gain[i] == 0.0:
            continue
        share = gain[i] / total
        z[m, i] += share * innovation
        P[m, i, 0] -= share * g0
        P[m, i, 1] -= share * g1
        P[m, i, 2] -= share * g2
        P[m, i, 3] -= share * g3
        P[m, i, 4] -= share * g4
        P[m, i, 5] -= share * g5


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _white(m: int, block: Block, sensor: SensorConstants, bank: FilterBank) -> tuple[float, float, float, float, float]:
    """Degrees of freedom of a block's white power, its log-likelihood, the variance of the mean, and α and β behind it."""
    s, nu = SENSOR[m], sensor.white_dof * block.samples
    nu = nu / (1 + 0.5 * nu * sensor.white_spread)
    alpha, beta = bank.noise[m, 0], bank.noise[m, 1]
    after, scaled = alpha + 0.5 * nu, beta + 0.5 * nu * block.power
    if s >= NOISY:
        likelihood = _learned_noise(alpha, beta, nu, block.power)
        return (
            nu,
            likelihood,
            max(scaled / after, sensor.constant) / block.samples + sensor.mean_rounding,
            after,
            scaled,
        )
    likelihood, r = _known_noise(s, bank.mean[m, 4], sensor, nu, block.power, block.samples)
    return nu, likelihood, r, after, scaled


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _least_likelihood(nu: float, power: float, stop: float, constant: float) -> float:
    """Log-likelihood that a block is given which the model cannot explain."""
    return _OUTLIER - log(stop) - 0.5 * nu * (1 + log(max(power, constant)))


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def most_likely(m: int, block: Block, axle: AxleConstants, sensor: SensorConstants, bank: FilterBank) -> float:
    """The most that `update` may give a block whose model's sensor row has just been entered: as if the angle were as expected [log-likelihood].

    What the row frees is tied to nothing yet, so that its offset's variance is part of the angle's, whatever else is.
    """
    nu, likelihood, r, _, _ = _white(m, block, sensor, bank)
    likelihood -= 0.5 * log(2 * pi * (r + bank.cov[m, 5, 5]))
    return float(max(likelihood, _least_likelihood(nu, block.power, axle.stop, sensor.constant)))


@njit(cache=True, error_model="numpy", forceinline=True)
def update(m: int, block: Block, least: float, axle: AxleConstants, sensor: SensorConstants, bank: FilterBank) -> float:
    """Kalman update with a block's mean, and the evidence of mean and white power; returns the log-likelihood.

    A block that the model cannot explain costs it a fixed amount and teaches it nothing but that its constant was wrong,
    or that the axle is elsewhere, no further than it turns in some milliseconds. `least` is the smallest variance [rad²]
    that the angle is given in the likelihood.
    """
    stop = axle.stop
    bank = known(bank)
    z, P, noise, gain = bank.mean, bank.cov, bank.noise, bank.room
    s, power = SENSOR[m], block.power
    nu, likelihood, r, after, scaled = _white(m, block, sensor, bank)
    d, phi = z[m, 4], z[m, 0]
    # S = H P Hᵀ + R with H = [d, 0, 0, 0, φ, 1]
    total = r
    for i in range(STATES):
        gain[i] = P[m, i, 0] * d + P[m, i, 4] * phi + P[m, i, 5]
    total += gain[0] * d + gain[4] * phi + gain[5]
    innovation = block.mean - d * phi - z[m, 5]
    doubt = max(total, least + r) if least > 0.0 else total
    likelihood -= 0.5 * (innovation * innovation / doubt + log(2 * pi * doubt))
    floor = _least_likelihood(nu, power, stop, sensor.constant)
    if likelihood < floor:
        if s == STUCK:
            _forget(m, np.int64(5), stop, z, P)
        elif s == HEALTHY:
            P[m, 0, 0] += min(innovation * innovation, (axle.rate_limit * _LOST_S) ** 2)
        return float(floor)
    noise[m, 0], noise[m, 1] = after, scaled
    _learn(m, gain, total, innovation, z, P)
    if s == INEFFICIENT:
        _learn_sensor_gain(m, nu, power, sensor, z, P, gain)
        z[m, 4] = min(max(z[m, 4], _LEAST_GAIN), _MOST_GAIN)
    if ACTUATOR[m] == INEFFICIENT or ACTUATOR[m] == NOISY:
        z[m, 2] = min(max(z[m, 2], _LEAST_GAIN), _MOST_GAIN)
    return float(likelihood)


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _learn_sensor_gain(
    m: int, nu: float, power: float, sensor: SensorConstants, z: Array, P: Array, gain: Array
) -> None:
    """Kalman update of the sensor's gain d: it scales the noise too, so that √((power − rounding)/σ²) measures d."""
    if not sensor.resolved:
        return
    z, P = known_states(z), known_covariances(P)
    seen = (max(power - sensor.rounding, 0.0) / max(sensor.white - sensor.rounding, 1e-30)) ** 0.5
    var = (0.5 / nu + 0.25 * sensor.white_spread) * (seen * seen + 0.05)
    for i in range(STATES):
        gain[i] = P[m, i, 4]
    total = gain[4] + var
    innovation = seen - z[m, 4]
    for i in range(STATES):
        z[m, i] += gain[i] * innovation / total
        for j in range(STATES):
            P[m, i, j] -= gain[i] * gain[j] / total


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _forget(m: int, i: int, std: float, z: Array, P: Array) -> None:
    """Give the constant x_i its prior again: it was learned from a block that a fault entered halfway."""
    z, P = known_states(z), known_covariances(P)
    for j in range(STATES):
        P[m, i, j] = P[m, j, i] = 0.0
    P[m, i, i] = std * std


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def measure_redundant(m: int, seen: RedundantBlock, g: float, rate_limit: float, bank: FilterBank) -> float:
    """Update with the second angle, the valve's opening and its share of the command; returns the log-likelihood."""
    bank = known(bank)
    z, P = bank.mean, bank.cov
    a = ACTUATOR[m]
    likelihood = 0.0
    if not np.isnan(seen.angle):
        innovation = seen.angle - z[m, 0] - bank.gap[m, 0]
        likelihood += _linear(m, 1.0, 0.0, 0.0, innovation, seen.angle_variance + bank.gap[m, 1], z, P, bank.room)
    if not np.isnan(seen.opening):
        expected = seen.command if a == HEALTHY else 0.0
        by_a = by_b = 0.0
        if a != HEALTHY and a != NO_SIGNAL:
            if a != STUCK:
                by_a = seen.command
                expected += z[m, 2] * seen.command
            if a != INEFFICIENT:
                by_b = 1 / g
                expected += z[m, 3] / g
        one = _linear(m, 0.0, by_a, by_b, seen.opening - expected, seen.opening_variance, z, P, bank.room)
        if one == _OUTLIER and a == STUCK:
            _forget(m, np.int64(3), rate_limit, z, bank.cov)
        likelihood += one
    if not np.isnan(seen.share):
        expected = 1.0 if a == HEALTHY else 0.0
        by_a = 0.0
        if a in (INEFFICIENT, NOISY):
            by_a, expected = 1.0, z[m, 2]
        likelihood += _linear(m, 0.0, by_a, 0.0, seen.share - expected, seen.share_variance, z, P, bank.room)
    if a in (INEFFICIENT, NOISY):
        z[m, 2] = min(max(z[m, 2], _LEAST_GAIN), _MOST_GAIN)
    return float(likelihood)


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _linear(
    m: int, h0: float, h2: float, h3: float, innovation: float, r: float, z: Array, P: Array, gain: Array
) -> float:
    """Kalman update with one measurement of φ, a and b alone; an outlier teaches nothing. Returns the log-likelihood."""
    if h0 == 0.0 and h2 == 0.0 and h3 == 0.0:
        likelihood = -0.5 * (innovation * innovation / r)
        return _OUTLIER if likelihood < _OUTLIER else likelihood
    z, P = known_states(z), known_covariances(P)
    total = r
    for i in range(STATES):
        gain[i] = P[m, i, 0] * h0 + P[m, i, 2] * h2 + P[m, i, 3] * h3
    total += h0 * gain[0]
    total += h3 * gain[3]
    total += h2 * gain[2]
    # relative to what the measurement's own noise gives
    likelihood = -0.5 * (innovation * innovation / total + log(total / r))
    if likelihood < _OUTLIER:
        return _OUTLIER
    _learn(m, gain, total, innovation, z, P)
    return float(likelihood)
