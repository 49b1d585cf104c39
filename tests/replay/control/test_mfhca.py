"""L15, L16 and L17: decay and forcing against numerical integration, the implied Ψ̂² as inverse of the law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from replay.control import mfhca

LAWS = tuple(mfhca.LAW_TEXT)
XI, BETA = 1.0, 0.001
Array = np.ndarray


def integrate(rate: Array, forcing: Array, dt: float, psi0: float) -> Array:
    """Ψ̂' = −ρΨ̂ + w with ρ and w held over each step, step by step by a general solver."""
    psi, out = psi0, []
    for rho, w in zip(rate, forcing, strict=True):
        out.append(psi)
        step = solve_ivp(lambda _, p, rho=rho, w=w: -rho * p + w, (0.0, dt), [psi], rtol=1e-11, atol=1e-14)
        psi = float(step.y[0, -1])
    return np.array(out)


def test_decay_rate() -> None:
    rho = mfhca.decay_rate(np.array([0.2, -0.2, 0.0]), np.array([-0.3, 0.3, 0.0]), XI, BETA)
    assert_allclose(rho, [1.501, 1.501, 1.001])


def test_printed_decay_at_constant_speed_is_the_closed_form() -> None:
    dt, t = 0.001, np.arange(10_001) * 0.001
    rho = mfhca.decay_rate(np.full(t.size, 0.2), np.full(t.size, 0.2), XI, BETA)
    decay, total = mfhca.printed_decay(rho, dt)
    assert_allclose(decay, np.exp(-1.401 * t), rtol=1e-10)
    assert total == pytest.approx(1.401 * 10.001)
    # as printed nothing can be left of Ψ̂ after 10 s at standstill speeds and above
    assert mfhca.printed_decay(np.full(t.size, 1.001), dt)[0][-1] == pytest.approx(4.5e-5, rel=0.01)


def test_printed_decay_is_the_integral_of_the_printed_law() -> None:
    dt, t = 0.05, np.arange(60) * 0.05
    rho = mfhca.decay_rate(0.3 * np.sin(t), 0.3 * np.cos(t), XI, BETA)
    assert_allclose(0.4 * mfhca.printed_decay(rho, dt)[0], integrate(rho, np.zeros(60), dt, 0.4), rtol=1e-9)


def test_printed_decay_in_blocks_is_the_whole() -> None:
    rho = 1.0 + np.random.default_rng(2).random(500)
    whole, total = mfhca.printed_decay(rho, 0.01)
    first, carried = mfhca.printed_decay(rho[:123], 0.01)
    second, stop = mfhca.printed_decay(rho[123:], 0.01, carried)
    assert_allclose(np.r_[first, second], whole, rtol=1e-12)
    assert stop == pytest.approx(total)


def test_unknown_rate_counts_as_the_last_one() -> None:
    rho = np.array([2.0, np.nan, np.nan, 3.0])
    assert_allclose(mfhca.printed_decay(rho, 0.1)[0], np.exp([0.0, -0.2, -0.4, -0.6]))
    assert_array_equal(mfhca.fill_forward(np.array([np.nan, 1.0, np.nan]), 7.0), [7.0, 1.0, 1.0])


def test_forced_law_is_the_integral() -> None:
    zeta = 1000.0

    def largest_error(dt: float) -> float:
        t = np.arange(0, 2, dt)
        e = 0.03 * np.sin(3 * t)
        rho = 1.3 + 0.2 * np.sin(t)
        got, _ = mfhca.forced_psi(rho, e, dt, zeta, 0.1)
        exact = solve_ivp(
            lambda s, p: -(1.3 + 0.2 * np.sin(s)) * p + 0.5 * zeta * (0.03 * np.sin(3 * s)) ** 2,
            (0.0, 2.0),
            [0.1],
            t_eval=t,
            rtol=1e-10,
            atol=1e-12,
        ).y[0]
        return float(np.abs(got - exact).max())

    coarse, fine = largest_error(2e-3), largest_error(1e-3)
    assert fine < 3e-4  # Ψ̂ is about 0.2 here
    assert coarse / fine == pytest.approx(2.0, rel=0.05)  # first order in the step


def test_forced_law_without_error_decays_as_printed() -> None:
    rho = 1.0 + np.random.default_rng(3).random(200)
    for e in (np.zeros(200), np.full(200, np.nan)):
        got, _ = mfhca.forced_psi(rho, e, 0.01, 1000.0, 0.3)
        assert_allclose(got, 0.3 * mfhca.printed_decay(rho, 0.01)[0], rtol=1e-12)


def test_a_lead_lies_between_this_step_and_the_next() -> None:
    rng = np.random.default_rng(5)
    rho, e = 1.0 + rng.random(50), 0.05 * rng.normal(size=50)
    before, state = mfhca.forced_psi(rho, e, 0.01, 1000.0)
    after, same = mfhca.forced_psi(rho, e, 0.01, 1000.0, lead=1.0)
    half, _ = mfhca.forced_psi(rho, e, 0.01, 1000.0, lead=0.5)
    assert same == state
    assert_allclose(after, np.append(before[1:], state))
    assert_allclose(half, (before + after) / 2)


def test_forced_law_in_blocks_is_the_whole() -> None:
    rng = np.random.default_rng(4)
    rho, e = 1.0 + rng.random(400), 0.05 * rng.normal(size=400)
    whole, last = mfhca.forced_psi(rho, e, 0.01, 1000.0)
    psi, state = [], 0.0
    for part in np.split(np.arange(400), [1, 77, 300]):
        out, state = mfhca.forced_psi(rho[part], e[part], 0.01, 1000.0, state)
        psi.append(out)
    assert_array_equal(np.concatenate(psi), whole)
    assert state == last


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        # v, v_c, Ψ̂² = (0.2, 0.3), (−0.2, −0.3), (0.1, −0.3), λ = 2, Ψ̂² = 0.04
        ("signed", [0.2 + 0.04, -0.2 - 0.04, -0.8 - 0.04]),
        ("opposed", [0.2 + 0.04, -0.2 - 0.04, -0.8 - 0.04]),
        ("printed", [0.2 + 0.04, 0.2 + 0.04, 0.4 + 0.04]),
        ("sign_abs", [0.2 + 0.04, -0.2 - 0.04, -0.4 - 0.04]),
    ],
)
def test_readings_of_the_drive_command(law: str, expected: list[float]) -> None:
    v, v_c = np.array([0.2, -0.2, 0.1]), np.array([0.3, -0.3, -0.3])
    assert_allclose(mfhca.drive_command(law, v, v_c, np.full(3, 0.04), 2.0, 1.0), expected)


def test_signed_and_opposed_differ_beyond_the_command() -> None:
    v, v_c, psi = np.array([0.4, -0.4]), np.array([0.3, -0.3]), np.full(2, 0.05)
    assert_allclose(mfhca.drive_command("signed", v, v_c, psi, 1.0, 1.0), [-0.05, 0.05], atol=1e-15)
    assert_allclose(mfhca.drive_command("opposed", v, v_c, psi, 1.0, 1.0), [-0.15, 0.15], atol=1e-15)


SPEEDS = st.floats(-0.4, 0.4)


@given(
    law=st.sampled_from(LAWS),
    rows=st.lists(st.tuples(SPEEDS, SPEEDS, st.floats(-0.2, 0.5)), min_size=1, max_size=20),
    lambda_=st.floats(0.1, 20.0),
)
def test_implied_is_the_inverse_of_the_law(law: str, rows: list[tuple[float, float, float]], lambda_: float) -> None:
    v, v_c, squared = np.array(rows).T
    u = mfhca.drive_command(law, v, v_c, squared, lambda_, 100.0)
    got, bound = mfhca.implied_psi_squared(law, u, v, v_c, lambda_, 100.0)
    undefined = (v == v_c) if law == "opposed" else np.zeros(v.size, dtype=bool)
    assert_array_equal(np.isnan(got), undefined)
    assert_allclose(got[~undefined], squared[~undefined], atol=1e-12)
    assert not bound.any()


@pytest.mark.parametrize("law", LAWS)
def test_saturated_commands_give_bounds_only(law: str) -> None:
    v, v_c = np.array([0.1, 0.1, -0.1]), np.array([0.3, 0.3, -0.3])
    u = mfhca.drive_command(law, v, v_c, np.array([0.1, 5.0, 5.0]), 1.0, 0.5)
    assert np.abs(u).max() == 0.5
    got, bound = mfhca.implied_psi_squared(law, u, v, v_c, 1.0, 0.5)
    assert_array_equal(bound, [False, True, True])
    assert np.all(got[1:] < 5.0)


def test_negative_implied_values_are_kept() -> None:
    got, _ = mfhca.implied_psi_squared("signed", np.array([0.0]), np.array([0.1]), np.array([0.3]), 1.0, 1.0)
    assert_allclose(got, [-0.2])


def test_event_reset_follows_jumps_and_decays_between_them() -> None:
    dt, n = 0.01, 900
    rho = 1.2 + 0.3 * np.sin(np.arange(n) * dt)
    decay = mfhca.printed_decay(rho, dt)[0] ** 2
    squared = decay * np.repeat([0.1, 0.4, 1.5], 300) / np.repeat(decay[[0, 300, 600]], 300)
    psi, reset, _ = mfhca.event_reset_psi(rho, squared, dt)
    assert_array_equal(np.flatnonzero(reset), [302, 602])  # a jump must last three steps
    for part in (slice(0, 302), slice(302, 602), slice(602, n)):
        slope = np.diff(np.log(psi[part] ** 2)) / dt
        assert_allclose(slope, -2 * rho[part][:-1], rtol=1e-9)
    followed = np.r_[0:300, 302:600, 602:900]
    assert_allclose(psi[followed] ** 2, squared[followed], rtol=1e-9)


def test_event_reset_ignores_spikes_and_gaps() -> None:
    rho, implied = np.full(300, 1.0), 0.2 * np.exp(-2 * 0.01 * np.arange(300))
    spiky = implied.copy()
    spiky[100:102] += 1.0
    spiky[200:220] = np.nan
    psi, reset, _ = mfhca.event_reset_psi(rho, spiky, 0.01, threshold=0.01)
    assert not reset.any()
    assert_allclose(psi**2, implied, rtol=1e-9)
    late, *_ = mfhca.event_reset_psi(rho, np.r_[np.full(5, np.nan), implied[5:]], 0.01, threshold=0.01)
    assert_array_equal(np.isnan(late), np.arange(300) < 5)


def test_implied_forcing_is_zero_where_the_printed_law_ran() -> None:
    dt, n = 0.001, 3000
    rho = mfhca.decay_rate(0.3 * np.sin(np.arange(n) * dt), np.full(n, 0.3), XI, BETA)
    squared = 0.5 * mfhca.printed_decay(rho, dt)[0] ** 2
    forcing = mfhca.implied_forcing(squared, rho, dt)
    assert_array_equal(np.isnan(forcing), (np.arange(n) < 125) | (np.arange(n) >= n - 125))
    # the sum over the window stands for an integral: its error is ρ·dt of 2ρΨ̂²
    assert np.nanmax(np.abs(forcing) / (2 * rho * squared)) < 1.5 * rho.max() * dt


def test_implied_forcing_shows_what_forced_the_law() -> None:
    dt, n, zeta = 0.001, 3000, 1000.0
    rho, e = np.full(n, 1.4), np.full(n, 0.02)
    psi, _ = mfhca.forced_psi(rho, e, dt, zeta, 0.05)
    forcing = mfhca.implied_forcing(psi**2, rho, dt)
    # d(Ψ̂²)/dt = 2Ψ̂Ψ̂' = −2ρΨ̂² + ζe²Ψ̂
    inside = np.isfinite(forcing)
    assert_allclose(forcing[inside], (zeta * e**2 * psi)[inside], rtol=0.01)
    assert forcing[inside].min() > 0.02


def test_implied_forcing_is_unknown_beside_gaps() -> None:
    squared = np.full(1000, 0.1)
    squared[500] = np.nan
    forcing = mfhca.implied_forcing(squared, np.ones(1000), 0.001, window_s=0.1)
    assert_array_equal(np.flatnonzero(np.isnan(forcing[50:-50])) + 50, np.arange(450, 551))
    assert np.isnan(mfhca.implied_forcing(squared[:80], np.ones(80), 0.001, window_s=0.1)).all()


def test_start_value_is_found_again() -> None:
    decay = mfhca.printed_decay(np.full(500, 1.3), 0.01)[0]
    implied = (0.4 * decay) ** 2
    usable = np.ones(500, dtype=bool)
    assert mfhca.fit_psi0(decay, implied, usable) == pytest.approx(0.4)
    implied[100:200] = np.nan
    usable[:50] = False
    implied[:50] = 9.0  # saturated: bounds only
    assert mfhca.fit_psi0(decay, implied, usable) == pytest.approx(0.4)
    assert mfhca.fit_psi0(decay, -np.abs(implied), usable) == 0.0
    assert mfhca.fit_psi0(decay, implied, np.zeros(500, dtype=bool)) == 0.0


def test_steering_command() -> None:
    phi_c, phi = np.array([0.5, -0.5, 2.0, np.nan]), np.array([0.1, 0.1, 0.0, 0.0])
    assert_allclose(mfhca.steering_command(phi_c, phi, 1.5, 1.0), [0.6, -0.9, 1.0, np.nan])
