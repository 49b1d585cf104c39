"""Rows by block and their means."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from replay.arrays.blocks import block_means, framed


def test_blocks_are_means_and_the_last_is_filled_up() -> None:
    x = np.arange(10.0)[:, None]
    assert_allclose(block_means(x, 4)[:, 0], [1.5, 5.5, (8 + 9 + 9 + 9) / 4])
    assert_allclose(block_means(x[:, 0] > 4, 4), [0.0, 0.75, 1.0])


def test_rows_of_blocks() -> None:
    x = np.arange(6.0).reshape(3, 2)
    assert_allclose(framed(x, 2), [[[0, 1], [2, 3]], [[4, 5], [4, 5]]])
    assert framed(x, 3).shape == (1, 3, 2)
