"""The numbered equations of sections 5 to 7 of `docs/theory.md`: derived again apart from the code, then against it."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray
from scipy.stats import chi2, norm
from scipy.stats import t as student

from diagnosis.channels.sample_status import PAIR
from diagnosis.drives.effort_map import EffortMap
from diagnosis.drives.inverse_controller import high_passed
from diagnosis.drives.load import LoadTrack
from diagnosis.drives.power import added_noise, least_load, load_powers, noncentrality
from diagnosis.efforts.relation import Shares, held_share
from diagnosis.efforts.windows import EffortSteps
from diagnosis.estimation.fault_models import CONSTANT, EXACT, ZERO, ModeModel
from diagnosis.estimation.row_probability import row_probabilities
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.viterbi import forward, initial_state
from diagnosis.response import models as response
from diagnosis.response.acceleration import Relation, changes
from diagnosis.response.kernel import posterior
from diagnosis.response.models import Beside, Blocks
from diagnosis.results.detectability import Deviation
from diagnosis.results.fault_rows import ROWS, prior
from diagnosis.steering.filter_state import Block
from diagnosis.steering.model_bank import HEALTHY_MODEL
from diagnosis.steering.path import start_states
from diagnosis.steering.prediction_kernel import predict as predict_axle
from diagnosis.wheels.entry_kernel import enter
from diagnosis.wheels.models import A_BIAS, A_GAIN, HEALTHY, S_GAIN, S_STUCK, WheelFilterModel
from diagnosis.wheels.models import MODELS as WHEEL_MODELS
from diagnosis.wheels.shared_kernel import weights
from diagnosis.wheels.step_kernel import WheelInput, correct, least_steps, predict
from replay.machine.config import Limits
from tests.diagnosis.steering.test_step_kernel import LAG
from tests.diagnosis.steering.test_step_kernel import MODEL as AXLE

Array = NDArray[np.float64]

DT = 0.01
WHEEL = WheelFilterModel(
    K=2.4,
    tau=0.25,
    noise=0.004,
    constant_noise=0.0005,
    rounding=0.0003,
    load=0.02,
    span=0.8,
    valve_span=0.15,
    drift=0.0,
)
TYRE = WHEEL.grip * 0.05  # of a tyre that slides from 5 cm/s on


def wheel_input(y: float = 0.2, drive: float = 0.1, body: float = np.nan) -> WheelInput:
    """A block with a pump that feeds everything."""
    return WheelInput(y, 10.0, 0.0, 1.0, 0.0, 0, drive, drive, drive, 1.0, 1.0, 0.0, 0.0, body, 0.0, 0.0)


def predicted(m: int, z: Array, body: float = np.nan, most: float = 0.0) -> Array:
    """State [ν, g, x, c] of a wheel's model after a block."""
    mean, cov = np.zeros((WHEEL_MODELS, 4)), np.zeros((WHEEL_MODELS, 4, 4))
    mean[m] = z
    constants = WHEEL.constants(DT, 0.001)._replace(grip_most=most)
    predict(m, wheel_input(body=body), constants, mean, cov)
    return np.asarray(mean[m])


def test_t8_t9_the_block_of_a_wheel_is_the_exact_solution_for_a_held_opening() -> None:
    t, tau, nu, drive = sp.symbols("t tau nu drive", positive=True)
    v = sp.Function("v")
    solved = sp.dsolve(sp.Eq(tau * v(t).diff(t), -v(t) + drive), v(t), ics={v(0): nu}).rhs
    fade = sp.exp(-t / tau)
    assert sp.simplify(solved - (fade * nu + (1 - fade) * drive)) == 0


def test_t9_the_rows_one_by_one() -> None:
    a, f = np.exp(-DT / WHEEL.tau), np.exp(-DT / 6.0)
    b, s, drive = 1 - a, WHEEL.load, WHEEL.K * 0.1
    nu, g, x, c = 0.2, 0.6, 0.7, 0.05
    for m, expected in (
        (HEALTHY, a * nu + b * (drive + s * x)),
        (S_GAIN, a * nu + b * drive * g + b * s * g * x),
        (A_GAIN, a * nu + b * drive * g + b * s * x),
        (A_BIAS, a * nu + b * drive * g + b * s * x + b * c),
    ):
        z = predicted(m, np.array([nu, g if m != HEALTHY else 1.0, x, c if m == A_BIAS else 0.0]))
        assert z[0] == pytest.approx(expected, rel=1e-12)
        assert z[2] == pytest.approx(f * x)


def test_t9_the_load_keeps_its_variance() -> None:
    keep, variance = 0.97, 1.0
    for _ in range(100):
        variance = keep**2 * variance + 1.0 - keep**2
    assert variance == pytest.approx(1.0)


def test_t9_is_exact_for_means_of_blocks_by_its_weights() -> None:
    width, lag, rng = 10, DT / WHEEL.tau, np.random.default_rng(3)
    u, v = rng.uniform(-0.2, 0.2, 30 * width), 0.0
    speed = np.empty(u.size)
    for k in range(u.size):
        speed[k] = v
        v = np.exp(-lag / width) * v + (1 - np.exp(-lag / width)) * WHEEL.K * u[k]
    here, after = np.empty(width), np.empty(width)
    weights(lag, here, after)
    mean, opening = speed.reshape(-1, width).mean(axis=1), u.reshape(-1, width)
    drive = opening[1:] @ here + opening[:-1] @ after
    assert mean[1:] == pytest.approx(np.exp(-lag) * mean[:-1] + (1 - np.exp(-lag)) * WHEEL.K * drive)


@pytest.mark.parametrize(("body", "slides"), [(0.22, False), (0.9, True), (-0.9, True)])
def test_t10_a_tyre_holds_or_slides(body: float, slides: bool) -> None:
    """Against the equation of motion in ten thousand small steps."""
    v = 0.2
    steps = 10_000
    for _ in range(steps):
        tyre = np.sign(body - v) * TYRE if slides else WHEEL.grip * (body - v)
        v += DT / steps / WHEEL.tau * (-v + WHEEL.K * 0.1 + tyre)
    assert predicted(HEALTHY, np.array([0.2, 1.0, 0.0, 0.0]), body, TYRE)[0] == pytest.approx(v, rel=1e-5)


def test_t11_squared_steps_of_white_noise() -> None:
    """χ² with two thirds of a degree each: mean and variance of Σ(Δy)² from the steps' covariance."""
    n = 10_000
    power = 6 * n - 2  # trace of its square: 4 on the diagonal, 1 beside it
    small = 2 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)
    assert np.trace(small @ small) == 6 * 6 - 2
    freedom = 2 * (2 * n) ** 2 / (2 * power)  # of a·χ²_f: 2·mean²/variance
    assert freedom == pytest.approx(2 * n / 3, rel=1e-3)


def test_t12_a_sensors_model_scales_the_speed_as_it_is_entered() -> None:
    g, v, p_g, p_v = sp.symbols("g v P_g P_v", positive=True)
    dg, dv = sp.symbols("dg dv")
    moments = {dg**2 * dv**2: p_g * p_v, dg**2: p_g, dv**2: p_v, dg * dv**2: 0, dg**2 * dv: 0, dg * dv: 0, dg: 0, dv: 0}

    def mean(x: sp.Expr) -> sp.Expr:
        terms = sp.Poly(sp.expand(x), dg, dv).terms()
        return sum(c * (moments[dg**i * dv**j] if i + j else 1) for (i, j), c in terms)

    nu = (g + dg) * (v + dv)
    variance = sp.expand(mean(nu**2) - mean(nu) ** 2)
    assert sp.simplify(variance - (p_g * v**2 + (g**2 + p_g) * p_v)) == 0
    assert sp.simplify(mean(nu * (g + dg)) - mean(nu) * g - p_g * v) == 0
    z, P = np.zeros((WHEEL_MODELS, 4)), np.zeros((WHEEL_MODELS, 4, 4))
    z[HEALTHY, 0], P[HEALTHY, 0, 0] = 0.3, 4e-4
    enter(S_GAIN, HEALTHY, WHEEL.constants(DT, 0.001), z, P)
    at = {g: 0.5, v: 0.3, p_g: 0.09, p_v: 4e-4}
    assert z[S_GAIN, :2] == pytest.approx([0.15, 0.5])
    assert P[S_GAIN, 0, 0] == pytest.approx(float(variance.subs(at)))
    assert P[S_GAIN, 0, 1] == pytest.approx(0.09 * 0.3)
    enter(A_GAIN, HEALTHY, WHEEL.constants(DT, 0.001), z, P)
    assert z[A_GAIN, 0] == 0.3  # a valve's leaves the speed where it is


def test_long_after_an_onset_two_sides_differ_by_what_the_load_does() -> None:
    g, drive, load = sp.symbols("g drive load")
    sensor, valve = g * (drive + load), g * drive + load
    assert sp.simplify(valve - sensor - (1 - g) * load) == 0


def test_a_dead_sensor_shows_nothing_of_the_speed() -> None:
    z, P = np.zeros((WHEEL_MODELS, 4)), np.zeros((WHEEL_MODELS, 4, 4))
    z[S_STUCK] = [0.3, 1.0, 0.0, 0.1]
    P[S_STUCK] = np.diag([0.01, 0.0, 1.0, 0.04])
    q, k = wheel_input(y=0.2), WHEEL.constants(DT, 0.001)
    correct(S_STUCK, q, 1.0, k, z, P, np.log(least_steps(q, k)))
    assert z[S_STUCK, 0] == 0.3
    assert P[S_STUCK, 0, 0] == 0.01
    assert z[S_STUCK, 3] == pytest.approx(0.2, abs=1e-3)


def test_innovations_of_a_healthy_wheel_are_white_and_as_large_as_the_filter_says() -> None:
    rng, k = np.random.default_rng(4), WHEEL.constants(DT, 0.001)
    z, P = np.zeros((WHEEL_MODELS, 4)), np.zeros((WHEEL_MODELS, 4, 4))
    z[HEALTHY, 1], P[HEALTHY, 2, 2] = 1.0, 1.0
    nu, x, out = 0.0, rng.normal(), []
    for n in range(20_000):
        drive = 0.1 * np.sign(np.sin(n / 150))
        nu = k.fade * nu + (1 - k.fade) * (WHEEL.K * drive + WHEEL.load * x)
        x = k.load_keep * x + np.sqrt(1 - k.load_keep**2) * rng.normal()
        y = nu + rng.normal(0, WHEEL.noise / np.sqrt(10))
        q = wheel_input(y, drive)
        share = predict(HEALTHY, q, k, z, P)
        out.append((y - z[HEALTHY, 0]) / np.sqrt(P[HEALTHY, 0, 0] + WHEEL.noise**2 / 10))
        correct(HEALTHY, q, share, k, z, P, np.log(least_steps(q, k)))
    e = np.array(out)
    assert np.mean(e**2) == pytest.approx(1.0, abs=0.03)
    assert abs(np.mean(e[1:] * e[:-1])) < 0.03


def test_t13_steering_over_a_block_and_its_readout() -> None:
    t, tau, f, r, phi = sp.symbols("t tau f r phi", positive=True)
    rate = f + (r - f) * sp.exp(-t / tau)
    assert sp.simplify(tau * sp.diff(rate, t) - (f - rate)) == 0
    fade = sp.exp(-t / tau)
    turned = tau * (1 - fade) * r + (t - tau * (1 - fade)) * f
    assert sp.simplify(sp.diff(turned, t) - rate) == turned.subs(t, 0) == 0
    a, b, d, c = sp.symbols("a b d c")
    readout = sp.Matrix([d * phi + c]).jacobian([phi, r, a, b, d, c])
    assert list(readout) == [d, 0, 0, 0, phi, 1]
    constants = AXLE.constants()
    _, bank = start_states(0.1, constants)
    bank.mean[HEALTHY_MODEL, 1], driven = 0.05, 0.2
    angle, speed, steps = 0.1, 0.05, 10_000
    for _ in range(steps):
        angle, speed = angle + speed * DT / steps, speed + (driven - speed) / LAG * DT / steps
    predict_axle(HEALTHY_MODEL, Block(0.1, 0.0, 0.0, driven, 0.0, 0.05, 1.0, PAIR), constants.axle, 1.0, bank)
    assert bank.mean[HEALTHY_MODEL, :2] == pytest.approx([angle, speed], rel=1e-4)


def test_t14_command_and_effort_give_back_the_speed_that_the_controller_saw() -> None:
    s, Kp, Ti, w, R, V = sp.symbols("s K_p T_i w R V", positive=True)
    effort = Kp * (w * R - V + (R - V) / (Ti * s))
    passed = Ti * s / (1 + Ti * s)
    assert sp.simplify(R + (w - 1) * passed * R - passed * effort / Kp - V) == 0
    dt, memory, n = 1e-3, 0.8, 4000
    rng = np.random.default_rng(5)
    r, v = np.repeat(rng.uniform(1, 2, 8), n // 8), np.cumsum(rng.normal(0, 0.003, n)) + 1.0
    u = 0.2 * (0.7 * r - v + np.cumsum(r - v) * dt / memory)
    seen = r + (0.7 - 1) * high_passed(r, memory, dt) - high_passed(u, memory, dt) / 0.2
    left = (seen - v)[:1]
    assert seen - v == pytest.approx(left * np.exp(-np.arange(n) * dt / memory), abs=5e-3)


def test_t20_the_balance_at_the_rim_is_linear_in_what_is_measured() -> None:
    k, J, F, b, v, a, m, c, w = sp.symbols("k J F_c b v a m c w", positive=True)
    effort = (
        J * a + F + b * v + m * a + c
    ) / k  # the tyre carries the wheel's part of the body: m·v̇ and its resistance c
    assert sp.expand(effort - ((F + c) / k + b / k * v + (J + m) / k * a)) == 0
    pulls = effort - b / k * v
    lost = effort.subs(k, k * (1 - w)) - b * v / (k * (1 - w))
    assert sp.simplify(lost - pulls / (1 - w)) == 0


def test_t20_the_code_has_these_terms_and_the_share() -> None:
    rng, n = np.random.default_rng(3), 60
    v = np.repeat(rng.uniform(0.5, 1.0, (n // 5, 2)), 5, axis=0)
    rate, d = rng.normal(0.0, 0.2, (n, 2)), v - v.mean(axis=1, keepdims=True)
    steps = EffortSteps(v, v, rate, d, np.ones((n, 2), bool), 1, v)
    x = steps.terms(0, 0.05)
    assert x == pytest.approx(
        np.column_stack([np.ones(n), np.sign(v[:, 0]), v[:, 0], rate[:, 0], d[:, 0], d[:, 0] / (abs(d[:, 0]) + 0.05)])
    )
    m, r, usual = rng.normal(2.0, 1.0, (n, 2)), np.zeros((n, 2)), 2.0
    r[:, 0] = 0.5 * m[:, 0]
    share = Shares(r, m, steps.use, (usual, usual)).over(0, None)[0]
    expected = (r[:, 0] @ m[:, 0]) / (m[:, 0] @ m[:, 0] + n * usual**2 / 4)
    assert share == pytest.approx([expected])
    r[:, 1] = r[:, 0]  # what another wheel shows as well
    assert Shares(r, m, steps.use, (usual, usual)).over(0, None)[0] == pytest.approx([0.0])


def test_t20_without_an_integral_part_the_effort_is_a_function_of_command_and_error() -> None:
    rng, n = np.random.default_rng(4), 400
    r, load = np.repeat(rng.uniform(0.4, 1.0, n // 20), 20), np.repeat(rng.normal(0.0, 1.0, n // 40), 40)
    gain, integral = 8.0, 0.0
    for with_memory in (False, True):
        e, v = np.zeros(n), np.zeros(n)
        for i in range(n):  # at rest: e = load + r; v is what makes the loop ask for it
            e[i] = 3.0 * r[i] + load[i]
            integral = load[i] if with_memory else 0.0
            v[i] = r[i] - (e[i] - 3.0 * r[i] - integral) / gain
        held = held_share(e, r, v, np.ones(n, bool))
        assert held > 0.1 if with_memory else held < 0.01


def blocks(mean: float) -> Blocks:
    one = np.ones(1)
    return Blocks(
        np.zeros(1, np.intp), mean * one, 0.4 * one, 0.5 * one, 0.02 * one, 5 * one, 0 * one, 0 * one, 0 * one, one
    )


@pytest.mark.parametrize(("mean", "beside"), [(0.45, 0.45), (0.6, 0.6), (0.6, 0.5), (0.3, 0.42)])
def test_t15_the_evidence_of_a_block(mean: float, beside: float) -> None:
    def loss(z: float) -> float:
        assert 2 * np.log1p(z * z / 3) == pytest.approx(student.logpdf(0, 3) - student.logpdf(z, 3))
        return float(2 * np.log1p(z * z / 3))

    beta, noise = 0.8, 0.03
    view = Beside(np.array([beside]), np.array([noise]), np.array([beta]), np.zeros(1))
    one, two = loss((mean - np.clip(mean, 0.4, 0.5)) / 0.02), loss((mean - beside) / noise)
    expected = -0.25 * one * min(1.0, two / loss(4.0)) - 0.5 * beta * two
    assert float(response._misfit(blocks(mean), 1.0, view)[0]) == pytest.approx(expected)
    assert float(response._misfit(blocks(mean), 1.0, None)[0]) == pytest.approx(-0.25 * one)


def test_t15_the_chain_by_its_matrix() -> None:
    rng, n, states = np.random.default_rng(6), 40, response.STATES
    assert states == 17
    score, enters, leaves = rng.normal(0, 2, (n, states)), np.full(n, 0.25 / 120), np.full(n, 0.25 / 10)
    enters[20], leaves[20] = 0.1, 0.3
    chain = []
    for p, q in zip(enters, leaves, strict=True):
        A = np.diag(np.full(states, 1 - q))
        A[0], A[1:, 0] = p / 16, q
        A[0, 0] = 1 - p
        assert A.sum(axis=1) == pytest.approx(1.0)
        chain.append(A)
    like = np.exp(score)
    ahead, back = [chain[0][0] * like[0]], [np.ones(states)]
    for k in range(1, n):
        ahead.append(ahead[-1] @ chain[k] * like[k])
    for k in range(n - 1, 0, -1):
        back.append(chain[k] @ (like[k] * back[-1]))
    both = np.array(ahead) * np.array(back[::-1])
    assert posterior(score, enters, leaves) == pytest.approx(both / both.sum(axis=1, keepdims=True))


def test_t16_a_fresh_model_replaces_a_settled_one_only_beyond_what_learning_is_worth() -> None:
    """One step of the path with an exact model b ahead: entry keeps S_b − cost, and learning decides whether there is one."""
    model = ModeModel(noise=0.1, constant_noise=0.01, tolerance=0.1, span=2.0, switch_cost=9.0, dt=DT)
    for m, learning in ((CONSTANT, 10.0), (ZERO, 0.0)):
        for behind, entered in ((9.0 + learning - 0.1, False), (9.0 + learning + 0.1, True)):
            state = initial_state(model)
            state.score[:] = -500.0
            state.score[EXACT], state.score[m] = 0.0, -behind
            state.mean[CONSTANT, 0], state.cov[CONSTANT, 0] = 0.3, 1e-6
            pointers, after = forward(samples(0.3, 0.3), model, state)
            assert bool(pointers.back[0, m] == EXACT) is entered
            start = -9.0 if entered else -behind
            spread = 2.0**2 if entered else 1e-6
            variance = 0.01**2 + (spread if m == CONSTANT else 0.0)
            off = 0.3 if m == ZERO or entered else 0.0
            floor = -18.0 - np.log(2.0)
            gain = max(norm.logpdf(off, 0, np.sqrt(variance)), floor) - 0.02
            assert after.score[m] - after.score[EXACT] == pytest.approx(start + gain - norm.logpdf(0, 0, 0.1), abs=1e-6)


def samples(y: float, x: float) -> Samples:
    """One sample of a pair."""
    return Samples.even(np.array([y]), np.array([x]), np.full(1, PAIR, np.int8), np.zeros(1, np.bool_))


def test_t16_the_cost_is_one_fault_a_minute() -> None:
    """ln(8·60 s/Δ) is −ln of the chance of one of eight rows in a step; what staying would cost is nothing beside it."""
    entered = 1 - np.exp(-DT / 60)
    assert np.log(8 * 60 / DT) == pytest.approx(-np.log(entered / 8), abs=1e-3)
    assert -np.log1p(-entered) < 2e-4


def test_t17_a_quarter_of_the_evidence_counts() -> None:
    evidence = np.full(len(ROWS), -np.inf)
    evidence[:4] = [0.0, 3.0, -2.0, 8.0]
    weight = np.array([prior(k) * np.exp(evidence[k] / 4) for k in range(4)])
    assert row_probabilities(evidence)[:4] == pytest.approx(weight / weight.sum())


def test_t18_nineteen_of_twenty_cross_the_threshold_and_by_the_mean_alone_only_half() -> None:
    rng, needed, n = np.random.default_rng(7), 21.6, 50
    d = noncentrality(needed)

    def crossed(size: float) -> float:
        s = size / np.sqrt(n)  # ε·v/σ of each independent sample
        y = s + rng.normal(size=(20_000, n))
        return float(np.mean((s * y - s * s / 2).sum(axis=1) >= needed))

    assert crossed(d) == pytest.approx(0.95, abs=0.01)
    assert crossed(np.sqrt(2 * needed)) == pytest.approx(0.5, abs=0.02)


def test_t18_added_noise_against_the_chi_square_law() -> None:
    needed, n = 21.6, 50.0
    k2 = float(added_noise(np.array([n]), needed)[0]) ** 2
    least = 2 * (needed + 0.5 * n * np.log1p(k2)) / k2  # χ²_n from which the evidence is enough
    assert chi2.sf(least, n) == pytest.approx(0.95, abs=0.02)


def test_t21_a_constant_and_a_ramp_of_the_acceleration_vanish_and_a_step_stays() -> None:
    t, (T, b, r, J) = sp.symbols("t", real=True), sp.symbols("T b r J", positive=True)

    def d(f: sp.Expr) -> sp.Expr:
        delta = f.subs(t, t + T / 2) - f.subs(t, t - T / 2)
        return sp.simplify(delta - (delta.subs(t, t - T) + delta.subs(t, t + T)) / 2)

    assert d(b * t + r * t**2 / 2) == 0
    assert sp.simplify(d(J * sp.Heaviside(t)).subs(t, 0) - J) == 0
    h, reach = 0.05, 10
    way = 0.3 * np.arange(200) * h + 0.1 * (np.arange(200) * h) ** 2 + 1.7 * (np.arange(200) >= 100)
    found = changes(way, reach)
    assert found[np.nanargmax(np.abs(found))] == pytest.approx(1.7)
    assert np.nanmin(np.abs(found)) == pytest.approx(0.0, abs=1e-12)


def test_t22_the_smallest_change_that_shows() -> None:
    gain, noise, spread, usual = 0.9, 0.05, 0.2, 0.03
    one = Relation(gain, 0, 5, noise, spread, usual, np.zeros(3), np.zeros(3))
    y = one.least
    assert y == pytest.approx(noise / gain / np.sqrt(1 / 4.6 - spread**2))
    assert 0.5 * (gain * y) ** 2 / (noise**2 + (spread * gain * y) ** 2) == pytest.approx(2.3)
    x = 0.04
    said = one._replace(y=np.full(11, y), x=np.full(11, x)).says(5)[0]
    body, own = noise**2 + (spread * gain * y) ** 2, noise**2 + (gain * usual) ** 2
    assert said == pytest.approx(0.5 * ((x - gain * y) ** 2 / body - x**2 / own))
    assert one._replace(spread=0.47).least == np.inf


@pytest.mark.parametrize("seconds", [2.0, 10.0, None])
def test_t19_a_load_that_is_found_in_95_of_100(seconds: float | None) -> None:
    effort = EffortMap(offset=0.1, slope=0.05, between=0.01, drift=0.001, noise=0.004, slowest=1.0, fastest=5.0)
    limits, steps = Limits(), np.full(60, 0.3)
    found = load_powers(LoadTrack(0 * steps, 0 * steps, steps, steps**0, 100), effort, limits)
    (size,) = [p.size for p in found.rows if p.for_s == seconds and p.deviation is Deviation.INEFFICIENT]
    own = 0.01 if seconds is None else np.sqrt(0.004**2 / seconds + 0.001**2 * seconds)
    least = max(least_load(seconds, 0.3, effort, limits), limits.min_epsilon / (1 - limits.min_epsilon) * 0.3)
    load = least + 1.645 * own
    assert size == pytest.approx(load / (0.3 + load))
    assert norm.sf((least - load) / own) == pytest.approx(0.95, abs=1e-3)
    assert least > 2 * 0.01  # twice the spread alone is not enough
