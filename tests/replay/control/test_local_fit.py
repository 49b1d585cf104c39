"""Gains from short windows: λ whatever Ψ̂ does, and the three gains of a PI controller with feed-forward."""

from __future__ import annotations

import numpy as np
import pytest

from replay.control.local_fit import PiFit, fit_pi, local_lambda, spread_windows

DT = 0.002
N = 60_000
Array = np.ndarray


def drive(seed: int = 0) -> tuple[Array, Array]:
    """Speed and command of a wheel that is driven forward and backward."""
    rng = np.random.default_rng(seed)
    t = np.arange(N) * DT
    v_c = 0.25 * np.sin(0.4 * t) + 0.05 * np.sin(1.7 * t)
    lag = np.convolve(rng.normal(size=N), np.ones(50) / 50, "same")
    return v_c * 0.95 + 0.02 * lag + 0.003 * rng.normal(size=N), v_c


@pytest.mark.parametrize("law", ["signed", "opposed", "sign_abs", "printed"])
def test_lambda_whatever_is_added_slowly(law: str) -> None:
    v, v_c = drive()
    psi_squared = 0.1 + 0.05 * np.sin(0.9 * np.arange(N) * DT)
    e = v - v_c
    part = {"printed": np.abs(v_c) - np.abs(v)}.get(law, v_c - v)
    if law == "sign_abs":
        part = np.where(v_c < 0, -1.0, 1.0) * (np.abs(v_c) - np.abs(v))
    sign = {"opposed": -np.sign(e), "printed": np.ones(N)}.get(law, np.where(v_c < 0, -1.0, 1.0))
    u = 1.7 * part + sign * psi_squared
    assert local_lambda(law, u, v, v_c, DT, 1.0) == pytest.approx(1.7, rel=0.003)


def test_lambda_of_too_short_a_log_is_not_known() -> None:
    v, v_c = drive()
    assert np.isnan(local_lambda("signed", v[:100], v[:100], v_c[:100], DT, 1.0))


def pi_command(v: Array, v_c: Array, ff: float, kp: float, ki: float) -> Array:
    e = v - v_c
    return np.asarray(ff * v_c - kp * e - ki * np.cumsum(e) * DT)


def test_gains_of_a_pi_controller() -> None:
    pairs = [drive(seed) for seed in range(3)]
    v, v_c = (np.column_stack(x) for x in zip(*pairs, strict=True))
    u = np.column_stack([pi_command(a, b, 0.4, 0.15, 0.6) for a, b in pairs])
    u[1000:1300, 1] = np.nan
    found = fit_pi(u, v, v_c, DT, 1.0, 0.05)
    assert found is not None
    assert (found.feed_forward, found.kp, found.ki) == pytest.approx((0.4, 0.15, 0.6), rel=0.01)
    assert found.explained > 0.999
    assert "0.4·v_c" in found.text


def test_noise_is_no_pi_controller() -> None:
    v, v_c = drive()
    u = 0.1 * np.random.default_rng(5).normal(size=(N, 1))
    found = fit_pi(u, v[:, None], v_c[:, None], DT, 1.0, 0.05)
    assert found is not None
    assert found.explained < 0.05


def test_a_machine_that_stands_shows_no_controller() -> None:
    assert fit_pi(np.zeros((N, 2)), np.zeros((N, 2)), np.zeros((N, 2)), DT, 1.0, 0.05) is None


def test_windows_are_whole_and_within() -> None:
    for size, length in ((105, 10), (10**6, 100), (9, 10)):
        places = spread_windows(size, length)
        assert places.shape[1] == length
        assert places.size == 0 or (places.max() < size and np.all(np.diff(places, axis=1) == 1))
        assert len(np.unique(places)) == places.size


def test_the_sign_of_a_gain_stands_between_the_terms() -> None:
    assert PiFit(1.28, 2.0, 0.5, (0.0, 0.0, 0.0), 0.9).text == "u = 1.28·v_c − 2·e − 0.5·∫e dt"
    assert PiFit(1.28, -0.875, 0.733, (0.0, 0.0, 0.0), 0.9).text == "u = 1.28·v_c + 0.875·e − 0.733·∫e dt"
