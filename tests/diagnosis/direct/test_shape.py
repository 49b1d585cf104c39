"""What a deviation looks like, by deviations that are made."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.direct.shape import shape_sentence
from diagnosis.results.machine_words import HYDRAULIC

Array = NDArray[np.float64]
DT = 0.01
T = np.arange(2000) * DT
X = 0.3 * np.sin(0.8 * T) + 0.1
RNG = np.random.default_rng(4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x: x + 0.08, "An offset: a reads 0.08 m/s more than b."),
        (lambda x: x - 0.05, "An offset: a reads 0.05 m/s less than b."),
        (lambda x: 1.3 * x, "A scale: a is 1.3 × b, without an offset."),
        (lambda x: np.interp(T - 0.1, T, x), "A delay: a comes 99 ms after b."),
        (lambda x: x + 0.02 * (T - 10.0), "A drift: a departs from b by 0.02 m/s a second."),
        (lambda x: x + 0.5 * (np.arange(T.size) % 50 == 7), "Spikes: 40 of 2000 samples are off by about 0.5 m/s"),
        (lambda x: x, ""),
        (lambda x: x + 0.05 * RNG.standard_normal(T.size), ""),
    ],
)
def test_a_deviation_gets_its_name(change: Callable[[Array], Array], words: str) -> None:
    y = change(X) + 1e-4 * np.sin(37.0 * T)
    said = HYDRAULIC.fill(shape_sentence(y, X, DT, ("a", "b"), "m/s"))
    assert said.startswith(words)
    assert bool(said) == bool(words)


def test_a_few_samples_have_no_shape() -> None:
    assert shape_sentence(X[:10] + 1.0, X[:10], DT, ("a", "b"), "m/s") == ""


def test_a_scale_with_an_offset_is_told_with_both() -> None:
    t = np.arange(2000) * 0.01
    x = 0.3 * np.sin(t) + 0.2
    y = 0.575 * x + 0.033 + np.random.default_rng(1).normal(0.0, 0.002, t.size)
    said = shape_sentence(y, x, 0.01, ("v", "v_true"), "m/s")
    assert said.startswith("A scale and an offset: v is 0.57")
    assert "0.033" in said
