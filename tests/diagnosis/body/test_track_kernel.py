"""The smoother of the body's speed against one least-squares problem over all states and samples at once."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from diagnosis.body.track_kernel import STATES, TrackInput, TrackModel, TrackOutput, filter_track, smooth_track

Array = np.ndarray
MODEL = TrackModel(wander=0.01, memory=2.0, mount=0.5, scale=0.02)
DT = 0.1


def seen(n: int, seed: int = 0) -> TrackInput:
    rng = np.random.default_rng(seed)
    rows = np.zeros((n, STATES))
    rows[:, 0], rows[:, 2] = 1.0, -np.cumsum(rng.normal(0, 0.05, n))
    z = np.cumsum(rng.normal(0, 0.02, n))
    z[rng.random(n) < 0.3] = np.nan
    z[0] = 0.0
    return TrackInput(z, np.full(n, 0.02), rows, rng.normal(0.03, 0.01, n), np.linspace(0.02, 0.1, n), DT)


def output(n: int) -> TrackOutput:
    mean, cov = np.zeros((n, STATES)), np.zeros((n, STATES, STATES))
    return TrackOutput(mean, cov, mean.copy(), cov.copy(), np.zeros(n), np.zeros(n, dtype=np.bool_))


def at_once(x: TrackInput, k: TrackModel) -> tuple[Array, Array]:
    """Posterior of [e₀…, β₀…, a, c] by normal equations of priors, motion and samples."""
    n = x.z.size
    keep = np.exp(-x.dt / k.memory)
    rows, values, weights = [], [], []

    def say(entries: dict[int, float], value: float, std: float) -> None:
        row = np.zeros(2 * n + 2)
        for place, factor in entries.items():
            row[place] = factor
        rows.append(row)
        values.append(value)
        weights.append(1 / std)

    mount, scale = 2 * n, 2 * n + 1
    say({0: 1.0}, 0.0, 100.0)
    say({n: 1.0}, 0.0, 1.0)
    say({mount: 1.0}, 0.0, k.mount)
    say({scale: 1.0}, 0.0, k.scale)
    for i in range(1, n):
        say({i: 1.0, i - 1: -1.0, n + i - 1: -x.off[i] * x.dt, scale: -x.moved[i]}, 0.0, k.wander * np.sqrt(x.dt))
        say({n + i: 1.0, n + i - 1: -keep}, 0.0, np.sqrt(1 - keep**2))
    for i in range(n):
        if np.isfinite(x.z[i]):
            h = x.rows[i]
            say({i: h[0], n + i: h[1], mount: h[2], scale: h[3]}, x.z[i], x.noise[i])
    A = np.array(rows) * np.array(weights)[:, None]
    b = np.array(values) * np.array(weights)
    cov = np.linalg.inv(A.T @ A)
    return cov @ A.T @ b, cov


def test_smoothed_state_is_that_of_all_samples_at_once() -> None:
    n = 25
    x, out = seen(n), output(n)
    filter_track(x, MODEL, out)
    mean, cov = smooth_track(x, MODEL, out)
    expected, spread = at_once(x, MODEL)
    assert_allclose(mean[:, 1], expected[n : 2 * n], atol=1e-6)
    assert_allclose(cov[:, 1, 1], np.diag(spread)[n : 2 * n], rtol=1e-5)
    assert_allclose(mean[:, 2], expected[2 * n], atol=1e-6)
    assert_allclose(mean[:, 3], expected[2 * n + 1], atol=1e-6)


def test_speed_measured_directly_is_smoothed_as_well() -> None:
    n = 15
    x = seen(n, seed=3)
    rows = np.zeros((n, STATES))
    rows[:, 1], rows[:, 3] = x.off, 0.3
    x, out = x._replace(rows=rows), output(n)
    filter_track(x, MODEL, out)
    mean, _ = smooth_track(x, MODEL, out)
    assert_allclose(mean[:, 1], at_once(x, MODEL)[0][n : 2 * n], atol=1e-6)


def test_jump_of_the_position_is_no_speed() -> None:
    n = 60
    x = seen(n)._replace(z=np.random.default_rng(1).normal(0, 0.02, n))
    x.z[30:] += 40.0
    out = output(n)
    filter_track(x, MODEL, out)
    mean, _ = smooth_track(x, MODEL, out)
    assert np.flatnonzero(out.jumped).tolist() == [30]
    assert np.abs(x.off * mean[:, 1]).max() < 0.1
