"""Ranges of recorded values, as text."""

from __future__ import annotations

import pytest

from replay.setup.ranges import range_text


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [
        (-1.868e-15, 0.37678, "0 … 0.3768"),
        (-2.5, 3e-13, "-2.5 … 0"),
        (0.0, 0.0, "0 … 0"),
        (1e-12, 3e-12, "1e-12 … 3e-12"),
        (-0.6, 1.8, "-0.6 … 1.8"),
    ],
)
def test_what_is_rounding_beside_the_other_end_is_zero(low: float, high: float, shown: str) -> None:
    assert range_text(low, high, 4) == shown
