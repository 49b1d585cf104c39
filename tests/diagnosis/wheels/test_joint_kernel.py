"""Wheels coupled by pump and body: openings as fed against a loop over samples, the others' speed, entries and floors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.channels.sample_status import PAIR, SILENT, SKIP
from diagnosis.estimation.back_pointers import STAY
from diagnosis.wheels.blocks import WheelBlocks, blocks_of
from diagnosis.wheels.entry_kernel import is_scaled
from diagnosis.wheels.filter import JointPass, forward, initial_state
from diagnosis.wheels.joint_kernel import (
    _LEARNING,
    _OTHER_LOAD,
    _OTHER_NOISE,
    _RECOVERY,
)
from diagnosis.wheels.joint_types import (
    BODY,
    DOUBT,
    DRIVE,
    DRIVE_HALF,
    DRIVE_NONE,
    LAGGED_DRIVE,
    SHARE_NONE,
    SHARE_SOME,
    JointState,
)
from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    ODD,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_STUCK,
    S_WHITE_3,
    S_WHITE_8,
    JointModel,
    WheelFilterModel,
)
from diagnosis.wheels.shared_kernel import taken, weights
from diagnosis.wheels.step_kernel import (
    _NO_LOSS,
    _OCCAM,
    _REVERSED,
    _SILENT,
    _WORST,
    WheelInput,
    advance,
    correct,
    least_steps,
    predict,
)
from replay.machine.config import WheelPlant

RAW, WIDTH, DT = 0.001, 10, 0.01
GAINS, LAGS = (2.4, 2.3, 2.5, 2.45), (0.25, 0.24, 0.26, 0.25)
COST = 11.0
Array = np.ndarray


def wheel(i: int = 0) -> WheelFilterModel:
    return WheelFilterModel(
        K=GAINS[i],
        tau=LAGS[i],
        noise=0.004,
        constant_noise=0.0005,
        rounding=0.0003,
        load=0.014,
        span=0.8,
        valve_span=0.15,
    )


def machine(flow: float = 1e9, grip_most: float = 0.0) -> JointModel:
    return JointModel(tuple(wheel(i) for i in range(4)), flow, COST).sliding_at(grip_most / WheelFilterModel.grip)


def blocks(y: Array, u: Array, status: int = PAIR, quiet: bool = False, body: bool = False) -> WheelBlocks:
    fill = np.ones(y.shape) if body else np.full(y.shape, np.nan)
    return blocks_of(
        y,
        u,
        np.full(y.shape, status, dtype=np.int8),
        np.full(y.shape, quiet),
        fill * [1.05, 0.95, 1.0, 0.9],
        fill * [0.0, 0.01, -0.01, 0.0],
        [WheelPlant(K, tau) for K, tau in zip(GAINS, LAGS, strict=True)],
        RAW,
    )


def openings(n: int) -> dict[str, Array]:
    """Constant, changing within a block, and a sine of each wheel's own."""
    t = np.arange(n)[:, None] * RAW
    one = np.array([0.1, 0.12, 0.09, 0.11])
    return {
        "constant": np.broadcast_to(one, (n, 4)).copy(),
        "chattering": one * (1 + 0.5 * (-1.0) ** np.arange(n)[:, None] * (np.arange(n) % 7 < 4)[:, None]),
        "moving": one * np.sin(2 * np.pi * t / (1.0 + 0.2 * np.arange(4)) + 0.3),
    }


def simulated(u: Array, flow: float) -> tuple[Array, Array]:
    """τ v̇ = −v + K u·share, sample by sample, a pump shared by all; speeds and shares."""
    v, out, shares = np.zeros(4), np.empty(u.shape), np.empty(u.shape[0])
    a = np.exp(-RAW / np.array(LAGS))
    for k in range(u.shape[0]):
        out[k] = v
        shares[k] = min(1.0, flow / np.sum(np.abs(np.array(GAINS) * u[k])))
        v = a * v + (1 - a) * np.array(GAINS) * u[k] * shares[k]
    return out, shares


def noisy(v: Array) -> Array:
    return v + 0.004 * np.random.default_rng(1).normal(size=v.shape)


@pytest.mark.parametrize("flow", [1e9, 0.8], ids=["own supply", "pump at its limit"])
@pytest.mark.parametrize("kind", ["constant", "chattering", "moving"])
def test_means_of_blocks_are_those_of_the_samples(kind: str, flow: float) -> None:
    n = 3000
    u = openings(n)[kind]
    v, shares = simulated(u, flow)
    if flow < 1.0:
        assert np.mean(shares < 0.95) > 0.05
    done = forward(blocks(noisy(v), u), machine(flow))
    assert_array_equal(done.best, HEALTHY)
    mean = v.reshape(-1, WIDTH, 4).mean(axis=1)
    for i in range(4):
        a, speed = np.exp(-DT / LAGS[i]), 0.0
        for b in range(n // WIDTH):
            speed = a * speed + (1 - a) * GAINS[i] * done.inputs[b, i, DRIVE]
            assert speed == pytest.approx(mean[b, i], abs=1e-9)


def test_a_valve_that_took_less_would_be_fed_more() -> None:
    """Openings for a wheel that takes half or nothing of its flow, and the shares of a stuck one."""
    n, flow = 1000, 0.8
    u = openings(n)["chattering"]
    v, _ = simulated(u, flow)
    done = forward(blocks(noisy(v), u), machine(flow))
    assert_array_equal(done.best, HEALTHY)
    asked = np.abs(u * GAINS)
    for i in range(4):
        others = asked.sum(axis=1) - asked[:, i]
        a = np.exp(-RAW / LAGS[i])
        for column, part in ((DRIVE_HALF, 0.5), (DRIVE_NONE, 0.0)):
            x = u[:, i] * np.minimum(1.0, flow / (others + part * asked[:, i]))
            speed, twin, block = 0.0, np.empty(n), 0.0
            for k in range(n):
                twin[k], speed = speed, a * speed + (1 - a) * x[k]
            for b, mean in enumerate(twin.reshape(-1, WIDTH).mean(axis=1)):
                block += (1 - np.exp(-DT / LAGS[i])) * (done.inputs[b, i, column] - block)
                assert block == pytest.approx(mean, abs=1e-9)
        for column, own in ((SHARE_NONE, 0.0), (SHARE_SOME, 0.15 * GAINS[i])):
            share = np.minimum(1.0, flow / (others + own)).reshape(-1, WIDTH).mean(axis=1)
            assert_allclose(done.inputs[:, i, column], share, rtol=1e-9)


@pytest.mark.parametrize("lag", [0.001, 0.04, 3.0])
@pytest.mark.parametrize("width", [1, 4, 10])
def test_weights_share_an_opening_between_two_blocks(width: int, lag: float) -> None:
    here, after = np.zeros(width), np.zeros(width)
    weights(lag, here, after)
    assert (here >= 0).all()
    assert (after > 0).all()
    assert here[-1] == 0.0  # what comes last shows in the next block alone
    # an opening held for ever drives the mean as it stands
    assert here.sum() + after.sum() == pytest.approx(1.0)


def test_what_a_valve_takes() -> None:
    K, x = 2.4, -0.1
    for m in (*range(A_GAIN),):
        assert taken(m, 0.3, 0.2, K, x) == pytest.approx(0.24)
    assert taken(A_GAIN, 0.5, 0.0, K, x) == pytest.approx(0.12)
    assert taken(A_STUCK, 0.0, -0.2, K, x) == pytest.approx(0.2)
    assert taken(A_NONE, 0.0, 0.0, K, x) == 0.0
    assert taken(A_BIAS, 0.5, 0.3, K, x) == pytest.approx(abs(-0.12 + 0.3))


def state(tops: list[int], speeds: list[float], model: JointModel) -> JointState:
    """Wheels whose most probable models and speeds are given."""
    start = initial_state(np.array(speeds), model, DT, RAW)
    score, mean = np.full_like(start.score, -3.0), start.mean.copy()
    for i, m in enumerate(tops):
        score[i, m] = 0.0
        mean[i, m, 0] = speeds[i] * (mean[i, m, 1] if is_scaled(m) else 1.0)
    return JointState(score, mean, start.cov, start.carried)


def one_block(at: JointState, model: JointModel, y: Array, status: int = PAIR, body: bool = True) -> JointPass:
    return forward(blocks(np.tile(y, (WIDTH, 1)), np.zeros((WIDTH, 4)), status, body=body), model, at)


@pytest.mark.parametrize(
    "tops",
    [
        [HEALTHY] * 4,
        [S_GAIN, HEALTHY, HEALTHY, HEALTHY],
        [HEALTHY, S_STUCK, A_GAIN, S_WHITE_8],
        [ODD, HEALTHY, S_STUCK, HEALTHY],
    ],
)
def test_body_is_the_weighted_median_of_the_other_wheels(tops: list[int]) -> None:
    model = machine(grip_most=0.1)
    speeds = [0.21, 0.26, 0.2, 0.17]
    at = state(tops, speeds, model)
    got = one_block(at, model, np.array(speeds)).inputs[0]
    ratio, turn = np.array([1.05, 0.95, 1.0, 0.9]), np.array([0.0, 0.01, -0.01, 0.0])
    # the lagged drive is the first speed, so that no wheel is held back and each rolls as it turns
    roll = (np.array(speeds) + turn) / ratio
    trusts = {HEALTHY: 1.0, ODD: 0.7, S_GAIN: 0.4, A_GAIN: 0.7}
    trust = np.array([trusts.get(m, 0.15) for m in tops])
    for i in range(4):
        others = [j for j in range(4) if j != i]
        far = {j: sum(trust[h] * abs(roll[h] - roll[j]) for h in others) for j in others}
        j = min(far, key=lambda h: far[h])
        assert got[i, BODY] == pytest.approx(roll[j] * ratio[i] - turn[i])
        assert got[i, DOUBT] == pytest.approx(far[j] / trust[others].sum())


def test_a_driven_wheel_runs_off_the_body_that_holds_it_back() -> None:
    model = machine(grip_most=0.1)
    at = state([HEALTHY] * 4, [0.2] * 4, model)
    carried = at.carried.copy()
    carried[:, LAGGED_DRIVE] = [0.2, 0.266, 0.134, 2.0]  # what each valve asks for
    got = one_block(at._replace(carried=carried), model, np.full(4, 0.2)).inputs[0, 0, BODY]
    roll = [(0.2 + x + turn) / ratio for x, turn, ratio in ((-0.03, 0.01, 0.95), (0.03, -0.01, 1.0), (-0.05, 0.0, 0.9))]
    assert got == pytest.approx(np.median(roll) * 1.05)


def test_wheels_without_model_or_geometry_give_no_body() -> None:
    model = machine(grip_most=0.1)
    at = state([HEALTHY] * 4, [0.2] * 4, model)
    assert np.isnan(one_block(at, model, np.full(4, 0.2), body=False).inputs[0, :, BODY]).all()
    alone = replace(model, wheels=(model.wheels[0], None, None, None))
    done = forward(blocks(np.full((50, 4), 0.2), np.zeros((50, 4)), body=True), alone)
    assert np.isnan(done.inputs[:, 0, BODY]).all()
    assert np.isfinite(done.inputs[:, 0, :BODY]).all()
    assert_array_equal(done.inputs[:, 1:], 0.0)
    assert_array_equal(done.best[:, 1:], HEALTHY)


@pytest.mark.parametrize("top", [HEALTHY, ODD, S_WHITE_3, A_GAIN])
@pytest.mark.parametrize("status", [PAIR, SILENT, SKIP])
def test_models_are_entered_where_that_pays(top: int, status: int) -> None:
    model = machine()
    at = state([top] * 4, [0.2] * 4, model)
    at.score[1] -= 3.0 * np.arange(MODELS)
    at.score[1, top] = 0.0
    done = one_block(at, model, np.full(4, 0.2), status)
    for m in range(MODELS):
        price = _RECOVERY if m == HEALTHY else COST
        if m == ODD or (m == HEALTHY and top == ODD):
            price = _OTHER_LOAD  # no fault begins or ends
        if S_WHITE_3 <= m <= S_OU_LARGE and S_WHITE_3 <= top <= S_OU_LARGE:
            price = _OTHER_NOISE  # one row: what changes is how strong its noise is
        price += 0.0 if m in (HEALTHY, ODD, S_NONE, A_NONE) else _LEARNING
        enters = m != top and status != SKIP and at.score[1, m] < -price
        assert done.back[1][0, m] == (top if enters else STAY)


def advanced(q: WheelInput, status: int, quiet: bool = False, speed: float = 0.2) -> tuple[Array, Array, Array]:
    """Gains of one block, what predict and correct alone say, and states."""
    k = wheel().constants(DT, RAW)
    start = initial_state(np.full(4, speed), machine(), DT, RAW)
    z, P, gain = start.mean[0].copy(), start.cov[0].copy(), np.zeros(MODELS)
    advance(MODELS, q, np.int8(status), quiet, k, z, P, gain)  # as in the scan, which has compiled it
    plain = np.zeros(MODELS)
    other, cov = start.mean[0].copy(), start.cov[0].copy()
    for m in range(MODELS):
        share = predict(m, q, k, other, cov)
        if status == PAIR:
            plain[m] = correct(m, q, share, k, other, cov, np.log(least_steps(q, k)))
    assert_array_equal(z, other)
    assert_array_equal(P, cov)
    return gain, plain, z


def shown(y: float, jitter: float = 3e-5) -> WheelInput:
    return WheelInput(y, 10.0, jitter, 1.0, 0.0, np.int8(0), 0.08, 0.08, 0.08, 1.0, 1.0, 0.0, 0.0, np.nan, 0.0, 0.0)


def test_a_block_speaks_within_limits() -> None:
    gain, plain, _ = advanced(shown(0.2), PAIR)
    free = [m for m in range(S_GAIN, MODELS) if m != A_NONE]
    expected = np.maximum(plain, plain.max() - _WORST)
    expected[free] -= _OCCAM * DT
    assert plain.min() < plain.max() - _WORST  # no signal
    assert_allclose(gain, expected, atol=1e-12)
    # a gain of nearly 1 is no loss, and one below 0 is no valve
    gain, plain, z = advanced(shown(0.6), PAIR)
    assert z[S_GAIN, 1] > _NO_LOSS
    assert gain[S_GAIN] <= gain[HEALTHY] - DT
    gain, plain, z = advanced(shown(-0.3), PAIR)
    assert z[S_GAIN, 1] < 0.0
    assert gain[S_GAIN] == pytest.approx(max(plain[S_GAIN], plain.max() - _WORST) - _OCCAM * DT - _REVERSED)


def test_silence_speaks_for_no_signal_and_gaps_for_nothing() -> None:
    gain, _, _ = advanced(shown(0.0), SILENT)
    assert gain[S_NONE] == 0.0
    assert_array_equal(np.delete(gain, S_NONE), _SILENT)
    gain, _, _ = advanced(shown(0.0), SKIP)
    assert_array_equal(gain, 0.0)


def test_standstill_speaks_for_no_loss() -> None:
    q = shown(0.0, 0.0)._replace(drive=0.0, drive_half=0.0, drive_none=0.0)
    gain, plain, _ = advanced(q, PAIR, quiet=True, speed=0.0)
    assert plain[S_NONE] > plain[HEALTHY]
    for m in (S_STUCK, S_NONE, S_GAIN, A_GAIN, A_NONE, A_BIAS):
        assert gain[m] <= gain[HEALTHY]
    # a sensor that is stuck off zero shows at rest too
    gain, _, _ = advanced(shown(0.3, 0.0)._replace(drive=0.0), PAIR, quiet=True, speed=0.0)
    assert gain[S_STUCK] > gain[HEALTHY]
