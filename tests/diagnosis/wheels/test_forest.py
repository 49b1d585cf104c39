"""Trees against a walk in plain Python, and the trees that are shipped."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.wheels.forest import Forest, known_share, log_probabilities, looks
from diagnosis.wheels.tracks import MODES

CLASSES, FEATURES = 3, 6


def random_forest(seed: int, trees: int = 12) -> Forest:
    """Trees of a random shape; some are a leaf alone."""
    rng = np.random.default_rng(seed)
    feature, threshold, left, right, value, root = ([] for _ in range(6))

    def grow(depth: int) -> int:
        if depth == 0 or rng.random() < 0.2:
            value.append(rng.normal())
            return -len(value)
        k = len(feature)
        feature.append(rng.integers(FEATURES))
        threshold.append(rng.normal())
        left.append(0)
        right.append(0)
        left[k], right[k] = grow(depth - 1), grow(depth - 1)
        return k

    root += [grow(4) for _ in range(trees)]
    return Forest(
        np.array(feature, np.int16),
        np.array(threshold, np.float32),
        np.array(left, np.int32),
        np.array(right, np.int32),
        np.array(value, np.float32),
        np.array(root, np.int32),
        np.full(CLASSES, 1 / CLASSES),
        np.full(FEATURES, -2.0, np.float32),
        np.full(FEATURES, 2.0, np.float32),
    )


@pytest.mark.parametrize(("seed", "frames"), [(0, 40), (1, 64), (2, 150), (3, 0), (4, 1), (5, 33), (6, 67)])
def test_scores_are_those_of_a_walk(seed: int, frames: int) -> None:
    forest = random_forest(seed)
    x = np.random.default_rng(seed).normal(size=(frames, FEATURES)).astype(np.float32)
    want = np.zeros((len(x), CLASSES))
    for n, row in enumerate(x):
        for t, k in enumerate(forest.root):
            while k >= 0:
                k = forest.left[k] if row[forest.feature[k]] <= forest.threshold[k] else forest.right[k]
            want[n, t % CLASSES] += forest.value[-1 - k]
    want -= np.logaddexp.reduce(want, axis=1, keepdims=True)
    assert_allclose(log_probabilities(x, forest), want, atol=1e-9)


@pytest.mark.parametrize("missing", [np.nan, np.inf, -np.inf])
def test_what_is_not_known_goes_to_the_right(missing: float) -> None:
    forest = random_forest(1)
    x = np.full((1, FEATURES), missing, np.float32)
    as_known = np.full((1, FEATURES), -1e30 if missing < 0 else 1e30, np.float32)
    assert_allclose(log_probabilities(x, forest), log_probabilities(as_known, forest))


def chain(leaves: int) -> Forest:
    """One tree whose nodes follow each other to the right: leaf k for numbers above k − 0.5 and up to k + 0.5."""
    nodes = np.arange(leaves - 1)
    right = np.where(nodes + 1 < leaves - 1, nodes + 1, -leaves)
    return random_forest(0)._replace(
        feature=np.zeros(leaves - 1, np.int16),
        threshold=(nodes + 0.5).astype(np.float32),
        left=(-1 - nodes).astype(np.int32),
        right=right.astype(np.int32),
        value=np.arange(leaves, dtype=np.float32),
        root=np.zeros(1, np.int32),
    )


def test_every_leaf_of_the_largest_tree() -> None:
    x = np.zeros((32, FEATURES), np.float32)
    x[:, 0] = np.arange(32)
    said = log_probabilities(x, chain(32))
    assert_allclose(said[:, 0] - said[:, 1], np.arange(32))


def test_larger_trees_are_refused() -> None:
    with pytest.raises(ValueError, match="more than 32 leaves"):
        log_probabilities(np.zeros((1, FEATURES), np.float32), chain(33))


def test_share_of_features_within_the_training() -> None:
    forest = random_forest(0)
    x = np.zeros((2, FEATURES), np.float32)
    x[1, :3] = 5.0
    assert_allclose(known_share(x, forest), [1.0, 0.5])


def test_shipped_trees_hold_together() -> None:
    for forest in (*looks()[0], *looks()[1]):
        assert forest.prior.shape == (len(MODES) + 1,)
        assert forest.prior.sum() == pytest.approx(1.0)
        assert forest.root.size % forest.prior.size == 0
        children = np.r_[forest.left, forest.right, forest.root]
        assert sorted(children) == list(range(-forest.value.size, forest.feature.size))  # each node and leaf once
        assert forest.feature.min() >= 0
        assert forest.feature.max() < forest.low.size == forest.high.size
        assert np.isfinite(forest.value).all()
        assert (forest.low <= forest.high).all()
