"""An axle answers its opening later, by which its rate per opening must not seem to change."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.clearing.axle_rates import rates_of
from diagnosis.clearing.cells import Cells
from diagnosis.clearing.still import rate_of
from diagnosis.clearing.valve_lag import delayed, in_time, misfit
from tests.diagnosis.clearing.missions import in_cells, simulated

Array = NDArray[np.float64]

_DT = 0.1


def _strokes(size: int, axles: int = 2) -> Array:
    """Openings in short strokes of different length and size, shape (cells, axles)."""
    rng = np.random.default_rng(3)
    out = np.zeros((size, axles))
    for j in range(axles):
        at = 5
        while at < size - 20:
            length = int(rng.integers(4, 16))
            out[at : at + length, j] = rng.uniform(0.15, 0.6) * rng.choice([-1.0, 1.0])
            at += length + int(rng.integers(5, 20))
    return out


def _turned(opening: Array, delay_s: float, lag_s: float, gain: float | Array = 0.5) -> Array:
    late = delayed(opening, _DT, delay_s, lag_s)
    return gain * np.sign(late) * np.maximum(np.abs(late) - 0.06, 0.0)


@pytest.mark.parametrize(("delay_s", "lag_s"), [(0.0, 0.0), (0.1, 0.1), (0.3, 0.0)])
def test_openings_come_as_late_as_axles_answer_them(delay_s: float, lag_s: float) -> None:
    opening = _strokes(800)
    use = np.ones(opening.shape, np.bool_)
    found = in_time(_turned(opening, delay_s, lag_s), opening, use, _DT)
    np.testing.assert_allclose(found, delayed(opening, _DT, delay_s, lag_s), atol=1e-12)
    assert misfit(_turned(opening, delay_s, lag_s), found, use) < 0.02


def test_a_delay_between_cells_is_a_share_of_two_and_a_lag_is_of_first_order() -> None:
    step = np.r_[np.zeros(10), np.ones(30)][:, np.newaxis]
    assert delayed(step, _DT, 0.05, 0.0)[9:12, 0] == pytest.approx([0.0, 0.5, 1.0])
    naive = np.zeros(40)  # the lag stepped cell by cell
    for k in range(1, 40):
        naive[k] = np.exp(-0.5) * naive[k - 1] + (1.0 - np.exp(-0.5)) * step[k, 0]
    np.testing.assert_allclose(delayed(step, _DT, 0.0, 0.2)[:, 0], naive, atol=1e-12)


def test_what_is_not_known_stays_unknown_and_makes_nothing_after_it() -> None:
    opening = np.full((60, 1), 0.4)
    opening[20:30] = np.nan
    found = delayed(opening, _DT, 0.2, 0.0)[:, 0]
    assert np.isnan(found[20:32]).all()
    assert found[32:] == pytest.approx(0.4)
    assert misfit(np.zeros((60, 1)), opening, np.isfinite(opening)) == np.inf  # nothing turns


def test_a_small_opening_is_fitted_with_the_dead_bands_that_it_is_beyond() -> None:
    opening = 0.2 * _strokes(800)  # up to 0.12, less than the widest dead band that is tried
    rate = 0.5 * delayed(opening, _DT, 0.1, 0.0)
    np.testing.assert_allclose(
        in_time(rate, opening, np.ones(opening.shape, np.bool_), _DT), delayed(opening, _DT, 0.1, 0.0)
    )


def _cells(lost: float) -> tuple[Cells, Array, Array]:
    """A mission's cells, and openings and rates of two axles that answer late; the first axle loses a share for 8 s."""
    cells = in_cells(simulated(), base=True)
    opening = _strokes(cells.size)
    gain = np.full(opening.shape, 0.5)
    gain[200:280, 0] *= 1.0 - lost
    return cells, rate_of(np.cumsum(_turned(opening, 0.1, 0.1, gain), axis=0) * _DT, cells.dt), opening


def test_a_valve_that_answers_late_does_not_change_from_stroke_to_stroke() -> None:
    cells, rate, opening = _cells(0.0)
    assert cells.dt == pytest.approx(_DT)
    assert np.nanmax(np.abs(rates_of(cells, rate, opening).off)) < 0.15


def test_a_loss_of_one_axle_for_some_seconds_still_shows() -> None:
    cells, rate, opening = _cells(0.4)
    off = np.abs(rates_of(cells, rate, opening).off)
    assert np.nanmax(off[:, 0]) > 0.3
    assert np.nanmax(off[:, 1]) < 0.15
