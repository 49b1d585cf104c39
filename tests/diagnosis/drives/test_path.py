"""The path of rows over a grid of faults: against a plain recursion, in blocks, and as densities."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.sample_status import BLIND, PAIR, SILENT, SKIP
from diagnosis.drives.kernel import emission
from diagnosis.drives.models import EPSILON, HALF_STEP, ROW, STATES, RowModel
from diagnosis.drives.path import SpeedSamples, forward, initial_state, most_probable, state_evidence
from diagnosis.estimation.back_pointers import STAY
from diagnosis.estimation.fault_models import HEALTHY, INEFFICIENT, NO_SIGNAL, NOISY, STUCK

Array = NDArray[np.float64]

MODEL = RowModel(noise=0.1, core=0.02, exact=0.6, constant_noise=0.002, span=10.0, switch_cost=8.0)


def one(m: int, y: float, x: float, last: float, status: int = PAIR, quiet: bool = False) -> float:
    return float(emission(m, y, x, 0.0, last, np.int8(status), quiet, MODEL.disturbance, MODEL.grid_noise()))


def beside(y: Array, x: Array, status: NDArray[np.int8], quiet: NDArray[np.bool_]) -> SpeedSamples:
    """Samples whose reading is never out for long."""
    return SpeedSamples(y, x, np.zeros(y.size), status, quiet)


def sample(seed: int, size: int = 300) -> tuple[Array, Array, NDArray[np.int8], NDArray[np.bool_]]:
    rng = np.random.default_rng(seed)
    x = 4 + np.cumsum(rng.normal(0, 0.05, size))
    y = x + np.where(rng.random(size) < 0.6, 0.02, 0.155) * rng.standard_normal(size)
    status = np.full(size, PAIR, dtype=np.int8)
    status[::7] = SKIP
    return y, x, status, np.zeros(size, dtype=np.bool_)


def test_the_scan_is_viterbis_recursion() -> None:
    y, x, status, quiet = sample(1, 80)
    y[40:] = 0.8 * y[40:]
    back, lead, state = forward(beside(y, x, status, quiet), MODEL, initial_state(MODEL))
    score = initial_state(MODEL).score.copy()
    last = float("nan")
    for k in range(y.size):
        if status[k] != SKIP:
            best = int(np.argmax(score))
            noisy = int(np.flatnonzero(ROW == NOISY)[np.argmax(score[ROW == NOISY])])
            entry = np.full(STATES, score[best] - MODEL.switch_cost)
            entry = np.where(ROW == NOISY, np.maximum(entry, score[noisy] - 4.0), entry)
            score = np.maximum(score, entry) + [one(m, y[k], x[k], last) for m in range(STATES)]
            assert lead[k] == pytest.approx(score[1:].max() - score[0])
            last = float(y[k])
    assert state.score - state.score.max() == pytest.approx(score - score.max())
    assert (back[status == SKIP] == STAY).all()


@pytest.mark.parametrize("cut", [1, 57, 140, 299])
def test_blocks_change_nothing(cut: int) -> None:
    y, x, status, quiet = sample(2)
    y[120:180] = y[119]
    whole = forward(beside(y, x, status, quiet), MODEL, initial_state(MODEL))
    head = forward(beside(y, x, status, quiet).part(0, cut), MODEL, initial_state(MODEL))
    tail = forward(beside(y, x, status, quiet).part(cut, 300), MODEL, head[2])
    assert np.array_equal(whole[0], np.r_[head[0], tail[0]])
    assert whole[2].score == pytest.approx(tail[2].score)


def test_every_state_has_its_values() -> None:
    assert {STATES} == {values.size for values in (ROW, EPSILON, HALF_STEP, MODEL.bias, MODEL.added)}
    inefficient = ROW == INEFFICIENT
    assert (np.diff(EPSILON[inefficient]) > 0).all()
    assert (HALF_STEP[inefficient] > 0).all()


@pytest.mark.parametrize("m", [0, 10, 40, STATES - 25, STATES - 1])
def test_a_state_is_a_density(m: int) -> None:
    tail = np.geomspace(20.0, 200.0, 1_000)
    y = np.r_[-tail[:0:-1], np.arange(-20.0, 20.0, 0.004), tail]
    density = np.exp([one(m, float(v), 4.0, np.nan) for v in y])
    assert float(np.trapezoid(density, y)) == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        (STUCK, lambda y, rng: np.full(y.size, y[0])),
        (NO_SIGNAL, lambda y, rng: np.zeros(y.size)),
        (INEFFICIENT, lambda y, rng: 0.9 * y),
        (NOISY, lambda y, rng: 0.9 * y + 0.1 * rng.normal(2, 3, y.size)),
    ],
)
def test_each_row_is_found_where_it_is(row: int, fault) -> None:  # type: ignore[no-untyped-def]
    y, x, status, quiet = sample(3)
    status[:] = PAIR
    y[100:200] = fault(y[100:200], np.random.default_rng(4))
    path, lead = most_probable(beside(y, x, status, quiet), MODEL)
    truth = np.where((np.arange(300) >= 100) & (np.arange(300) < 200), row, HEALTHY)
    assert np.count_nonzero(path != truth) <= 3
    assert (lead[20:100] < 0).all()
    assert (lead[120:200] > 0).all()


def test_standing_still_at_zero_is_no_fault() -> None:
    size = 200
    y, x = np.zeros(size), np.zeros(size)
    path, _ = most_probable(beside(y, x, np.full(size, PAIR, dtype=np.int8), np.ones(size, dtype=np.bool_)), MODEL)
    assert (path == HEALTHY).all()


def test_without_a_reference_only_a_constant_reading_is_a_fault() -> None:
    y, x, status, quiet = sample(5)
    status[:] = BLIND
    x[:] = np.nan
    assert (most_probable(beside(y, x, status, quiet), MODEL)[0] == HEALTHY).all()
    y[150:] = y[150]
    path, _ = most_probable(beside(y, x, status, quiet), MODEL)
    assert (path[:150] == HEALTHY).all()
    assert (path[152:] == STUCK).all()


def test_a_silent_channel_beside_living_ones_is_no_signal() -> None:
    y, x, status, quiet = sample(6)
    y[100:], status[100:] = np.nan, SILENT
    assert (most_probable(beside(y, x, status, quiet), MODEL)[0][110:] == NO_SIGNAL).all()


def test_evidence_of_a_segment_adds_up_its_samples() -> None:
    y, x, status, quiet = sample(7, 20)
    got = state_evidence(beside(y, x, status, quiet), MODEL, 3.0)
    last, total = 3.0, np.zeros(STATES)
    for k in np.flatnonzero(status == PAIR):
        total += [one(m, y[k], x[k], last) for m in range(STATES)]
        last = float(y[k])
    assert got == pytest.approx(total)
