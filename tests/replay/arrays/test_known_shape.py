"""Arrays whose sizes a kernel knows hold the elements of the array that was given, and writing to them writes to it."""

from __future__ import annotations

import numpy as np
import pytest
from numba.core.errors import TypingError
from numpy.testing import assert_array_equal

from replay.arrays.compiling import njit
from replay.arrays.known_shape import trailing

matrices = trailing(2, 3)


@njit
def doubled(x: np.ndarray) -> np.ndarray:
    """Twice each element, in place; the shape that was seen."""
    known = matrices(x)
    for i in range(known.shape[0]):
        for j in range(known.shape[1]):
            for k in range(known.shape[2]):
                known[i, j, k] *= 2
    return np.array(known.shape)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int16])
@pytest.mark.parametrize("first", [0, 1, 5])
def test_the_array_itself_is_seen(kind: type, first: int) -> None:
    x = np.arange(first * 6).reshape(first, 2, 3).astype(kind)
    want = 2 * x
    assert_array_equal(doubled(x), [first, 2, 3])
    assert_array_equal(x, want)


@pytest.mark.parametrize("x", [np.zeros((2, 3)), np.zeros((4, 2, 6))[:, :, ::2]], ids=["dimensions", "order"])
def test_other_arrays_are_refused(x: np.ndarray) -> None:
    with pytest.raises(TypingError):
        doubled(x)
