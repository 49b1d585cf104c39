"""What a steering plant gives in windows: derivatives by its constants, openings of coarser blocks, and a lag."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from diagnosis.steering.valve_map import ValveMap
from diagnosis.steering.windows import Windows, lagged

CONSTANTS = np.array([1.0, 1.2, 0.03, 0.02, 0.25, 0.2, 0.06, 0.002])


def windows(seed: int = 0) -> Windows:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(0.0, 0.3, 120), 20) * np.sin(np.arange(2400) / 70)
    none = np.zeros(95)
    pace = 1.0 - 0.3 * np.exp(-np.arange(2400) / 500)
    return Windows(none, u, pace, none, none == 0, 25, 0.01, 0.0)


def rates(x: np.ndarray) -> np.ndarray:
    return windows().predicted(ValveMap(*x[:6]), x[6], x[7])


@pytest.mark.parametrize("constant", range(8))
def test_derivatives_are_those_of_finite_differences(constant: int) -> None:
    predicted, slopes = windows().slopes(ValveMap(*CONSTANTS[:6]), CONSTANTS[6], CONSTANTS[7])
    length = {2: 1e-4, 3: 1e-4, 7: 5e-5}.get(constant, 1e-7)
    step = np.where(np.arange(8) == constant, length, 0.0)
    seen = (rates(CONSTANTS + step) - rates(CONSTANTS)) / length
    assert_allclose(predicted, rates(CONSTANTS), rtol=1e-12)
    scale = np.abs(seen).max()
    assert scale > 0
    # where the play or a limit hands over within the step the difference is of both sides
    assert np.mean(np.abs(seen - slopes[:, constant]) < 1e-4 * scale) > 0.9


def test_motions_that_are_rounding_bend_no_derivative() -> None:
    """A valve without dead band at rest: whether its opening is a little above or below 0 says nothing."""
    valve, moving = ValveMap(1.0, 1.0, 0.0, 0.0, 1.0, 1.0), windows()
    still = np.where(np.arange(moving.u.size) > 400, 0.0, moving.u)
    noise = 1e-17 * np.random.default_rng(1).normal(size=still.size)
    plain, noisy = (replace(moving, u=u).slopes(valve, 0.06, 0.0)[1] for u in (still, still + noise))
    assert_allclose(noisy, plain, atol=1e-9)


def test_coarser_openings_give_about_the_same_rates() -> None:
    valve = ValveMap(*CONSTANTS[:6])
    fine, coarse = (w.predicted(valve, 0.06, 0.002) for w in (windows(), windows().coarser(5)))
    assert windows().coarser(5).u.size == windows().u.size // 5
    assert np.abs(fine - coarse).max() < 0.1 * np.abs(fine).max()
    assert windows().coarser(4).length == 25


@pytest.mark.parametrize("decay", [0.0, 0.3, 0.95, 1.0])
def test_a_lag_is_scipys_filter_to_the_last_digit(decay: float) -> None:
    x = np.random.default_rng(3).normal(size=500)
    np.testing.assert_array_equal(lagged(x, decay), lfilter([1.0 - decay], [1.0, -decay], x))
