"""Values that are missing: what is taken for them, and what is left as it is."""

from __future__ import annotations

import numpy as np
import pytest

from replay.arrays.numeric import without_nan


def test_what_misses_nothing_is_not_copied() -> None:
    x = np.array([1.0, -2.0, 3.0])
    assert without_nan(x) is x
    missing = np.array([1.0, np.nan, np.inf])
    assert without_nan(missing).tolist() == [1.0, 0.0, np.inf]
    assert np.isnan(missing[1])


@pytest.mark.parametrize("x", [np.arange(6.0)[::2], np.broadcast_to(1.0, (3,))])
def test_what_compiled_code_would_be_compiled_anew_for_is_copied(x: np.ndarray) -> None:
    found = without_nan(x)
    assert found.tolist() == x.tolist()
    assert found.flags.carray
