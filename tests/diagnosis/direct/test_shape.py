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
