"""Calibrated rows: probabilities that add up, models that are left out, features far from all that was trained on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.wheels.calibration import CLASSES, GROUPS, Calibration, RunContext, calibrated, calibration, features
from diagnosis.wheels.models import A_BIAS, A_GAIN, A_NONE, HEALTHY, MODELS, ODD, ROW_OF_MODEL, S_GAIN, S_STUCK
from replay.faults import Side

CONTEXT = RunContext(3.0, 0.02, 0.5, 0.1, 0.2, 0.3, HEALTHY, A_GAIN)
Array = np.ndarray


def evidence(given: dict[int, float]) -> Array:
    """Log-likelihoods, 0 for a healthy wheel and −50 for what is not given."""
    out = np.full(MODELS, -50.0)
    out[HEALTHY] = 0.0
    for m, value in given.items():
        out[m] = value
    return out


SIZE = features(HEALTHY, evidence({}), CONTEXT).size


def random_weights(seed: int = 1) -> Calibration:
    rng = np.random.default_rng(seed)
    weights = rng.normal(size=(len(CLASSES), SIZE + 1))
    return Calibration(rng.normal(size=SIZE), rng.uniform(0.5, 2.0, SIZE), 0.2 * weights)


def test_every_model_belongs_to_one_group_and_every_row_to_one_class() -> None:
    assert sorted(m for group in GROUPS for m in group) == list(range(MODELS))
    assert all(len({ROW_OF_MODEL[m] for m in group}) == 1 for group in GROUPS)
    assert len(set(CLASSES)) == len(CLASSES)
    assert set(CLASSES) == set(ROW_OF_MODEL)
    assert CLASSES[0] is None


def test_shipped_weights_fit_the_features() -> None:
    shipped = calibration()
    assert shipped.centre.shape == shipped.scale.shape == (SIZE,)
    assert shipped.weights.shape == (len(CLASSES), SIZE + 1)
    assert (shipped.scale > 0).all()
    assert np.isfinite(shipped.weights).all()


@pytest.mark.parametrize("seed", range(5))
def test_probabilities_add_up(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    weights = random_weights(seed)
    monkeypatch.setattr("diagnosis.wheels.calibration.calibration", lambda: weights)
    p = calibrated(S_GAIN, evidence({S_GAIN: 30.0, A_GAIN: 25.0}), CONTEXT)
    assert tuple(p) == CLASSES
    assert sum(p.values()) == pytest.approx(1.0)
    assert min(p.values()) > 0.5e-4  # nothing that is considered is impossible
    # a softmax of the weighted, centred and scaled features
    x = (features(S_GAIN, evidence({S_GAIN: 30.0, A_GAIN: 25.0}), CONTEXT) - weights.centre) / weights.scale
    score = weights.weights[:, :-1] @ np.clip(x, -6.0, 6.0) + weights.weights[:, -1]
    naive = np.maximum(np.exp(score - np.logaddexp.reduce(score)), 1e-4)
    assert_allclose(list(p.values()), naive / naive.sum(), rtol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_models_that_are_left_out_have_no_probability(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    weights = random_weights(seed)
    monkeypatch.setattr("diagnosis.wheels.calibration.calibration", lambda: weights)
    measured = evidence({S_STUCK: 40.0})
    measured[A_GAIN:] = -np.inf
    p = calibrated(S_STUCK, measured, CONTEXT)
    assert all((q == 0.0) == (row is not None and row[0] is Side.ACTUATOR) for row, q in p.items())
    assert sum(p.values()) == pytest.approx(1.0)
    assert np.isfinite(features(S_STUCK, measured, CONTEXT)).all()


def test_features_far_from_training_are_clipped() -> None:
    weights = random_weights()
    considered = np.ones(len(CLASSES), dtype=np.bool_)
    far, farther = (weights.centre + k * weights.scale * np.resize([1.0, -1.0], SIZE) for k in (6.0, 1e6))
    assert_allclose(weights.probabilities(farther, considered), weights.probabilities(far, considered))
    near = weights.centre + 5.0 * weights.scale * np.resize([1.0, -1.0], SIZE)
    assert not np.allclose(weights.probabilities(near, considered), weights.probabilities(far, considered))


def test_features_see_evidence_as_differences() -> None:
    """A common factor of all models' likelihoods says nothing."""
    base = evidence({S_GAIN: 30.0, A_BIAS: 12.0})
    assert_allclose(features(S_GAIN, base + 1234.5, CONTEXT), features(S_GAIN, base, CONTEXT), atol=1e-9)
    got = features(S_GAIN, base, CONTEXT)
    behind = dict(zip((g[0] for g in GROUPS), got[: len(GROUPS)], strict=True))
    assert behind[S_GAIN] == 0.0
    assert behind[HEALTHY] == pytest.approx(np.log1p(30.0))
    assert behind[A_BIAS] == pytest.approx(np.log1p(18.0))
    # noise of any strength is one group, by its best model
    noisy = base.copy()
    noisy[list(GROUPS[5])] = [1.0, 2.0, 28.0, 4.0, 5.0]
    assert features(S_GAIN, noisy, CONTEXT)[5] == pytest.approx(np.log1p(2.0))


def test_an_unusual_load_is_a_healthy_wheel() -> None:
    ahead = len(GROUPS)
    assert features(A_GAIN, evidence({A_GAIN: 30.0}), CONTEXT)[ahead] == pytest.approx(np.log1p(30.0))
    assert features(A_GAIN, evidence({A_GAIN: 30.0, ODD: 28.0}), CONTEXT)[ahead] == pytest.approx(np.log1p(2.0))
    assert features(A_GAIN, evidence({A_GAIN: 30.0, ODD: 35.0}), CONTEXT)[ahead] == 0.0


def test_every_part_of_the_context_counts() -> None:
    base = features(A_NONE, evidence({A_NONE: 30.0}), CONTEXT)
    other = RunContext(5.0, 0.05, 1.5, 0.6, 0.7, 0.9, A_BIAS, S_STUCK)
    for name in RunContext.__dataclass_fields__:
        changed = replace(CONTEXT, **{name: getattr(other, name)})
        got = features(A_NONE, evidence({A_NONE: 30.0}), changed)
        assert np.isfinite(got).all()
        assert not np.array_equal(got, base), name


def test_extremes_stay_finite() -> None:
    nothing = RunContext(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, HEALTHY, HEALTHY)
    for e in (np.zeros(MODELS), evidence({S_STUCK: 1e9}), np.where(np.arange(MODELS) < A_GAIN, 0.0, -np.inf)):
        assert np.isfinite(features(S_STUCK, e, nothing)).all()
        assert sum(calibrated(S_STUCK, e, nothing).values()) == pytest.approx(1.0)
