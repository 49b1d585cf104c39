"""Two looks at the frames of a mission: what is measured elsewhere, and what nobody knows."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.wheels.forest import looks
from diagnosis.wheels.frames.features import Features
from diagnosis.wheels.looks import first_look, second_look
from diagnosis.wheels.tracks import track_of
from replay.faults import Side

FRAMES, HOP, DT = 25, 20, 0.01


def features(*, strange: bool = False) -> Features:
    first = looks()[0].sensor
    rng = np.random.default_rng(3)
    x = rng.uniform(first.low, first.high, (2, FRAMES, first.low.size)).astype(np.float32)
    return Features(dict(enumerate(x + 1e3 if strange else x)), HOP)


def test_both_looks_know_their_features() -> None:
    first, second = looks()
    assert {f.low.size for f in first} == {543}
    assert {f.low.size for f in second} == {543 + 108}


def test_probabilities_of_both_sides() -> None:
    said = first_look(features(), [False, False])
    assert {p.shape for p in said.values()} == {(FRAMES, 10)}
    for p in said.values():
        assert_allclose(p[:, :5].sum(axis=1), 1.0)
        assert_allclose(p[:, 5:].sum(axis=1), 1.0)
    for sides in second_look(features(), [False, False], DT).values():
        for log_p in sides.values():
            assert_allclose(np.exp(log_p).sum(axis=1), 1.0)


def test_a_valve_that_is_measured_is_judged_elsewhere() -> None:
    assert_allclose(first_look(features(), [True, False])[0][:, 5], 1.0)
    said = second_look(features(), [True, False], DT)
    assert_allclose(np.exp(said[0][Side.ACTUATOR][:, 0]), 1.0)
    assert not np.allclose(np.exp(said[1][Side.ACTUATOR][:, 0]), 1.0)


@pytest.mark.parametrize("side", [Side.SENSOR, Side.ACTUATOR])
def test_features_that_no_tree_has_seen_say_neither_healthy_nor_faulty(side: Side) -> None:
    said = second_look(features(strange=True), [False, False], DT)[1]
    p = track_of(said, HOP, DT).probability[side]
    assert (p[:, 0] > 0.5).all()
    assert (p[:, 0] < 0.75).all()
