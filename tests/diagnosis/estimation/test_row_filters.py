"""The rows as filterpy's filters: one definition, equal to the compiled recursions; onsets found by them alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.channels.sample_status import PAIR
from diagnosis.estimation.fault_models import FIRST_NOISY, GAIN, MODELS, ROW_OF_MODEL, VALUE_ROWS, ModeModel
from diagnosis.estimation.filter_kernel import FilterState, segment_evidence
from diagnosis.estimation.joined_filters import Course, likelihoods
from diagnosis.estimation.row_filters import RowFilter, models_of
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.second_onset import Readings, Second, channel_model, second_onsets
from diagnosis.estimation.viterbi import forward, initial_state
from replay.faults import State

MODEL = ModeModel(noise=0.004, constant_noise=0.0005, tolerance=0.005, span=0.8, switch_cost=13.0, dt=0.001)
FLOOR = -18.0 - np.log(MODEL.span)


def second_onset(y: np.ndarray, x: np.ndarray, model: ModeModel, state: State) -> Second | None:
    (found,) = second_onsets([Readings(y, x, model, state)])
    return found


def signals(seed: int, n: int = 160) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    t = np.arange(n) * MODEL.dt
    x = 0.2 * np.sin(2 * np.pi * t / 0.3) + 0.1
    return x, 0.7 * x + 0.01 * rng.normal(size=n)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_row_has_the_evidence_of_the_compiled_filters(seed: int) -> None:
    x, y = signals(seed)
    n = x.size
    mine = np.full(int(ROW_OF_MODEL.max()) + 1, -np.inf)
    for m in range(MODELS):
        one = RowFilter(m, MODEL)
        cost = MODEL.drift_cost if m >= FIRST_NOISY else 0.02 * (ROW_OF_MODEL[m] != 0)
        total = sum(max(one.step(a, b), FLOOR) - cost for a, b in zip(y, x, strict=True))
        mine[ROW_OF_MODEL[m]] = max(mine[ROW_OF_MODEL[m]], total)
    samples = Samples.even(y, x, np.full(n, PAIR, np.int8), np.zeros(n, np.bool_))
    assert_allclose(segment_evidence(samples, MODEL), mine[:5], rtol=1e-9)


def test_filters_that_are_stepped_together_give_what_each_gives_alone() -> None:
    courses = []
    for seed, n in ((1, 160), (2, 90), (3, 157)):
        x, y = signals(seed, n)
        courses += [Course(m, MODEL, y, x) for m in range(MODELS)]
    for course, found in zip(courses, likelihoods(courses), strict=True):
        one = RowFilter(course.m, course.model)
        alone = [one.step(float(a), float(b)) for a, b in zip(course.y, course.x, strict=True)]
        assert_allclose(found, alone, rtol=1e-9)


def test_gains_are_those_of_the_compiled_filter() -> None:
    x, y = signals(4)
    one, state = RowFilter(GAIN, MODEL), initial_state(MODEL)
    for k in range(y.size):
        level = FilterState(np.zeros(MODELS), state.mean, state.cov)
        part = Samples.even(y[k : k + 1], x[k : k + 1], np.full(1, PAIR, np.int8), np.zeros(1, np.bool_))
        _, state = forward(part, MODEL, level)
        one.step(float(y[k]), float(x[k]))
    assert one.gain[0] == pytest.approx(state.mean[GAIN, 0], rel=1e-9)
    assert one.gain[1] == pytest.approx(np.sqrt(state.cov[GAIN, 0]), rel=1e-9)


def test_rows_have_their_models() -> None:
    assert [len(models_of(k)) for k in range(5)] == [2, 1, 1, 1, 7]
    assert all(models_of(row) for row in VALUE_ROWS)


@pytest.mark.parametrize("at", [40, 97, 150])
@pytest.mark.parametrize("state", [State.STUCK, State.NO_SIGNAL, State.INEFFICIENT, State.NOISY])
def test_an_onset_is_found_to_the_sample(state: State, at: int) -> None:
    rng = np.random.default_rng(at)
    t = np.arange(200) * 0.01
    x = 0.5 * np.sin(2 * np.pi * t / 1.7) + 0.7
    y = x + 0.004 * rng.normal(size=t.size)
    if state is State.STUCK:
        y[at:] = y[at] + 0.3
    elif state is State.NO_SIGNAL:
        y[at:] = 0.0
    elif state is State.INEFFICIENT:
        y[at:] = 0.6 * x[at:] + 0.004 * rng.normal(size=t.size - at)
    else:
        y[at:] += 0.2 * rng.normal(size=t.size - at)
    y[60:64] = np.nan
    found = second_onset(y, x, channel_model(0.004, y[max(at, 64) :], x[max(at, 64) :], 0.01), state)
    assert found is not None
    assert abs(found.place - at) <= (3 if state is State.NOISY else 1)


def test_healthy_readings_have_no_onset() -> None:
    x = 0.5 + 0.1 * np.sin(np.arange(200) * 0.1)
    y = x + 0.004 * np.random.default_rng(1).normal(size=200)
    for state in (State.STUCK, State.NO_SIGNAL, State.INEFFICIENT):
        assert second_onset(y, x, channel_model(0.004, y, x, 0.01), state) is None
    assert second_onset(y[:4], x[:4], channel_model(0.004, y, x, 0.01), State.STUCK) is None
