"""Every steering model against filterpy's extended Kalman filter with its matrices written out."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter
from numpy.testing import assert_allclose

from diagnosis.channels.sample_status import PAIR
from diagnosis.steering.blocks import SensorNoise
from diagnosis.steering.filter_state import Block, RedundantBlock
from diagnosis.steering.measurement_kernel import update
from diagnosis.steering.model_bank import (
    ACTUATOR,
    COLOURED,
    HEALTHY,
    INEFFICIENT,
    MODELS,
    NO_SIGNAL,
    NOISY,
    SENSOR,
    STUCK,
)
from diagnosis.steering.models import SteeringModel
from diagnosis.steering.path import start_states
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.prediction_kernel import predict
from diagnosis.steering.valve_map import ValveMap, expected_rate, rate_at
from tests.diagnosis.steering.kernels import advance

VALVE = ValveMap(4.0, 4.4, 0.01, 0.012, 0.25, 0.24)
MODEL = SteeringModel(
    plant=SteeringPlant(VALVE, 0.05, 0.0, 1e-4 * np.eye(8), 0.01, 50, (-0.1, 0.1)),
    noise=SensorNoise(white=2.6e-7, spread=0.01, step=1.33e-8, lsb=4e-4),
    stop=0.785,
    rate_error=2e-3,
    count=10.0,
    dt=0.01,
    redundant=False,
    idle_rate=1e-3,
    stops=(-0.785, 0.785),
)
DT, LAG, GAIN, RATE, STOP = 0.01, 0.05, VALVE.gain, 0.25, 0.785
SPREAD = 2e-3
FADE = np.exp(-DT / LAG)
K_R = LAG * (1 - FADE)
K_F = DT - K_R
NOTHING = RedundantBlock(*[np.nan] * 7)
PACE = 0.8  # while the machine stands


def force(m: int, x: np.ndarray, P: np.ndarray, u: float, driven: float) -> tuple[float, float, float]:
    """What drives the rate, and its derivatives by a and b."""
    if ACTUATOR[m] == HEALTHY:
        return driven + x[3], 0.0, 1.0
    f, by_a = x[3], 0.0
    if ACTUATOR[m] == NOISY:
        h = np.array([0, 0, u, 1 / GAIN, 0, 0])
        f, slope = expected_rate(float(h @ x), float(np.sqrt(h @ P @ h)), VALVE)
        return PACE * f, PACE * slope * u, PACE * slope / GAIN
    if ACTUATOR[m] == INEFFICIENT:
        rate, slope = expected_rate(x[2] * u, abs(u) * P[2, 2] ** 0.5, VALVE)
        f, by_a = f + PACE * rate, PACE * slope * u
    return (f, by_a, 1.0) if abs(f) <= RATE else (np.sign(f) * RATE, 0.0, 0.0)


def process_noise(m: int, driven: float, f: float, r: float) -> tuple[np.ndarray, np.ndarray]:
    """Decay of each state over a block, and Q."""
    decay, q = np.ones(6), np.zeros(6)
    q[0] = (0.1 * MODEL.rate_error * DT) ** 2
    q[1] = (MODEL.constants().axle.lag_error * (1 - FADE) * (f - r)) ** 2
    a, s = ACTUATOR[m], SENSOR[m]
    if a in (HEALTHY, INEFFICIENT, NO_SIGNAL):
        share = SPREAD if a == HEALTHY or driven == 0 else SPREAD * min(abs(f / driven), 1.0)
        decay[3] = np.exp(-DT)
        q[3] = (1 - decay[3] ** 2) * (MODEL.rate_error**2 + share**2)
    elif a == STUCK:
        q[3] = (0.02 * RATE) ** 2 * DT
    else:
        decay[3] = np.exp(-DT / 0.8)
        q[3] = (1 - decay[3] ** 2) * (0.6 * RATE) ** 2
    if s == NOISY:
        q[5] = (0.02 * STOP) ** 2 * DT
    elif s == COLOURED:
        decay[5] = np.exp(-DT / 0.08)
        q[5] = (1 - decay[5] ** 2) * (0.1 * STOP) ** 2
    return decay, np.diag(q)


@pytest.mark.parametrize("m", [m for m in range(MODELS) if SENSOR[m] in (HEALTHY, STUCK, NO_SIGNAL)])
def test_model_is_filterpys_extended_kalman_filter(m: int) -> None:
    rng = np.random.default_rng(m)
    constants = MODEL.constants()
    _, bank = start_states(0.1, constants)
    z, P = bank.mean, bank.cov
    P[m, 0, 0] = 1e-4
    kf = ExtendedKalmanFilter(dim_x=6, dim_z=1)
    kf.x, kf.P = z[m].reshape(6, 1).copy(), P[m].copy()
    dead = SENSOR[m] in (STUCK, NO_SIGNAL)
    sensor = constants.sensor
    r = sensor.constant if dead else MODEL.noise.white / 10 + sensor.mean_rounding
    kf.R = np.array([[r]])
    for k in range(60):
        u = 0.04 * np.sin(k / 9.0)
        driven = PACE * rate_at(u, VALVE)
        x = kf.x[:, 0].copy()
        f, by_a, by_b = force(m, x, kf.P, u, driven)
        decay, q = process_noise(m, driven, f, x[1])
        F = np.diag(decay)
        F[0, :4] = [1.0, K_R, K_F * by_a, K_F * by_b]
        F[1, :4] = [0.0, FADE, (1 - FADE) * by_a, (1 - FADE) * by_b]
        after = decay * x
        after[0] = x[0] + K_R * x[1] + K_F * f
        after[1] = FADE * x[1] + (1 - FADE) * f
        y = after[0] + 1e-4 * rng.normal() if not dead else 0.05 * (SENSOR[m] == STUCK)
        kf.x = after.reshape(6, 1)
        kf.P = F @ kf.P @ F.T + q
        kf.update(
            np.array([[y]]),
            HJacobian=lambda x: np.array([[x[4, 0], 0, 0, 0, x[0, 0], 1.0]]),
            Hx=lambda x: np.array([[x[4, 0] * x[0, 0] + x[5, 0]]]),
        )
        if ACTUATOR[m] in (INEFFICIENT, NOISY):
            kf.x[2, 0] = min(max(kf.x[2, 0], 0.1), 0.92)
        block = Block(y, 2.6e-7 if not dead else 0.0, 10.0, driven, SPREAD, u, PACE, np.int8(PAIR))
        advance(m, block, NOTHING, constants, bank)
        assert_allclose(z[m], kf.x[:, 0], atol=1e-9, rtol=1e-9)
        assert_allclose(P[m], kf.P, atol=1e-9, rtol=1e-7)


def test_an_end_stop_holds_the_axle() -> None:
    constants = MODEL.constants()
    _, bank = start_states(0.7, constants)
    m = int(np.flatnonzero((ACTUATOR == STUCK) & (SENSOR == HEALTHY))[0])
    bank.mean[m, 3] = RATE
    for _ in range(100):
        predict(
            m, Block(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, PAIR), constants.axle, constants.sensor.coloured_decay, bank
        )
    assert bank.mean[m, 0] == pytest.approx(STOP)
    assert bank.mean[m, 1] == 0.0


def test_a_block_that_no_model_explains_teaches_nothing() -> None:
    constants = MODEL.constants()
    _, bank = start_states(0.1, constants)
    bank.cov[0, 0, 0], before = 1e-8, bank.mean[0].copy()

    def likelihood(angle: float) -> float:
        block = Block(angle, 2.6e-7, 10.0, 0.0, 0.0, 0.0, 1.0, PAIR)
        return float(update(0, block, 0.0, constants.axle, constants.sensor, bank))

    far = likelihood(0.6)
    assert_allclose(bank.mean[0], before)
    assert far < likelihood(0.1) - 18
