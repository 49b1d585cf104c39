"""Features of what the first look says, against means taken one by one."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from diagnosis.wheels.frames.said import said_features

FRAME_S = 0.2


def probabilities(seed: int, frames: int = 30) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.concatenate([rng.dirichlet(np.ones(5), frames), rng.dirichlet(np.ones(5), frames)], axis=1)


def test_windows_of_the_own_wheel_and_the_others() -> None:
    said = {i: probabilities(i) for i in (0, 2, 3)}
    got = said_features(said, FRAME_S)
    assert {i: x.shape for i, x in got.items()} == dict.fromkeys(said, (30, 108))
    k = 12
    near = slice(k - 1, k + 2)  # 0.2 s on either side
    assert_allclose(got[2][k, :10], np.log(np.maximum(said[2][near], 1e-4)).mean(axis=0))
    others = np.array([said[j][near][:, [0, 5]].mean(axis=0) for j in (0, 3)])
    assert_allclose(got[2][k, 10:12], others.mean(axis=0))
    assert_allclose(got[2][k, 12:14], others.min(axis=0))
    before = said[2][k - 5 : k + 1]  # the second window is the second before
    assert_allclose(got[2][k, 14:24], before.mean(axis=0))
    assert_allclose(got[2][k, -10:], said[2].mean(axis=0))


def test_windows_end_with_the_mission() -> None:
    said = {0: probabilities(1, 3)}
    got = said_features(said, FRAME_S)[0]
    assert np.isfinite(got).all()
    assert_allclose(got[0, 84:94], said[0].mean(axis=0))  # twelve seconds from here hold all of it


def test_a_wheel_without_others_has_healthy_others() -> None:
    got = said_features({0: probabilities(1)}, FRAME_S)[0]
    assert_allclose(got[:, 10:14], 1.0)
    assert said_features({}, FRAME_S) == {}
