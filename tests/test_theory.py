"""Every numbered equation of sections 1 to 4 of `docs/theory.md`, and what section 8 derives: again apart from the code, then against it.

Sections 5 to 7 are in `tests/test_theory_models.py`.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
import sympy as sp

from replay.control import mfhca
from replay.control.kinematics import steering_angle, wheel_commands
from replay.faults import fault_affected
from replay.machine.geometry import Geometry, WheelGeometry


def test_t3_the_projection_of_l1_on_the_rolling_direction() -> None:
    v, w, x, y, d, rate = sp.symbols("v omega x y d phi_dot", real=True)
    v_k = sp.Matrix([v - w * y, w * x])
    size = sp.sqrt(v_k.dot(v_k))
    for s in (1, -1):
        rolling = s * v_k / size  # the wheel's axle is along its normal
        normal = sp.Matrix([-rolling[1], rolling[0]])
        arm = d * normal
        v_j = v_k + (w + rate) * sp.Matrix([-arm[1], arm[0]])
        assert sp.simplify(v_j.dot(rolling) - (s * size - (w + rate) * d)) == 0
        assert sp.simplify(v_j.dot(normal)) == 0  # the wheel does not slide sideways


@pytest.mark.parametrize(("v", "omega"), [(0.3, 0.1), (-0.3, 0.1), (0.0, 0.2), (0.3, 0.0)])
def test_t1_t2_t3_a_rigid_body_that_turns_steadily(v: float, omega: float) -> None:
    """Positions of a wheel's middle a moment later give its velocity; the rolling direction is that of its angle."""
    places = {
        f"W{x:g}{y:g}": WheelGeometry(x, y, 0.2 * np.sign(y), "both") for x in (1.05, -1.05) for y in (-0.73, 0.73)
    }
    n, moment = 2000, 1e-6
    found = wheel_commands(np.full(n, v), np.full(n, omega), Geometry(places, 0.427), dt=0.001, max_steer=3.0)
    for i, w in enumerate(places.values()):
        phi = float(found.angle[-1, i])
        assert np.cos(phi) >= 0.0  # no wheel turns round
        middle = w.x + 1j * w.y + 1j * w.offset * np.exp(1j * phi)
        later = v * moment + np.exp(1j * omega * moment) * middle
        velocity = (later - middle) / moment * np.exp(-1j * phi)
        assert velocity == pytest.approx(found.speed[-1, i], abs=1e-6)


def test_t2_at_standstill_the_last_angle_is_held() -> None:
    angle = steering_angle(np.array([0.3, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), 1.0)
    assert angle == pytest.approx(np.full(3, np.arctan2(0.1, 0.3)))


def test_l16_printed_psi_is_gone_within_ten_seconds() -> None:
    dt, v = 0.001, np.zeros(10_001)
    rho = mfhca.decay_rate(v, v, 1.0, 0.001)
    decay, _ = mfhca.printed_decay(rho, dt)
    assert decay[-1] == pytest.approx(np.exp(-10 * 1.001))
    assert decay[-1] < np.exp(-10)
    t, rate, start = sp.symbols("t rho psi_0", positive=True)
    psi = sp.Function("psi")
    solved = sp.dsolve(sp.Eq(psi(t).diff(t), -rate * psi(t)), psi(t), ics={psi(0): start}).rhs
    assert sp.simplify(solved - start * sp.exp(-rate * t)) == 0


def test_l17_steering() -> None:
    assert mfhca.steering_command(np.array([0.3, 3.0]), np.array([0.1, 0.0]), 1.0, 1.0) == pytest.approx([0.2, 1.0])


@pytest.mark.parametrize("law", ["signed", "printed", "opposed", "sign_abs"])
def test_l15_and_t4_each_reading_solved_for_psi(law: str) -> None:
    lam, s, a, v, u, psi2 = sp.symbols("lambda s a v u psi2", real=True)  # a = |v_c|, v_c = s·a
    e = sp.symbols("sign_e", real=True)
    readings = {
        "signed": (-lam * (v - s * a) + s * psi2, s * u - lam * (a - s * v)),
        "printed": (-lam * sp.Abs(v) + lam * a + psi2, u - lam * (a - sp.Abs(v))),
        "opposed": (-lam * (v - s * a) - e * psi2, -e * u - lam * e * (v - s * a)),  # e·(v − v_c) = |e|
        "sign_abs": (s * (lam * (a - sp.Abs(v)) + psi2), s * u - lam * (a - sp.Abs(v))),
    }
    command, implied = readings[law]
    for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        at = dict(zip((s, e), signs, strict=True))
        assert sp.simplify((implied.subs(u, command) - psi2).subs(at)) == 0
    rng = np.random.default_rng(2)
    v_c, speed, given = rng.uniform(-0.3, 0.3, 200), rng.uniform(-0.3, 0.3, 200), rng.uniform(0.0, 0.1, 200)
    made = mfhca.drive_command(law, speed, v_c, given, 0.7, 10.0)
    by_hand = sp.lambdify((lam, s, a, v, e, psi2), command)
    sign = np.where(v_c < 0, -1.0, 1.0)
    assert made == pytest.approx(by_hand(0.7, sign, np.abs(v_c), speed, np.sign(speed - v_c), given))
    assert mfhca.implied_psi_squared(law, made, speed, v_c, 0.7, 10.0)[0] == pytest.approx(given)


def test_t5_the_forcing_is_zero_under_the_printed_law() -> None:
    t, zeta, e = sp.symbols("t zeta e")
    rho, psi = sp.Function("rho")(t), sp.Function("psi")(t)
    w = sp.diff(psi**2, t) + 2 * rho * psi**2
    assert sp.simplify(w.subs(sp.Derivative(psi, t), -rho * psi)) == 0
    assert sp.simplify(w.subs(sp.Derivative(psi, t), -rho * psi + zeta * e**2 / 2) - zeta * e**2 * psi) == 0
    dt, speed = 0.02, 0.3 * np.sin(np.arange(400) / 20)
    rate = mfhca.decay_rate(speed, speed, 1.0, 0.001)
    ran = 0.1 * mfhca.printed_decay(rate, dt)[0] ** 2
    assert np.nanmax(np.abs(mfhca.implied_forcing(ran, rate, dt))) < 1e-12
    held = mfhca.implied_forcing(np.full(400, 0.1), np.full(400, 1.4), 0.001)
    assert np.nanmedian(held) == pytest.approx(2 * 1.4 * 0.1, rel=2e-3)


def test_l18_to_l24_the_steps_of_the_proof() -> None:
    e, u, F, D, psi, a, top, rho = sp.symbols("e u F D psi a abar rho", positive=True)
    v_dot = sp.diff(e**2 / (2 * top) + psi**2 / 2, e) * (a * u + F + D) - rho * psi**2
    assert sp.simplify(v_dot - (a / top * e * u + e * (F + D) / top - rho * psi**2)) == 0  # L18 (16): with the ½ on e²
    lam, sigma, beta = sp.symbols("lambda sigma beta", positive=True)
    weights = (2 * lam * a - top * sigma) * e**2 / (2 * top) + 2 * beta * psi**2 / 2
    assert sp.simplify(weights - ((lam * a / top - sigma / 2) * e**2 + beta * psi**2)) == 0  # L24 (22)


@pytest.mark.parametrize("signs", [(1, 1), (-1, -1), (1, -1), (-1, 1)])
def test_t6_l20_holds_only_where_neither_speed_is_negative(signs: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    v_a, v_c = np.array(signs)[:, np.newaxis] * rng.uniform(0.01, 0.4, (2, 1000))
    e = v_a - v_c
    term = -e * (np.abs(v_a) - np.abs(v_c))
    if signs == (1, 1):
        assert term == pytest.approx(-(e**2))
    elif signs == (-1, -1):
        assert term == pytest.approx(e**2)
    else:
        assert (term > -(e**2)).all()


def test_t6_in_reverse_the_error_grows_at_the_rate_lambda_a() -> None:
    lam, a, v, v_c = sp.symbols("lambda a v v_c", negative=True)
    u = -lam * sp.Abs(v) + lam * sp.Abs(v_c)
    assert sp.simplify(a * u - lam * a * (v - v_c)) == 0


def test_t7_the_radius_of_theorem_1() -> None:
    rate = np.geomspace(0.001, 30.0, 200)  # ā
    sigma = np.linspace(0.01, 1.9999, 4000)  # σ_i
    for a in rate:
        eta = np.minimum(2.0 * a - a * sigma, 0.002)
        radius = np.sqrt(2.0 * a * (4.0 / (2.0 * sigma)) / eta)
        assert radius.min() > np.sqrt(2 * a / 0.002)
    assert np.sqrt(2 / 0.002) == pytest.approx(31.6, abs=0.05)
    assert 31.6 * np.sqrt(0.25) == pytest.approx(15.8)
    assert 2500 * 2 * np.pi / 60 / 17.7 * 0.427 == pytest.approx(6.3, abs=0.05)  # full scale of the speed sensor


def test_l7_the_derivative_of_the_measured_speed() -> None:
    """L3 (3) times r, with v = r·ω = δ·v_a + δ̄ of L5 (5): the term of δ̄ has no further r."""
    t, J, r, C, f, G, load, u = sp.symbols("t J r C_m f G T_L u_v")
    delta, more, v_a = (sp.Function(name)(t) for name in ("delta", "delta_bar", "v_a"))
    v = delta * v_a + more
    left = sp.expand(J * sp.diff(v, t) - (r * u - C * v - r * (f + G + load)))
    rest = J * delta * sp.diff(v_a, t) - (
        r * u - C * v - r * (f + G + load) - J * sp.diff(more, t) - J * sp.diff(delta, t) * v_a
    )
    assert sp.simplify(left - sp.expand(rest)) == 0


def test_l4_l5_l8_a_fault_is_a_gain_and_a_saturation_term() -> None:
    eps, true, sat = sp.symbols("epsilon v_a v_sat")
    assert sp.expand((1 - eps) * true + eps * sat - ((1 - eps) * true + eps * sat)) == 0
    made = fault_affected(np.array([0.3, 0.3, 0.3]), np.array([0.0, 0.4, 1.0]), np.array([0.1, 0.1, 0.1]))
    assert made == pytest.approx([0.3, 0.6 * 0.3 + 0.4 * 0.1, 0.1])


def test_only_the_product_of_two_losses_shows_in_steady_state() -> None:
    u, K, sensor, valve, load, c = sp.symbols("u K delta_s delta_a load c", positive=True)
    y = sensor * (K * valve * u + load)
    other = y.subs({sensor: sensor * c, valve: valve / c, load: load / c}, simultaneous=True)
    assert sp.simplify(y - other) == 0


def _unseen(directions: np.ndarray, wheels: tuple[int, ...]) -> bool:
    """Whether faults of these speeds alone can look like another motion."""
    others = [i for i in range(4) if i not in wheels]
    return bool(np.linalg.matrix_rank(directions[others]) < directions.shape[1])


def test_four_wheels_of_a_body_with_known_angles_have_three_relations() -> None:
    """One motion (ω/v and side slip are fixed by the angles) drives four speeds: one unknown is left."""
    phi_f, phi_r, base, half = 0.2, -0.1, 2.1, 0.73
    curvature = (np.tan(phi_f) - np.tan(phi_r)) / base
    lateral = np.tan(phi_f) - curvature * base / 2
    places = [(x, y) for x in (base / 2, -base / 2) for y in (-half, half)]
    rows = np.array([[np.hypot(1.0 - curvature * y, lateral + curvature * x)] for x, y in places])
    assert 4 - np.linalg.matrix_rank(rows) == 3
    assert not any(_unseen(rows, some) for k in (1, 2, 3) for some in combinations(range(4), k))
    assert _unseen(rows, (0, 1, 2, 3))
    # without angles and yaw rate, straight ahead: speed and yaw rate of the body are both unknown
    free = np.array([[1.0, -y] for _, y in places])
    assert 4 - np.linalg.matrix_rank(free) == 2
    assert not any(_unseen(free, (i,)) for i in range(4))
    left = [i for i, (_, y) in enumerate(places) if y > 0]
    parity = np.linalg.svd(free)[0][:, 2:].T
    assert np.linalg.matrix_rank(parity[:, left]) == 1  # either of them leaves the same trace


def test_implied_psi_knows_nothing_of_the_plant() -> None:
    rng = np.random.default_rng(2)
    v_c, psi = rng.uniform(-0.3, 0.3, 500), rng.uniform(0.0, 0.1, 500)
    for v in (v_c, 0.5 * v_c, np.zeros(500)):  # whatever the sensor reads
        u = mfhca.drive_command("signed", v, v_c, psi, 1.0, 1.0)
        implied, bound = mfhca.implied_psi_squared("signed", u, v, v_c, 1.0, 1.0)
        assert implied[~bound] == pytest.approx(psi[~bound])
