"""The wheel models against filterpy, stepped block by block with matrices from the physics; entries."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.testing import assert_allclose
from scipy.linalg import expm
from scipy.stats import gamma

from diagnosis.results.fault_rows import FAULT_ROWS
from diagnosis.wheels.entry_kernel import enter
from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    NOISY_SENSOR,
    ODD,
    ROW_OF_MODEL,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_OU_SMALL,
    S_STUCK,
    S_WHITE_3,
    S_WHITE_8,
    S_WHITE_24,
    TOTAL_SENSOR,
    WheelConstants,
    WheelFilterModel,
)
from diagnosis.wheels.step_kernel import WheelInput, correct, least_steps, predict
from replay.faults import FaultMode, Side

MODEL = WheelFilterModel(
    K=2.4,
    tau=0.25,
    noise=0.004,
    constant_noise=0.0005,
    rounding=0.0003,
    load=0.02,
    span=0.8,
    valve_span=0.15,
    grip=2.2,
    offset=-0.01,
)
DT, RAW, BLOCKS = 0.01, 0.001, 45
LIFT = MODEL.valve_span * MODEL.K
WHITE = {S_WHITE_3: 3.0, S_WHITE_8: 8.0, S_WHITE_24: 24.0}
COLOURED = {S_OU_SMALL: 0.05 * MODEL.span, S_OU_LARGE: 0.12 * MODEL.span}
SCALED = (S_GAIN, *WHITE, *COLOURED)
Array = np.ndarray


@cache
def lag(rate: float) -> tuple[float, float]:
    """State and input factor of ẋ = −rate·x + rate·w over one block with w held."""
    step = expm(np.array([[-rate, rate], [0.0, 0.0]]) * DT)
    return step[0, 0], step[0, 1]


def fed(m: int, x: Array, q: WheelInput) -> tuple[float, float]:
    """Opening as fed, and what the pump feeds of the fault's own flow."""
    if m in (A_GAIN, A_BIAS):
        drive = np.interp(x[1], [0.0, 0.5, 1.0], [q.drive_none, q.drive_half, q.drive])
        return drive, q.share_some if m == A_BIAS else q.share_none
    taken = min(abs(x[3]) / (0.15 * MODEL.K), 2.0) if m == A_STUCK else 0.0
    return q.drive, q.share_none + (q.share_some - q.share_none) * taken


def tyre(
    speed: float, q: WheelInput, most: float, load: float = MODEL.load, shown: float = np.nan
) -> tuple[float, float, float, float, float]:
    """Factors of ν and of what drives it, constant load, slope of the load in x, and whether the tyre holds.

    `load` is the load's standard deviation, `shown` ν as its sensor scales it: measured beyond it on the side to which the
    valve may drive faster than anyone saw, the load is as uncertain as that.
    """
    if np.isnan(q.body) or most == 0.0:
        a, b = lag(1 / MODEL.tau)
        force, held = 0.0, 0.0
    elif abs(MODEL.grip * (q.body - speed)) <= most:
        # τ ν̇ = −ν + w + grip·(body − ν)
        a, b = lag((1 + MODEL.grip) / MODEL.tau)
        b /= 1 + MODEL.grip
        force, held = MODEL.grip * q.body, MODEL.grip * (q.body - speed)
    else:
        a, b = lag(1 / MODEL.tau)
        force = held = most * np.sign(q.body - speed)
    faster = q.unseen if np.sign(q.y - shown) == np.sign(q.unseen) else 0.0
    spread = float(np.linalg.norm([load, 0.3 * held, min(MODEL.grip * q.doubt, most), faster]))
    return a, b, force + MODEL.offset, spread * (-1 if held < 0 else 1), held


class Oracle:
    """One model as filterpy's filter of [ν, g, x, c]."""

    def __init__(self, m: int, z: Array, P: Array, most: float) -> None:
        self.m, self.most, self.share = m, most, 0.0
        self.kf = KalmanFilter(dim_x=4, dim_z=1, dim_u=1)
        self.kf.x, self.kf.P = z.reshape(4, 1).copy(), P.copy()

    def predict(self, q: WheelInput) -> None:
        m, x = self.m, self.kf.x[:, 0]
        scale = max(x[1], 0.1) if m in SCALED else 1.0
        drive, self.share = fed(m, x, q)
        a, b, load, slope, _ = tyre(x[0] / scale, q, self.most, MODEL.load * (4.0 if m == ODD else 1.0), x[0])
        F, G = np.diag([a, 1.0, np.exp(-DT / MODEL.load_s), 1.0]), 0.0
        F[0, 2] = b * slope * scale
        if m in SCALED:
            F[0, 1] = b * (MODEL.K * drive + load)
        elif m >= A_GAIN:
            F[0, 1], F[0, 3], G = b * MODEL.K * drive, b * self.share, b * load
        else:
            G = b * (MODEL.K * drive + load)
        keep, walk = 1.0, 0.0
        if m == A_BIAS:
            keep = np.exp(-DT / 0.8)
            walk = (1 - keep**2) * (0.5 * LIFT) ** 2
        elif m == A_STUCK:
            walk = (0.02 * LIFT) ** 2 * DT
        elif m in COLOURED:
            keep = np.exp(-DT / 0.05)
            walk = (1 - keep**2) * COLOURED[m] ** 2
        elif m in WHITE:
            walk = (0.05 * MODEL.span) ** 2 * DT
        F[3, 3] = keep
        Q = np.diag([MODEL.drift**2 * DT + q.wander**2, 0.0, 1 - np.exp(-2 * DT / MODEL.load_s), walk])
        self.kf.predict(u=np.array([[G]]), B=np.array([[1.0], [0], [0], [0]]), F=F, Q=Q)

    def white(self) -> tuple[list[float], float, float]:
        """H, variance of one sample's noise, and of its steps."""
        m, own = self.m, MODEL.noise**2
        if m in (S_STUCK, S_NONE):
            constant = MODEL.constant_noise**2
            return [0.0, 0.0, 0.0, float(m == S_STUCK)], constant, constant
        if m == S_GAIN:
            scaled = own * float(np.clip(self.kf.x[1, 0], 0.1, 1.0)) ** 2 + MODEL.rounding**2
            return [1.0, 0.0, 0.0, 0.0], scaled, scaled
        if m in WHITE:
            return [1.0, 0.0, 0.0, 1.0], WHITE[m] ** 2 * own, WHITE[m] ** 2 * own
        if m in COLOURED:  # a step of the coloured part: 2σ²(1 − e^{−dt/τ}) ≈ 2σ²·dt/τ
            return [1.0, 0.0, 0.0, 1.0], own, own + COLOURED[m] ** 2 * RAW / 0.05
        return [1.0, 0.0, 0.0, 0.0], own, own

    def correct(self, q: WheelInput) -> float:
        h, one, _ = self.white()
        R = one / q.samples + 1e-12 + (q.chatter * self.share) ** 2 * (h[0] > 0)
        self.kf.update(q.y, R=np.array([[R]]), H=np.array([h]))
        return float(self.kf.log_likelihood)


def entered(m: int, most: float) -> tuple[Array, Array, WheelConstants]:
    """All models entered from a healthy wheel at 0.2 m/s."""
    k = replace(MODEL, grip_most=most).constants(DT, RAW)
    z, P = np.zeros((MODELS, 4)), np.zeros((MODELS, 4, 4))
    z[0], P[0, 0, 0], P[0, 2, 2] = [0.2, 1.0, 0.1, 0.0], 1e-4, 0.8
    if m:
        enter(m, HEALTHY, k, z, P)
    return z, P, k


def block(n: int, body: float, samples: float = 1.0) -> WheelInput:
    """A wheel under a moving valve, at a pump that feeds four fifths."""
    rng = np.random.default_rng(n)
    x = 0.09 * np.sin(n / 7) + 0.05
    return WheelInput(
        y=0.2 + 0.08 * np.sin(n / 9) + 0.01 * rng.normal(),
        samples=samples,
        jitter=3.1e-5,
        white=1.0,
        slack=0.0,
        habit=np.int8(0),
        drive=0.8 * x,
        drive_half=0.9 * x,
        drive_none=0.95 * x,
        share_none=0.95,
        share_some=0.85,
        chatter=0.002 * (n % 3),
        wander=0.001 * (n % 2),
        body=body + 0.01 * np.sin(n / 5),
        doubt=0.01 * (n % 4),
        unseen=(0.0, 0.15, -0.1)[n % 3],
    )


# no body, a tyre that holds, one that slides, one that does either
REGIMES = {"air": (np.nan, 0.1), "free": (0.2, 0.0), "held": (0.22, 50.0), "slides": (0.9, 0.05), "both": (0.2, 0.1)}


@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize("m", range(MODELS))
def test_every_model_is_filterpys(m: int, regime: str) -> None:
    body, most = REGIMES[regime]
    z, P, k = entered(m, most)
    oracle = Oracle(m, z[m], P[m], most)
    for n in range(BLOCKS):
        q = block(n, body)
        oracle.predict(q)
        share = predict(m, q, k, z, P)
        assert_allclose(share, oracle.share, rtol=1e-12)
        if n % 7 != 3 and not 20 <= n < 30:  # the others have no new sample
            assert_allclose(
                correct(m, q, share, k, z, P, np.log(least_steps(q, k))), oracle.correct(q), rtol=1e-9, atol=1e-9
            )
        assert_allclose(z[m], oracle.kf.x[:, 0], rtol=1e-9, atol=1e-11)
        assert_allclose(P[m], oracle.kf.P, rtol=1e-9, atol=1e-13)


def test_regimes_are_what_they_say() -> None:
    speeds = 0.2 + 0.08 * np.sin(np.arange(BLOCKS) / 9)
    held = {
        name: [abs(tyre(v, block(n, body), most)[4]) for n, v in enumerate(speeds)]
        for name, (body, most) in REGIMES.items()
    }
    assert max(held["air"]) == max(held["free"]) == 0.0
    assert max(held["held"]) < 50.0
    assert min(held["slides"]) == 0.05
    assert 0.2 < np.mean(np.array(held["both"]) == 0.1) < 0.8


@pytest.mark.parametrize("m", range(MODELS))
def test_steps_speak_by_their_distribution(m: int) -> None:
    """Between two models: −½f(J/σ² + ln σ²), as the mean square of f steps is distributed."""
    samples = 9.0
    q = block(3, np.nan, samples)
    freedom = 2 * samples / 3

    def spoken(model: int) -> tuple[float, float]:
        z, P, k = entered(model, 0.0)
        oracle = Oracle(model, z[model], P[model], 0.0)
        steps = oracle.white()[2]
        mean = oracle.correct(q)
        density = gamma.logpdf(0.5 * q.jitter, freedom / 2, scale=2 * steps / freedom)
        return correct(model, q, 0.0, k, z, P, np.log(least_steps(q, k))) - mean, float(density)

    (got, density), (healthy, reference) = spoken(m), spoken(HEALTHY)
    most = -0.5 * freedom * (1 + np.log(0.5 * q.jitter))
    assert got == pytest.approx(max(healthy + density - reference, most - 25.0), abs=1e-9)


def test_steps_of_a_single_sample_say_nothing() -> None:
    for jitter in (0.0, 1.0):
        z, P, k = entered(0, 0.0)
        oracle = Oracle(0, z[0], P[0], 0.0)
        q = block(3, np.nan)._replace(jitter=jitter, chatter=0.0)
        assert correct(0, q, 1.0, k, z, P, np.log(least_steps(q, k))) == pytest.approx(oracle.correct(q), abs=1e-9)


def test_steps_of_a_constant_channel_are_no_surer_than_its_rounding() -> None:
    """A stuck sensor's steps are 0: what its own model gains by that is limited by what rounding leaves."""
    got = {}
    for m in (HEALTHY, S_STUCK):
        z, P, k = entered(m, 0.0)
        oracle = Oracle(m, z[m], P[m], 0.0)
        q = block(3, np.nan, 10.0)._replace(jitter=0.0, chatter=0.0)
        got[m] = correct(m, q, 1.0, k, z, P, np.log(least_steps(q, k))) - oracle.correct(q)
    most = -0.5 * (20 / 3) * (1 + np.log(MODEL.constant_noise**2))
    assert got[S_STUCK] == pytest.approx(-0.5 * (20 / 3) * np.log(MODEL.constant_noise**2))
    assert got[HEALTHY] == pytest.approx(max(-0.5 * (20 / 3) * np.log(MODEL.noise**2), most - 25.0))


@pytest.mark.parametrize("old", [HEALTHY, ODD, S_GAIN, S_STUCK, A_GAIN])
@pytest.mark.parametrize("m", range(MODELS))
def test_entry_carries_speed_and_load_over(m: int, old: int) -> None:
    if m == old:
        return
    k = MODEL.constants(DT, RAW)
    z, P = np.full((MODELS, 4), 9.0), np.full((MODELS, 4, 4), 9.0)
    gain, gain_var = (0.5, 0.01) if old == S_GAIN else (1.0, 0.0)
    z[old], P[old] = [0.3 * gain, gain, 0.4, 0.0], np.diag([1e-4, gain_var, 0.2, 0.0])
    enter(m, old, k, z, P)
    # ν = g·v of a sensor that scales it; a stuck one leaves the speed to the model alone
    var = 1e-4 / gain**2 + 0.3**2 * gain_var / gain**2 + (0.05 * MODEL.span) ** 2 * (old == S_STUCK)
    assert_allclose(P[m], P[m].T)
    assert np.linalg.eigvalsh(P[m]).min() > -1e-15
    # the load itself is carried over: in units of one four times as large it is a quarter
    load = 0.4 * (4.0 if old == ODD else 1.0) / (4.0 if m == ODD else 1.0)
    known = old in (HEALTHY, ODD) or m == ODD
    assert (z[m, 2], P[m, 2, 2]) == pytest.approx((load, 0.2 if known else 0.5))
    if m not in SCALED:
        assert (z[m, 0], P[m, 0, 0]) == pytest.approx((0.3, var))
        return
    # a gain of its own scales what the sensor shows: mean, variance and covariance of g·v
    rng = np.random.default_rng(1)
    g_mean, g_std = (0.5, 0.3) if m == S_GAIN else (0.65, 0.2)
    g, v = g_mean + g_std * rng.normal(size=200_000), 0.3 + np.sqrt(var) * rng.normal(size=200_000)
    assert (z[m, 0], z[m, 1]) == pytest.approx((g_mean * 0.3, g_mean))
    assert P[m, 1, 1] == pytest.approx(g_std**2)
    assert P[m, 0, 0] == pytest.approx(np.var(g * v), rel=0.02)
    assert P[m, 0, 1] == pytest.approx(np.cov(g, g * v)[0, 1], rel=0.02)


def test_entry_gives_each_row_its_unknowns() -> None:
    k = MODEL.constants(DT, RAW)
    z, P = np.zeros((MODELS, 4)), np.zeros((MODELS, 4, 4))
    z[0], P[0, 0, 0], P[0, 2, 2] = [0.3, 1.0, 0.0, 0.0], 1e-4, 1.0
    for m in range(1, MODELS):
        enter(m, HEALTHY, k, z, P)
    assert_allclose(z[[S_STUCK, S_NONE, A_GAIN, A_STUCK, A_NONE], 1], [1.0, 1.0, 0.5, 0.0, 0.0])
    assert_allclose(z[:, 3], 0.0)
    stuck = np.sqrt(P[:, 3, 3])
    assert_allclose(stuck[[S_STUCK, A_STUCK, A_BIAS]], [MODEL.span, LIFT, 0.5 * LIFT])
    assert_allclose(stuck[list(COLOURED)], [0.08 * MODEL.span, 0.15 * MODEL.span])
    assert_allclose(stuck[[HEALTHY, ODD, S_NONE, S_GAIN, A_GAIN, A_NONE]], 0.0)
    assert [ROW_OF_MODEL[m] for m in (S_STUCK, A_BIAS)] == [
        (Side.SENSOR, FaultMode.STUCK),
        (Side.ACTUATOR, FaultMode.NOISY),
    ]
    assert set(ROW_OF_MODEL) <= {None, *((row.side, row.mode) for row in FAULT_ROWS)}
    assert len(ROW_OF_MODEL) == MODELS
    assert {ROW_OF_MODEL[m] for m in NOISY_SENSOR} == {(Side.SENSOR, FaultMode.NOISY)}
    assert all(
        row is not None and row[0] is Side.SENSOR and row[1].total for row in (ROW_OF_MODEL[m] for m in TOTAL_SENSOR)
    )
