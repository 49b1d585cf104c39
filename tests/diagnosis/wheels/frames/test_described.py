"""A run of the Kalman models in figures: differences of evidence, finite whatever comes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.wheels.frames.described import GROUPS, RunContext, described, run_context
from diagnosis.wheels.models import A_BIAS, A_GAIN, A_NONE, HEALTHY, MODELS, ODD, ROW_OF_MODEL, S_GAIN, S_STUCK
from diagnosis.wheels.runs import Runs

CONTEXT = RunContext(3.0, 0.02, 0.5, 0.1, 0.2, 0.3, HEALTHY, A_GAIN)
Array = np.ndarray


def evidence(given: dict[int, float]) -> Array:
    """Log-likelihoods, 0 for a healthy wheel and −50 for what is not given."""
    out = np.full(MODELS, -50.0)
    out[HEALTHY] = 0.0
    for m, value in given.items():
        out[m] = value
    return out


def test_every_model_belongs_to_one_group() -> None:
    assert sorted(m for group in GROUPS for m in group) == list(range(MODELS))
    assert all(len({ROW_OF_MODEL[m] for m in group}) == 1 for group in GROUPS)


def test_evidence_counts_as_differences() -> None:
    """A common factor of all models' likelihoods says nothing."""
    base = evidence({S_GAIN: 30.0, A_BIAS: 12.0})
    assert_allclose(described(S_GAIN, base + 1234.5, CONTEXT), described(S_GAIN, base, CONTEXT), atol=1e-9)
    got = described(S_GAIN, base, CONTEXT)
    behind = dict(zip((g[0] for g in GROUPS), got[: len(GROUPS)], strict=True))
    assert behind[S_GAIN] == 0.0
    assert behind[HEALTHY] == pytest.approx(np.log1p(30.0))
    assert behind[A_BIAS] == pytest.approx(np.log1p(18.0))
    # noise of any strength is one group, by its best model
    noisy = base.copy()
    noisy[list(GROUPS[5])] = [1.0, 2.0, 28.0, 4.0, 5.0]
    assert described(S_GAIN, noisy, CONTEXT)[5] == pytest.approx(np.log1p(2.0))


def test_an_unusual_load_is_a_healthy_wheel() -> None:
    ahead = len(GROUPS)
    assert described(A_GAIN, evidence({A_GAIN: 30.0}), CONTEXT)[ahead] == pytest.approx(np.log1p(30.0))
    assert described(A_GAIN, evidence({A_GAIN: 30.0, ODD: 28.0}), CONTEXT)[ahead] == pytest.approx(np.log1p(2.0))
    assert described(A_GAIN, evidence({A_GAIN: 30.0, ODD: 35.0}), CONTEXT)[ahead] == 0.0


def test_every_part_of_the_context_counts() -> None:
    base = described(A_NONE, evidence({A_NONE: 30.0}), CONTEXT)
    other = RunContext(5.0, 0.05, 1.5, 0.6, 0.7, 0.9, A_BIAS, S_STUCK)
    for name in RunContext.__dataclass_fields__:
        changed = replace(CONTEXT, **{name: getattr(other, name)})
        got = described(A_NONE, evidence({A_NONE: 30.0}), changed)
        assert np.isfinite(got).all()
        assert not np.array_equal(got, base), name


def test_extremes_stay_finite() -> None:
    nothing = RunContext(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, HEALTHY, HEALTHY)
    for e in (np.zeros(MODELS), evidence({S_STUCK: 1e9}), np.where(np.arange(MODELS) < A_GAIN, 0.0, -np.inf)):
        assert np.isfinite(described(S_STUCK, e, nothing)).all()


def test_a_context_is_the_mean_over_its_run() -> None:
    start = np.array([0, 4, 10])
    runs = Runs(start, np.array([4, 10, 12]), np.array([HEALTHY, A_GAIN, S_STUCK]), start)
    opening = np.r_[np.zeros(4), 0.1, 0.3, 0.1, 0.3, 0.1, 0.3, np.zeros(2)]
    others, unseen, doubtful = np.arange(12.0), np.repeat([0.0, 1.0], 6), np.repeat([1.0, 0.0], 6)
    got = run_context(runs, 1, opening, 0.2, others, unseen, doubtful, 0.03, 0.01)
    assert got == RunContext(
        0.06, 0.03, 6.5, pytest.approx(2 / 3), pytest.approx(1 / 3), pytest.approx(0.5), HEALTHY, S_STUCK
    )
    assert run_context(runs, 0, opening, 0.2, others, unseen, doubtful, 0.03, 0.01).before == HEALTHY
