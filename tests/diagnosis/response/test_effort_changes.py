"""A drive whose effort is small for a while, and still answers, has power."""

from __future__ import annotations

import numpy as np

from diagnosis.response.effort_changes import answers, goes_with

SPAN = (100, 150)
LOAD = np.where((np.arange(300) % 50) < 25, 5.0, 2.0)


def effort(seed: int) -> np.ndarray:
    out = 0.5 * LOAD
    out[SPAN[0] : SPAN[1]] = 0.0
    return out + 0.1 * np.random.default_rng(seed).normal(size=LOAD.size)


def test_nothing_but_noise_is_no_answer() -> None:
    assert not any(answers(effort(seed), LOAD, SPAN) for seed in range(10))


def test_a_small_answer_where_the_load_changes_most_is_one() -> None:
    for seed in range(10):
        one = effort(seed)
        one[124:127] += 0.6
        assert answers(one, LOAD, SPAN)


def test_an_effort_that_goes_up_for_some_seconds_has_power() -> None:
    one = effort(1)
    one[130:145] += 0.5
    assert answers(one, LOAD, SPAN)


def test_where_nothing_is_known_nothing_is_said() -> None:
    assert not answers(np.full(300, np.nan), LOAD, SPAN)


def test_the_little_that_the_inner_drive_of_a_curve_carries_goes_with_what_the_others_carry() -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        other = 5.0 + np.convolve(rng.normal(size=300), np.ones(3) / 3.0, mode="same")
        inner = 0.9 * (other - 5.0) + 0.1 * rng.normal(size=300)
        assert goes_with(inner, [0.0 * other, other], SPAN)
        assert not goes_with(0.2 * rng.normal(size=300), [other], SPAN)
        assert not goes_with(-inner, [other], SPAN)


def test_a_few_blocks_or_none_tell_of_no_agreement() -> None:
    a = np.linspace(0.0, 1.0, 300) ** 2
    assert not goes_with(a, [a], (100, 108))
    assert not goes_with(np.full(300, np.nan), [a], SPAN)
    assert not goes_with(0.0 * a, [a], SPAN)
