"""Rows of the fault table: Kalman filters against filterpy, the path against a naive twin, onsets to the sample."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.channels.sample_status import PAIR, SILENT, SKIP
from diagnosis.estimation.fault_models import (
    HEALTHY,
    INEFFICIENT,
    MODELS,
    NO_SIGNAL,
    NOISY,
    NOISY_MODELS,
    ROW_OF_MODEL,
    STUCK,
    ModeModel,
)
from diagnosis.estimation.filter_kernel import FilterState, segment_evidence
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.viterbi import forward, initial_state, most_probable
from diagnosis.results.fault_rows import ROWS

MODEL = ModeModel(
    noise=0.004, constant_noise=0.0005, tolerance=0.005, span=0.8, switch_cost=13.0, dt=0.001, own_cost=0.03
)
MISMATCH, FIRST_NOISY, MISMATCH_S = 4, 5, 0.05
Array = np.ndarray


def drive(n: int) -> Array:
    """A speed that changes all the time, also in sign."""
    t = np.arange(n) * MODEL.dt
    return 0.2 * np.sin(2 * np.pi * t / 3.0) + 0.1 * np.sin(2 * np.pi * t / 0.7 + 1.0)


def measured(x: Array, seed: int = 1) -> Array:
    return x + MODEL.noise * np.random.default_rng(seed).normal(size=x.size)


def pairs(n: int) -> Array:
    return np.full(n, PAIR, dtype=np.int8)


def busy(n: int) -> Array:
    return np.zeros(n, dtype=np.bool_)


class Filter:
    """One row of the table as a filterpy model of [δ or c, δ̄], built from the table's text."""

    def __init__(self, m: int, model: ModeModel) -> None:
        self.m, self.noise, self.kf = m, model.noise, KalmanFilter(dim_x=2, dim_z=1)
        kf, noise = self.kf, model.noise
        kf.F, kf.Q, kf.x, kf.P = np.eye(2), np.zeros((2, 2)), np.zeros((2, 1)), np.zeros((2, 2))
        self.row = lambda x: [x, 0.0]
        self.cost = 0.02 * (m in (STUCK, NO_SIGNAL, INEFFICIENT))
        if m == HEALTHY:  # y = x + n
            kf.x[0, 0] = 1.0
        elif m == STUCK:  # y = c
            kf.P[0, 0], noise = model.span**2, model.constant_noise
            self.row = lambda x: [1.0, 0.0]
        elif m == NO_SIGNAL:  # y = 0
            noise = model.constant_noise
            self.row = lambda x: [0.0, 0.0]
        elif m == INEFFICIENT:  # y = δ x + n, δ constant
            kf.x[0, 0], kf.P[0, 0] = 0.5, 0.3**2
        elif m == MISMATCH:  # y = x + b + n, b passing
            f = np.exp(-model.dt / MISMATCH_S)
            kf.x[0, 0], kf.P[1, 1] = 1.0, model.tolerance**2
            kf.F, kf.Q = np.diag([1.0, f]), np.diag([0.0, (1 - f * f) * model.tolerance**2])
            self.row = lambda x: [x, 1.0]
        else:  # y = δ x + δ̄ + n, δ̄ drifting or n of a larger power
            walk, power = NOISY_MODELS[m - FIRST_NOISY]
            kf.x[0, 0], kf.P = 0.6, np.diag([0.3**2, (0.3 * model.span) ** 2])
            kf.Q = np.diag([0.0, (walk * model.span) ** 2 * model.dt])
            noise *= power
            self.row = lambda x: [x, 1.0]
            self.cost = model.drift_cost + model.own_cost
        kf.R = np.array([[noise**2]])
        self.floor = -18.0 - np.log(model.span)

    def step(self, y: float, x: float) -> float:
        self.kf.predict()
        self.kf.H = np.array([self.row(x)])
        if self.m == INEFFICIENT:  # a gain above one raises a sensor's noise too
            self.kf.R = np.array([[self.noise**2 * max(1.0, self.kf.x[0, 0] ** 2)]])
        self.kf.update(y)
        return max(float(self.kf.log_likelihood), self.floor) - self.cost


def stepped(y: Array, x: Array, status: Array, model: ModeModel) -> tuple[Array, list[Filter]]:
    filters = [Filter(m, model) for m in range(MODELS)]
    evidence = np.zeros(MODELS)
    for k in range(y.size):
        if status[k] == PAIR:
            evidence += [f.step(y[k], x[k]) for f in filters]
    return evidence, filters


SIGNALS = {
    "healthy": lambda x, r: x + 0.004 * r.normal(size=x.size),
    "stuck": lambda x, r: np.full(x.size, 0.21),
    "no signal": lambda x, r: np.zeros(x.size),
    "inefficient": lambda x, r: 0.6 * x + 0.004 * r.normal(size=x.size),
    "drifting": lambda x, r: 0.7 * x + np.cumsum(0.002 * r.normal(size=x.size)),
    "noise-affected": lambda x, r: 0.7 * x + 0.05 * r.normal(size=x.size),
    "biased": lambda x, r: x + 0.03 + 0.004 * r.normal(size=x.size),
}


@pytest.mark.parametrize("name", SIGNALS)
def test_evidence_of_every_row_is_filterpys(name: str) -> None:
    x = drive(150)
    y = SIGNALS[name](x, np.random.default_rng(3))
    status = pairs(150)
    status[40:50] = SKIP
    y[40:50] = np.nan
    by_model, _ = stepped(y, x, status, MODEL)
    expected = [by_model[i == ROW_OF_MODEL].max() for i in range(5)]
    assert_allclose(segment_evidence(Samples.even(y, x, status, busy(150)), MODEL), expected, rtol=1e-9)


@pytest.mark.parametrize("name", SIGNALS)
def test_filter_of_every_model_is_filterpys(name: str) -> None:
    x = drive(120)
    y = SIGNALS[name](x, np.random.default_rng(4))
    filters = [Filter(m, MODEL) for m in range(MODELS)]
    state = initial_state(MODEL)
    for k in range(y.size):
        level = FilterState(np.zeros(MODELS), state.mean, state.cov)  # equal scores: no model is entered anew
        one = slice(k, k + 1)
        _, state = forward(Samples.even(y[one], x[one], pairs(1), busy(1)), MODEL, level)
        gain = np.array([f.step(y[k], x[k]) for f in filters])
        assert_allclose(state.score, gain - gain.max(), rtol=1e-9, atol=1e-9)
    for m, f in enumerate(filters):
        unknowns = slice(0, 1 if m == STUCK else 2)  # beside its value a stuck channel remembers what x was
        assert_allclose(state.mean[m, unknowns], f.kf.x[unknowns, 0], rtol=1e-9, atol=1e-12)
        # covariances of exact unknowns cancel to rounding
        assert_allclose(state.cov[m], f.kf.P[[0, 0, 1], [0, 1, 1]], rtol=1e-8, atol=1e-16)


def naive_path(y: Array, x: Array, model: ModeModel) -> tuple[list[int], Array]:
    """Viterbi with per-survivor filters, written for clarity: every model keeps its best entry."""
    scores = [0.0 if m == HEALTHY else -model.switch_cost / 2 for m in range(MODELS)]
    filters = [Filter(m, model) for m in range(MODELS)]
    histories: list[list[int]] = [[] for _ in range(MODELS)]
    filtered = []
    for k in range(y.size):
        best = max(range(MODELS), key=lambda m: (scores[m], -m))
        top, past = scores[best], list(histories[best])
        for m in range(MODELS):
            siblings = ROW_OF_MODEL[m] == ROW_OF_MODEL[best] and m != best
            cost = 3.0 if siblings else model.switch_cost
            settled = 0.0 if m in (HEALTHY, NO_SIGNAL) else 10.0  # a settled filter is kept that long
            if top - cost - settled > scores[m]:
                scores[m], filters[m], histories[m] = top - cost, Filter(m, model), list(past)
            histories[m].append(m)
        scores = [s + f.step(y[k], x[k]) for s, f in zip(scores, filters, strict=True)]
        scores = [s - max(scores) for s in scores]
        weights = np.exp(scores)
        filtered.append([weights[i == ROW_OF_MODEL].sum() / weights.sum() for i in range(5)])
    return histories[int(np.argmax(scores))], np.array(filtered)


@pytest.mark.parametrize("name", SIGNALS)
def test_path_is_the_naive_twins(name: str) -> None:
    x = drive(260)
    y = measured(x, 5)
    y[80:180] = SIGNALS[name](x, np.random.default_rng(6))[80:180]
    path = most_probable(Samples.even(y, x, pairs(260), busy(260)), MODEL)
    expected, filtered = naive_path(y, x, MODEL)
    assert_array_equal(path.model, expected)
    assert_allclose(path.filtered, filtered, rtol=1e-6, atol=1e-9)
    assert_array_equal(np.flatnonzero(path.model[1:] != path.model[:-1]) + 1, np.flatnonzero(path.entered[1:]) + 1)


@pytest.mark.parametrize("cuts", [[1, 700, 701], [333, 666], [999]])
def test_blocks_are_the_whole(cuts: list[int]) -> None:
    n = 1000
    x = drive(n)
    y = measured(x, 7)
    y[400:700] = 0.5 * x[400:700]
    status = pairs(n)
    status[::3] = SKIP
    status[900:930] = SILENT
    quiet = np.arange(n) > 950
    samples = Samples.even(y, x, status, quiet)
    whole, end = forward(samples, MODEL, initial_state(MODEL))
    state, parts = initial_state(MODEL), []
    for start, stop in itertools.pairwise([0, *cuts, n]):
        part, state = forward(samples.part(start, stop), MODEL, state)
        parts.append(part)
    assert_array_equal(np.concatenate([p.back for p in parts]), whole.back)
    assert_array_equal(np.concatenate([p.filtered for p in parts]), whole.filtered)
    for name in ("score", "mean", "cov"):
        assert_array_equal(getattr(state, name), getattr(end, name))


def test_forward_leaves_its_start_alone() -> None:
    start = initial_state(MODEL)
    before = [a.copy() for a in (start.score, start.mean, start.cov)]
    forward(Samples.even(measured(drive(50)), drive(50), pairs(50), busy(50)), MODEL, start)
    for array, kept in zip((start.score, start.mean, start.cov), before, strict=True):
        assert_array_equal(array, kept)


ONSET, END, N = 2000, 3500, 5000


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        (STUCK, lambda x, r: np.full(x.size, x[ONSET] + 0.1)),
        (NO_SIGNAL, lambda x, r: np.zeros(x.size)),
        (INEFFICIENT, lambda x, r: 0.5 * x + 0.004 * r.normal(size=x.size)),
        (NOISY, lambda x, r: 0.6 * x + 0.4 * (0.05 + 0.3 * r.normal(size=x.size))),
    ],
    ids=["stuck", "no signal", "inefficient", "noise-affected"],
)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_row_and_onset_are_recognised(row: int, fault: object, seed: int) -> None:
    x = drive(N) + 0.05
    assert abs(x[ONSET]) > 0.1  # a fault shows at once
    y = measured(x, seed)
    y[ONSET:END] = fault(x, np.random.default_rng(seed + 50))[ONSET:END]  # type: ignore[operator]
    path = most_probable(Samples.even(y, x, pairs(N), busy(N)), MODEL)
    assert (path.row[ONSET + 2 : END - 2] == row).all()
    assert (path.row[: ONSET - 3] == HEALTHY).all()
    assert (path.row[END + 2 :] == HEALTHY).all()
    assert path.filtered[END - 2, row] > 0.99
    assert_allclose(path.filtered.sum(axis=1), 1.0, rtol=1e-6)
    evidence = segment_evidence(Samples.even(y, x, pairs(N), busy(N)).part(ONSET + 2, END - 2), MODEL)
    assert int(np.argmax(evidence)) == row


@pytest.mark.parametrize("seed", range(5))
def test_healthy_channel_has_no_other_row(seed: int) -> None:
    x = drive(20_000)
    path = most_probable(Samples.even(measured(x, seed), x, pairs(x.size), busy(x.size)), MODEL)
    assert (path.row == HEALTHY).all()


def test_small_passing_mismatch_is_healthy() -> None:
    x = drive(5000)
    bias = 0.006 * np.sin(np.arange(5000) * 0.02)
    path = most_probable(Samples.even(measured(x) + bias, x, pairs(5000), busy(5000)), MODEL)
    assert (path.row == HEALTHY).all()


def test_silence_beside_living_siblings_is_no_signal() -> None:
    x = drive(1000)
    y, status = measured(x), pairs(1000)
    y[300:600], status[300:600] = np.nan, SILENT
    path = most_probable(Samples.even(y, x, status, busy(1000)), MODEL)
    assert_array_equal(np.flatnonzero(path.row == NO_SIGNAL), np.arange(300, 600))
    assert (path.row[:300] == HEALTHY).all()
    assert (path.row[600:] == HEALTHY).all()


def test_zero_at_standstill_speaks_for_no_fault() -> None:
    n = 2000
    zero = np.zeros(n)
    still = np.ones(n, dtype=np.bool_)
    path = most_probable(Samples.even(zero, zero, pairs(n), still), MODEL)
    assert (path.row == HEALTHY).all()
    stuck = most_probable(Samples.even(zero + 0.2, zero, pairs(n), still), MODEL)
    assert (stuck.row == STUCK).mean() > 0.99


def test_nothing_new_changes_nothing() -> None:
    start = initial_state(MODEL)
    status = np.full(40, SKIP, dtype=np.int8)
    nothing = np.full(40, np.nan)
    samples = Samples.even(nothing, nothing, status, busy(40))
    out, end = forward(samples, MODEL, start)
    for name in ("score", "mean", "cov"):
        assert_array_equal(getattr(end, name), getattr(start, name))
    assert (out.filtered == out.filtered[0]).all()
    assert_array_equal(segment_evidence(samples, MODEL), np.zeros(5))


def test_rows_of_the_models() -> None:
    assert ROW_OF_MODEL.size == MODELS
    assert set(ROW_OF_MODEL.tolist()) == {HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, NOISY}
    assert len(ROWS) == 5
