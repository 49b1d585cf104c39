"""The compiled [δ, δ̄] scan against filterpy, stepped sample by sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.estimation.gain_bias import GainBiasModel, GainBiasTrack, gain_bias_filter, track_gain_bias

MODEL = GainBiasModel(noise=0.004, gain_walk=0.3, bias_walk=0.05, gain_std=0.3, bias_std=0.1, relax_s=5.0, dt=0.01)
FIELDS = ("delta", "delta_std", "bias", "bias_std", "innovation", "innovation_std")
Array = np.ndarray


def channel(n: int = 600, seed: int = 1) -> tuple[Array, Array, Array]:
    """A speed that halves after half of the time, with lost samples; y, x, use."""
    rng = np.random.default_rng(seed)
    x = 0.3 * np.sin(np.arange(n) * MODEL.dt)
    y = np.where(np.arange(n) < n // 2, 1.0, 0.5) * x + MODEL.noise * rng.normal(size=n)
    use = rng.random(n) > 0.3
    use[100:160] = False
    y[~use] = np.nan
    return y, x, use


def stepped(kf: KalmanFilter, y: Array, x: Array, use: Array) -> dict[str, Array]:
    rows = []
    for k in range(y.size):
        kf.predict()
        kf.H = np.array([[x[k], 1.0]])
        kf.update(y[k] - x[k] if use[k] else None)
        innovation = (kf.y[0, 0], np.sqrt(kf.S[0, 0])) if use[k] else (np.nan, np.nan)
        rows.append((1 + kf.x[0, 0], np.sqrt(kf.P[0, 0]), kf.x[1, 0], np.sqrt(kf.P[1, 1]), *innovation))
    return dict(zip(FIELDS, np.array(rows).T, strict=True))


def check(track: GainBiasTrack, expected: dict[str, Array]) -> None:
    for name in FIELDS:
        assert_allclose(getattr(track, name), expected[name], rtol=1e-9, atol=1e-12, err_msg=name)


@pytest.mark.parametrize(
    "model",
    [
        MODEL,
        replace(MODEL, relax_s=0.2, gain_walk=2.0),
        replace(MODEL, noise=0.5, bias_walk=0.0, gain_walk=0.0),
        replace(MODEL, dt=0.001, bias_std=3.0),
    ],
)
def test_scan_is_filterpy_sample_by_sample(model: GainBiasModel) -> None:
    y, x, use = channel()
    check(track_gain_bias(y, x, use, model), stepped(gain_bias_filter(model), y, x, use))


def test_the_model_itself() -> None:
    kf = gain_bias_filter(MODEL)
    decay = np.exp(-0.01 / 5.0)
    assert_allclose(kf.F, [[decay, 0], [0, decay]])
    assert_allclose(kf.Q, [[0.3**2 * 0.01, 0], [0, 0.05**2 * 0.01]])
    assert_allclose(kf.P, [[0.09, 0], [0, 0.01]])
    assert_allclose(kf.R, [[0.004**2]])


def test_blocks_are_the_whole() -> None:
    y, x, use = channel()
    whole = track_gain_bias(y, x, use, MODEL)
    state, parts = None, []
    for block in np.split(np.arange(y.size), [1, 130, 131, 400]):
        part = track_gain_bias(y[block], x[block], use[block], MODEL, state)
        state = part.state
        parts.append(part)
    for name in FIELDS:
        assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))
    assert_array_equal(parts[-1].state, whole.state)


def test_gain_is_followed() -> None:
    y, x, use = channel(3000)
    track = track_gain_bias(y, x, use, MODEL)
    late = slice(2700, 3000)
    assert np.abs(track.delta[late] - 0.5).max() < 5 * track.delta_std[late].max()
    assert np.abs(track.delta[1200:1500] - 1.0).mean() < 0.1


def test_nothing_known_relaxes_to_no_fault() -> None:
    n = 5000
    y, x, use = channel(n)
    use[1000:] = False
    track = track_gain_bias(y, x, use, MODEL)
    assert track.delta[-1] == pytest.approx(1.0, abs=1e-3)
    assert np.isnan(track.innovation[1000:]).all()
    # in the steady state of the walk: q/(1 − f²)
    assert track.delta_std[-1] == pytest.approx(np.sqrt(0.3**2 * 0.01 / (1 - np.exp(-2 * 0.01 / 5))), rel=1e-3)


def test_values_not_used_are_not_looked_at() -> None:
    y, x, use = channel()
    other_y, other_x = np.where(use, y, 9e9), np.where(use, x, np.nan)
    expected = track_gain_bias(y, x, use, MODEL)
    got = track_gain_bias(other_y, other_x, use, MODEL)
    for name in FIELDS:
        assert_array_equal(getattr(got, name), getattr(expected, name))
