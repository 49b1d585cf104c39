"""One block of every steering model (compiled): entry, prediction, and the whole step with its measurements.

Every model is an extended Kalman filter on x = [φ, r, a, b, d, c]: angle φ and rate r of the axle, gain a and rate b
that a valve fault adds, gain d and offset c of the sensor:

    ṙ = (f(a·u) + b − r)/τ,  φ̇ = r (with end stops and the sensor's play),  y = d·φ + c + n,  variance of n known or learned

f is the valve's map; see `diagnosis.steering.prediction_kernel`.

A row of either table frees some of them. Blocks of samples come as their mean and the power of their white part, which
tells how much noise the sensor still shows.
"""

from __future__ import annotations

from math import isnan

from diagnosis.channels.sample_status import PAIR, SILENT
from diagnosis.steering.filter_constants import FilterConstants
from diagnosis.steering.filter_state import (
    Array,
    Block,
    FilterBank,
    RedundantBlock,
    known,
    known_covariances,
    known_states,
    resting,
)
from diagnosis.steering.measurement_kernel import measure_redundant, update
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
from diagnosis.steering.prediction_kernel import predict
from replay.arrays.compiling import njit

_SILENT_COST = -6.0


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def enter(m: int, old: int, constants: FilterConstants, bank: FilterBank) -> None:
    """Start model m from model `old`: the axle is carried over, a side that changes gets its prior."""
    bank = known(bank)
    z, P = bank.mean, bank.cov
    if m != old:
        for i in range(STATES):
            z[m, i] = z[old, i]
            for j in range(STATES):
                P[m, i, j] = P[old, i, j]
        bank.noise[m, 0], bank.noise[m, 1] = bank.noise[old, 0], bank.noise[old, 1]
        bank.gap[m, 0], bank.gap[m, 1] = bank.gap[old, 0], bank.gap[old, 1]
    fresh_s = m == old or SENSOR[m] != SENSOR[old]
    fresh_a = m == old or ACTUATOR[m] != ACTUATOR[old]
    for i in range(2, STATES):
        if (i < 4 and fresh_a) or (i >= 4 and fresh_s):
            for j in range(STATES):
                P[m, i, j] = P[m, j, i] = 0.0
            z[m, i] = 0.0
    if fresh_a:
        _enter_actuator(m, constants, z, P)
    if fresh_s:
        _enter_sensor(m, constants, bank)
        if m != old and SENSOR[old] != HEALTHY:
            # how the axle stood behind a faulty sensor was guessed by the model alone
            lost = SENSOR[old] == STUCK or SENSOR[old] == NO_SIGNAL
            P[m, 0, 0] += ((1.0 if lost else 0.2) * constants.axle.stop) ** 2
            P[m, 1, 1] += (0.3 * constants.axle.rate_limit) ** 2


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _enter_actuator(m: int, constants: FilterConstants, z: Array, P: Array) -> None:
    """Prior of a valve's gain a and rate b: 0.5 ± 0.25 of an inefficient one, 0.6 ± 0.15 of a disturbed one."""
    z, P = known_states(z), known_covariances(P)
    a, rate_limit, rate_error = ACTUATOR[m], constants.axle.rate_limit, constants.axle.rate_error
    z[m, 2] = 1.0
    P[m, 3, 3] = rate_error * rate_error
    if a == INEFFICIENT:
        z[m, 2], P[m, 2, 2] = 0.5, 0.0625
    elif a == STUCK:
        z[m, 2], P[m, 3, 3] = 0.0, rate_limit * rate_limit
    elif a == NO_SIGNAL:
        z[m, 2] = 0.0
    elif a == NOISY:
        z[m, 2], P[m, 2, 2], P[m, 3, 3] = 0.6, 0.0225, (0.6 * rate_limit) ** 2


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _enter_sensor(m: int, constants: FilterConstants, bank: FilterBank) -> None:
    """Prior of a sensor's gain d, offset c and noise: d is 0.5 ± 0.25 if inefficient, 0.65 ± 0.15 if noisy."""
    bank = known(bank)
    z, P, noise = bank.mean, bank.cov, bank.noise
    s, stop, white = SENSOR[m], constants.axle.stop, constants.sensor.white
    z[m, 4] = 1.0
    if s == STUCK:
        z[m, 4], P[m, 5, 5] = 0.0, stop * stop
    elif s == NO_SIGNAL:
        z[m, 4] = 0.0
    elif s == INEFFICIENT:
        z[m, 4], P[m, 4, 4] = 0.5, 0.0625
    elif s == NOISY:
        z[m, 4], P[m, 4, 4], P[m, 5, 5] = 0.65, 0.0225, (0.06 * stop) ** 2
        noise[m, 0], noise[m, 1] = 0.5, 50.0 * white
    elif s == COLOURED:
        z[m, 4], P[m, 4, 4], P[m, 5, 5] = 0.65, 0.0225, (0.1 * stop) ** 2
        noise[m, 0], noise[m, 1] = 0.5, 5.0 * white


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def advance(m: int, block: Block, seen: RedundantBlock, constants: FilterConstants, bank: FilterBank) -> float:
    """One block of one model: prediction, update, log-likelihood; `driven` is NaN where nobody knows the opening."""
    axle, coloured_decay, P = constants.axle, constants.sensor.coloured_decay, bank.cov
    blind = isnan(block.driven)
    predict(m, block if not blind else resting(block), axle, coloured_decay, bank)
    if blind:
        # the axle may turn either way at its full rate; without a sample to follow it, to anywhere
        P[m, 1, 1] = max(P[m, 1, 1], axle.rate_limit**2)
        reach = (axle.rate_limit * axle.dt) ** 2 + ((0.2 * axle.stop) ** 2 if block.status != PAIR else 0.0)
        P[m, 0, 0] = max(P[m, 0, 0], min(P[m, 0, 0] + reach, axle.stop**2))
    redundant = 0.0
    if constants.redundant:
        redundant = measure_redundant(m, seen, axle.gain, axle.rate_limit, bank)
    if block.status == SILENT:
        return redundant if SENSOR[m] == NO_SIGNAL else redundant + _SILENT_COST
    if block.status != PAIR:
        return redundant
    idle = ACTUATOR[m] != HEALTHY and isnan(seen.opening) and abs(block.driven) < axle.idle_rate
    measured = update(m, block, constants.idle_variance if idle else 0.0, axle, constants.sensor, bank)
    if blind:  # a free angle fits everything; a smaller gain would only seem surer of it
        return redundant
    out = redundant + measured
    if SENSOR[m] >= INEFFICIENT or ACTUATOR[m] == INEFFICIENT or ACTUATOR[m] == NOISY:
        out -= constants.freedom_cost
    return float(out)
