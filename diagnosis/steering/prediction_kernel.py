"""Prediction of one block for every steering model (compiled): valve map, lag, cylinder, play of the sensor, end stops.

The models are those of `diagnosis.steering.step_kernel`: x = [φ, r, a, b, d, c], where φ is the angle that the sensor's
shaft has. With a play of ±h the cylinder is ahead of it by a gap of at most h, which a reversal has to cross first.
"""

from __future__ import annotations

from math import exp

import numpy as np

from diagnosis.steering.filter_constants import AxleConstants
from diagnosis.steering.filter_state import Array, Block, FilterBank, known, known_covariances, known_states
from diagnosis.steering.model_bank import (
    ACTUATOR,
    COLOURED,
    HEALTHY,
    INEFFICIENT,
    NO_SIGNAL,
    NOISY,
    SENSOR,
    STATES,
    STUCK,
)
from diagnosis.steering.valve_map import expected_rate
from replay.arrays.compiling import njit

_CROSSING = 0.1  # of the gap that a model crosses: its standard deviation


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _drive(m: int, block: Block, axle: AxleConstants, bank: FilterBank) -> tuple[float, float, float]:
    """Rate that model m drives the axle to [rad/s], and its derivatives by a and b.

    b of a disturbed valve is gain × opening, as is that of a stuck one whose opening is measured; else b is a rate.
    """
    z, a = bank.mean, ACTUATOR[m]
    error = z[m, 3]
    if a == HEALTHY:
        return block.driven + error, 0.0, 1.0
    f, by_a = error, 0.0
    if a == INEFFICIENT:
        std = abs(block.u) * max(bank.cov[m, 2, 2], 0.0) ** 0.5
        rate, slope = expected_rate(z[m, 2] * block.u, std, axle.valve)
        f += block.pace * rate
        by_a = block.pace * slope * block.u
    elif a == NOISY or (a == STUCK and axle.opening_measured):
        P, by_opening = bank.cov, 1.0 / axle.gain
        variance = P[m, 2, 2] * block.u**2 + 2.0 * P[m, 2, 3] * block.u * by_opening + P[m, 3, 3] * by_opening**2
        f, slope = expected_rate(z[m, 2] * block.u + error * by_opening, max(variance, 0.0) ** 0.5, axle.valve)
        slope *= block.pace
        return block.pace * f, slope * block.u, slope * by_opening
    if abs(f) > axle.rate_limit:
        return (axle.rate_limit if f > 0 else -axle.rate_limit), 0.0, 0.0
    return f, by_a, 1.0


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _turn(m: int, move: float, driven: float, axle: AxleConstants, bank: FilterBank) -> float:
    """Turn the cylinder by `move`; returns the share of it that the sensor's shaft follows."""
    h = axle.play
    if h <= 0.0:
        bank.mean[m, 0] += move
        return 1.0
    gap, variance = bank.gap[m, 0], bank.gap[m, 1]
    ahead = gap + move
    after = min(max(ahead, -h), h)
    followed = ahead - after
    crossed = abs(move - followed)
    bank.gap[m, 0] = after
    bank.mean[m, 0] += followed
    # a gap that is not known well shows once the axle turns, not while noise moves it to and fro; it may change unseen
    left = variance if abs(driven) < axle.idle_rate else variance * exp(-abs(move) / h)
    bank.cov[m, 0, 0] += variance - left + _CROSSING**2 * h * crossed
    error = bank.cov[m, 3, 3]
    unseen = 2.0 * error * axle.rate_error_s * axle.dt if bank.mean[m, 1] ** 2 < 9.0 * error else 0.0
    bank.gap[m, 1] = min(left + unseen, h * h)
    return followed / move if move != 0.0 else (1.0 if abs(after) >= h else 0.0)


@njit(cache=True, error_model="numpy", forceinline=True)
def predict(m: int, block: Block, axle: AxleConstants, coloured_decay: float, bank: FilterBank) -> None:
    """x = f(x, u), P = F P Fᵀ + Q over one block.

    Angles in rad, openings in fractions; `coloured_decay` is the factor per block of coloured noise [1].
    """
    bank = known(bank)
    z, P = bank.mean, bank.cov
    dt, fade, lift = axle.dt, axle.rate_decay, axle.rate_limit
    f, by_a, by_b = _drive(m, block, axle, bank)
    # r' = fade·r + (1 − fade)·f,  φ' = φ + τ(1 − fade)·r + (dt − τ(1 − fade))·f
    k_r = axle.lag * (1 - fade)
    k_f = dt - k_r
    r = z[m, 1]
    share = _turn(m, k_r * r + k_f * f, block.driven, axle, bank)
    k_r, k_f = share * k_r, share * k_f
    z[m, 1] = fade * r + (1 - fade) * f
    late = axle.lag_error * (1 - fade) * (f - r)
    for j in range(STATES):
        force = by_a * P[m, 2, j] + by_b * P[m, 3, j]
        p0 = P[m, 0, j] + k_r * P[m, 1, j] + k_f * force
        P[m, 1, j] = fade * P[m, 1, j] + (1 - fade) * force
        P[m, 0, j] = p0
    for i in range(STATES):
        force = by_a * P[m, i, 2] + by_b * P[m, i, 3]
        p0 = P[m, i, 0] + k_r * P[m, i, 1] + k_f * force
        P[m, i, 1] = fade * P[m, i, 1] + (1 - fade) * force
        P[m, i, 0] = p0
    P[m, 0, 0] += axle.angle_variance
    P[m, 1, 1] += late * late
    spread = block.spread
    if ACTUATOR[m] != HEALTHY and block.driven != 0.0:
        # the map is known to a share of the rate: a valve that gives none errs by none
        spread *= min(abs(f / block.driven), 1.0)
    _drift(m, spread, axle, coloured_decay, z, P)
    if z[m, 0] > axle.stop_up or z[m, 0] < axle.stop_down:
        # an end stop holds the axle
        z[m, 0], z[m, 1] = (axle.stop_up if z[m, 0] > 0 else axle.stop_down), 0.0
        for j in range(STATES):
            P[m, 0, j] = P[m, j, 0] = P[m, 1, j] = P[m, j, 1] = 0.0
        P[m, 0, 0], P[m, 1, 1] = axle.stop_variance, (0.02 * lift) ** 2


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _drift(m: int, spread: float, axle: AxleConstants, coloured_decay: float, z: Array, P: Array) -> None:
    """One block of the added rate b and of the sensor's offset c, which change by themselves."""
    a = ACTUATOR[m]
    error = axle.rate_error * axle.rate_error
    if a in (HEALTHY, INEFFICIENT, NO_SIGNAL):
        f_b = axle.rate_error_decay
        q_b = (1 - f_b * f_b) * (error + spread * spread)
    elif a == STUCK:
        f_b, q_b = 1.0, (0.02 * axle.rate_limit) ** 2 * axle.dt
    else:
        f_b = axle.disturbance_decay
        q_b = (1 - f_b * f_b) * (0.6 * axle.rate_limit) ** 2
    if axle.opening_measured and a in (STUCK, NOISY):  # b has no room for the rate's error
        P[m, 0, 0] += 2.0 * (error + spread * spread) * axle.rate_error_s * axle.dt
    _relax(m, np.int64(3), f_b, q_b, z, P)
    if SENSOR[m] == NOISY:
        P[m, 5, 5] += (0.02 * axle.stop) ** 2 * axle.dt
    elif SENSOR[m] == COLOURED:
        f_c = coloured_decay
        _relax(m, np.int64(5), f_c, (1 - f_c * f_c) * (0.1 * axle.stop) ** 2, z, P)


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _relax(m: int, i: int, f: float, q: float, z: Array, P: Array) -> None:
    """One step of x_i' = f·x_i + noise of variance q."""
    z, P = known_states(z), known_covariances(P)
    z[m, i] *= f
    for k in range(STATES):
        P[m, i, k] *= f
    for k in range(STATES):
        P[m, k, i] *= f
    P[m, i, i] += q
