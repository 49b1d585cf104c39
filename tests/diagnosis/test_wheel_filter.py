"""The twelve wheel models against filterpy with their matrices written out, and faults told apart by them."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.testing import assert_allclose

from diagnosis.wheel_filter import WheelFilterModel, most_probable, segment_evidence, start_state
from diagnosis.wheel_scan import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    NAMES,
    ROW,
    S_DRIFT,
    S_GAIN,
    S_NONE,
    S_STUCK,
    S_WHITE_25,
)

MODEL = WheelFilterModel(
    K=2.4,
    tau=0.25,
    noise=0.004,
    constant_noise=0.0005,
    load=0.01,
    load_s=3.0,
    span=0.8,
    valve_span=0.15,
    switch_cost=13.0,
    dt=0.005,
)
SKIP, PAIR, SILENT = 0, 1, 2
A = np.exp(-MODEL.dt / MODEL.tau)
LIFT = MODEL.valve_span * MODEL.K
Array = np.ndarray


def valve(n: int) -> Array:
    t = np.arange(n) * MODEL.dt
    return 0.08 * np.sin(2 * np.pi * t / 5.0) + 0.04 * np.sign(np.sin(2 * np.pi * t / 1.7))


def rolled(u: Array, load: float = 0.0) -> Array:
    """τ v̇ = −v + K u + load, exact for u held over each step; u[k] is in force up to sample k."""
    v, out = 0.0, np.empty(u.size)
    for k in range(u.size):
        v = A * v + (1 - A) * (MODEL.K * u[k] + load)
        out[k] = v
    return out


def noisy(v: Array, seed: int = 1) -> Array:
    return v + MODEL.noise * np.random.default_rng(seed).normal(size=v.size)


def sensor_rows(m: int) -> tuple[list[float], float]:
    """H of [ν, g, b, c] and R: what the sensor of model m measures."""
    if m == S_STUCK:
        return [0.0, 0.0, 0.0, 1.0], MODEL.constant_noise**2
    if m == S_NONE:
        return [0.0, 0.0, 0.0, 0.0], MODEL.constant_noise**2
    if S_DRIFT <= m <= S_WHITE_25:
        return [1.0, 0.0, 0.0, 1.0], (MODEL.noise * [1.0, 3.0, 8.0, 25.0][m - S_DRIFT]) ** 2
    return [1.0, 0.0, 0.0, 0.0], MODEL.noise**2


def load_walk(m: int) -> tuple[float, float]:
    """How b of model m relaxes over one step, and what it gains."""
    if m == A_STUCK:
        return 1.0, (0.02 * LIFT) ** 2 * MODEL.dt
    tau, std = (0.8, 0.5 * LIFT) if m == A_BIAS else (MODEL.load_s, MODEL.load)
    f = np.exp(-MODEL.dt / tau)
    return f, (1 - f * f) * std**2


class Oracle:
    def __init__(self, m: int, z: Array, P: Array) -> None:
        self.m, self.kf = m, KalmanFilter(dim_x=4, dim_z=1, dim_u=1)
        self.kf.x, self.kf.P = z[m].reshape(4, 1).copy(), P[m].copy()
        h, r = sensor_rows(m)
        self.kf.H, self.kf.R = np.array([h]), np.array([[r]])

    def step(self, y: float, u: float, common: float, slack: float, status: int) -> float:
        kf, m = self.kf, self.m
        if slack > 0 and m not in (A_STUCK, A_BIAS):
            # the load becomes as wide as the doubt within half a second
            f = np.exp(-MODEL.dt / 0.5)
            kf.predict(
                F=np.diag([1, 1, f, 1]), Q=np.diag([0, 0, (1 - f * f) * (slack**2 + MODEL.load**2), 0]), u=0, B=0
            )
        f_b, q_b = load_walk(m)
        q_c = (0.06 * MODEL.span) ** 2 * MODEL.dt if S_DRIFT <= m <= S_WHITE_25 else 0.0
        inside = common if m == S_GAIN else 0.0  # in the sensor's scale, as ν is
        F = np.array(
            [[A, (1 - A) * (MODEL.K * u + inside), 1 - A, 0.0], [0, 1, 0, 0], [0, 0, f_b, 0], [0, 0, 0, 1]],
        )
        Q = np.diag([MODEL.noise**2 * MODEL.dt * 0.05, 0.0, q_b, q_c])
        kf.predict(u=np.array([[common - inside]]), B=np.array([[1 - A], [0], [0], [0]]), F=F, Q=Q)
        if status == SILENT:
            return 0.0 if m == S_NONE else -6.0
        if status == SKIP:
            return 0.0
        kf.update(y)
        gain = max(float(kf.log_likelihood), -18.0 - np.log(MODEL.span))
        return gain - (0.05 if S_DRIFT <= m <= S_WHITE_25 else 0.5 * MODEL.dt if m >= S_GAIN else 0.0)


READINGS = {
    "healthy": lambda v, r: v,
    "stuck": lambda v, r: np.full(v.size, 0.12),
    "no signal": lambda v, r: np.zeros(v.size),
    "inefficient": lambda v, r: 0.6 * v,
    "noise-affected": lambda v, r: 0.7 * v + 0.06 * r.normal(size=v.size),
}


@pytest.mark.parametrize("name", READINGS)
def test_every_model_is_filterpys(name: str) -> None:
    n = 160
    rng = np.random.default_rng(3)
    u = valve(n)
    y = noisy(READINGS[name](rolled(u), rng))
    common, slack = 0.02 * np.sin(np.arange(n) / 30), np.zeros(n)
    slack[60:90] = 0.05
    status = np.full(n, PAIR, dtype=np.int8)
    status[20:40:2] = SKIP
    status[100:110] = SILENT
    y[status != PAIR] = np.nan
    quiet = np.zeros(n, dtype=np.bool_)
    got, mean, covariance = segment_evidence(y, u, common, slack, status, quiet, 0, MODEL)
    _, z, P = start_state(float(y[0]), MODEL.packed())
    for m in range(MODELS):
        oracle = Oracle(m, z, P)
        total = sum(oracle.step(y[k], u[k], common[k], slack[k], status[k]) for k in range(n))
        assert_allclose(got[m], total, rtol=1e-9, atol=1e-9, err_msg=str(NAMES[m]))
        assert_allclose(mean[m], oracle.kf.x[:, 0], rtol=1e-9, atol=1e-11, err_msg=str(NAMES[m]))
        assert_allclose(covariance[m], oracle.kf.P, rtol=1e-9, atol=1e-14, err_msg=str(NAMES[m]))


def test_entry_carries_speed_and_load_over() -> None:
    score, z, P = start_state(0.3, MODEL.packed())
    assert np.argmax(score) == HEALTHY
    carried = (0.3, MODEL.span**2, MODEL.load**2)
    for m in range(MODELS):
        if m not in (S_GAIN, A_STUCK, A_BIAS):
            assert (z[m, 0], P[m, 0, 0], P[m, 2, 2]) == pytest.approx(carried)
        assert_allclose(P[m], P[m].T)
    assert (z[A_NONE, 1], z[A_STUCK, 1], z[HEALTHY, 1]) == (0.0, 0.0, 1.0)
    assert P[S_STUCK, 3, 3] == pytest.approx(MODEL.span**2)
    assert P[A_STUCK, 2, 2] == pytest.approx(LIFT**2)
    # a gain of 0.5 ± 0.3 scales what the sensor shows: mean, variance and covariance of g·v
    rng = np.random.default_rng(1)
    g, v = 0.5 + 0.3 * rng.normal(size=400_000), 0.3 + MODEL.span * rng.normal(size=400_000)
    assert z[S_GAIN, 0] == pytest.approx(np.mean(g * v), abs=0.005)
    assert P[S_GAIN, 0, 0] == pytest.approx(np.var(g * v), rel=0.02)
    assert P[S_GAIN, 0, 1] == pytest.approx(np.cov(g, g * v)[0, 1], abs=0.001)
    assert P[S_GAIN, 1, 1] == pytest.approx(0.09)


def test_standstill_speaks_for_no_silent_sensor() -> None:
    n = 400
    zero, still = np.zeros(n), np.ones(n, dtype=np.bool_)
    status = np.full(n, PAIR, dtype=np.int8)
    got, _, _ = segment_evidence(zero, zero, zero, zero, status, still, 0, MODEL)
    assert got[S_NONE] <= got[HEALTHY]
    assert got[S_STUCK] <= got[HEALTHY]
    path = most_probable(zero, zero, zero, zero, status, still, MODEL)
    assert (path.model == HEALTHY).all()


N, ONSET = 3000, 1500


def judged(y: Array, u: Array) -> Array:
    status = np.full(y.size, PAIR, dtype=np.int8)
    zero = np.zeros(y.size)
    return ROW[most_probable(y, u, zero, zero, status, np.zeros(y.size, dtype=np.bool_), MODEL).model]


@pytest.mark.parametrize("seed", range(3))
def test_healthy_wheel_is_healthy(seed: int) -> None:
    u = valve(N)
    assert (judged(noisy(rolled(u, load=0.008), seed), u) == ROW[HEALTHY]).all()


@pytest.mark.parametrize(
    ("model", "reading"),
    [
        (S_STUCK, lambda v, r: np.full(v.size, 0.2)),
        (S_NONE, lambda v, r: np.zeros(v.size)),
        (S_GAIN, lambda v, r: 0.5 * v),
        (S_WHITE_25, lambda v, r: 0.7 * v + 0.08 * r.normal(size=v.size)),
    ],
    ids=["stuck", "no signal", "inefficient", "noise-affected"],
)
def test_sensor_fault_is_the_sensors(model: int, reading: object) -> None:
    u = valve(N)
    v = rolled(u)
    y = noisy(v)
    y[ONSET:] = reading(v, np.random.default_rng(9))[ONSET:]  # type: ignore[operator]
    if model == S_GAIN:
        y[ONSET:] = noisy(y)[ONSET:]
    row = judged(y, u)
    assert (row[: ONSET - 2] == ROW[HEALTHY]).all()
    assert (row[ONSET + 50 :] == ROW[model]).mean() > 0.98


@pytest.mark.parametrize(
    ("model", "valve_fault"),
    [
        (A_GAIN, lambda u: 0.5 * u),
        (A_STUCK, lambda u: np.full(u.size, 0.09)),
        (A_NONE, lambda u: np.zeros(u.size)),
    ],
    ids=["inefficient", "stuck", "no control signal"],
)
def test_actuator_fault_is_the_actuators(model: int, valve_fault: object) -> None:
    u = valve(N)
    applied = u.copy()
    applied[ONSET:] = valve_fault(u)[ONSET:]  # type: ignore[operator]
    row = judged(noisy(rolled(applied)), u)
    # a bend shows after the wheel's lag, and the path may set it as much too early
    assert (row[: ONSET - round(MODEL.tau / MODEL.dt)] == ROW[HEALTHY]).all()
    assert (row[ONSET + 200 :] == ROW[model]).mean() > 0.95


def test_silence_beside_living_siblings_is_no_signal() -> None:
    u = valve(N)
    y, status = noisy(rolled(u)), np.full(N, PAIR, dtype=np.int8)
    y[1000:1400], status[1000:1400] = np.nan, SILENT
    zero = np.zeros(N)
    path = most_probable(y, u, zero, zero, status, np.zeros(N, dtype=np.bool_), MODEL)
    row = ROW[path.model]
    assert (row[1000:1400] == ROW[S_NONE]).all()
    assert (row[:1000] == ROW[HEALTHY]).all()
    assert (row[1410:] == ROW[HEALTHY]).all()
    assert path.track.shape == (6, N)
    assert np.isfinite(path.track).all()
