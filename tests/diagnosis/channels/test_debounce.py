"""Flickering flags become runs."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from diagnosis.channels.debounce import debounced


def flags(text: str) -> np.ndarray:
    return np.array([c == "#" for c in text])


@pytest.mark.parametrize(
    ("before", "gap", "least", "after"),
    [
        ("..#.#.#....#...", 3, 1, "..#####....#..."),
        ("..#.#.#....#...", 3, 2, "..#####........"),
        ("#..............", 9, 1, "#.............."),
        ("###.........###", 9, 3, "###.........###"),
        ("###.........###", 10, 3, "###############"),
        ("...............", 4, 4, "..............."),
        ("###############", 4, 4, "###############"),
    ],
)
def test_gaps_then_runs(before: str, gap: int, least: int, after: str) -> None:
    assert_array_equal(debounced(flags(before), gap, least), flags(after))


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.integers(1, 8))
def test_against_a_plain_loop(given_flags: list[bool], gap: int) -> None:
    expected = list(given_flags)
    places = [i for i, f in enumerate(given_flags) if f]
    for a, b in pairwise(places):
        if b - a - 1 < gap:
            expected[a:b] = [True] * (b - a)
    assert debounced(np.array(given_flags), gap, 1).tolist() == expected
