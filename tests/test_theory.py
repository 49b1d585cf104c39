"""What `docs/theory.md` derives, derived again apart from the code."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp


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


def test_printed_psi_is_gone_within_ten_seconds() -> None:
    assert np.exp(-10 * (1.0 + 0.001)) < np.exp(-10)


def test_t4_the_forcing_is_zero_under_the_printed_law() -> None:
    t = sp.symbols("t")
    rho, psi = sp.Function("rho")(t), sp.Function("psi")(t)
    w = sp.diff(psi**2, t) + 2 * rho * psi**2
    assert sp.simplify(w.subs(sp.Derivative(psi, t), -rho * psi)) == 0


@pytest.mark.parametrize(("sign", "grows"), [(1, False), (-1, True)])
def test_l20_turns_its_sign_in_reverse(sign: int, grows: bool) -> None:
    rng = np.random.default_rng(1)
    v_a, v_c = sign * rng.uniform(0.0, 0.4, (2, 1000))
    e = v_a - v_c
    term = -e * (np.abs(v_a) - np.abs(v_c))
    assert term == pytest.approx(e**2 if grows else -(e**2))


def test_t5_the_radius_of_theorem_1() -> None:
    rate = np.geomspace(0.01, 30.0, 200)  # ā
    sigma = np.linspace(0.01, 1.9999, 4000)  # σ_i
    for a in rate:
        eta = np.minimum(2.0 * a - a * sigma, 0.002)
        radius = np.sqrt(2.0 * a * (4.0 / (2.0 * sigma)) / eta)
        assert radius.min() > 31.6 * np.sqrt(a)
    assert 31.6 * np.sqrt(0.25) == pytest.approx(15.8)


def test_t7_the_block_of_a_wheel_is_the_exact_solution_for_a_held_opening() -> None:
    t, tau, nu, drive = sp.symbols("t tau nu drive", positive=True)
    v = sp.Function("v")
    solved = sp.dsolve(sp.Eq(tau * v(t).diff(t), -v(t) + drive), v(t), ics={v(0): nu}).rhs
    fade = sp.exp(-t / tau)
    assert sp.simplify(solved - (fade * nu + (1 - fade) * drive)) == 0


def test_t7_the_load_keeps_its_variance() -> None:
    keep, variance = 0.97, 1.0
    for _ in range(100):
        variance = keep**2 * variance + 1.0 - keep**2
    assert variance == pytest.approx(1.0)


def test_only_the_product_of_two_losses_shows_in_steady_state() -> None:
    u, K, sensor, valve, load, c = sp.symbols("u K delta_s delta_a load c", positive=True)
    y = sensor * (K * valve * u + load)
    other = y.subs({sensor: sensor * c, valve: valve / c, load: load / c}, simultaneous=True)
    assert sp.simplify(y - other) == 0


def test_four_wheels_of_a_body_with_known_angles_have_three_relations() -> None:
    """One motion (ω/v and side slip are fixed by the angles) drives four speeds: one unknown is left."""
    phi_f, phi_r, base, half = 0.2, -0.1, 2.1, 0.73
    curvature = (np.tan(phi_f) - np.tan(phi_r)) / base
    lateral = np.tan(phi_f) - curvature * base / 2
    places = [(x, y) for x in (base / 2, -base / 2) for y in (-half, half)]
    rows = [[np.hypot(1.0 - curvature * y, lateral + curvature * x)] for x, y in places]
    assert 4 - np.linalg.matrix_rank(np.array(rows)) == 3


def test_implied_psi_knows_nothing_of_the_plant() -> None:
    from replay.control.mfhca import drive_command, implied_psi_squared

    rng = np.random.default_rng(2)
    v_c, psi = rng.uniform(-0.3, 0.3, 500), rng.uniform(0.0, 0.1, 500)
    for v in (v_c, 0.5 * v_c, np.zeros(500)):  # whatever the sensor reads
        u = drive_command("signed", v, v_c, psi, 1.0, 1.0)
        implied, bound = implied_psi_squared("signed", u, v, v_c, 1.0, 1.0)
        assert implied[~bound] == pytest.approx(psi[~bound])
