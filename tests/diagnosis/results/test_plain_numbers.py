from __future__ import annotations

import pytest

from diagnosis.results.plain_numbers import plain


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.3137, 3, "0.314"),
        (127.4, 2, "130"),
        (-1234.0, 3, "-1230"),
        (-1.2e-5, 2, "-0.000012"),
        (1e-9, 2, "0"),
        (0.0, 2, "0"),
    ],
)
def test_numbers_have_no_exponent(value: float, digits: int, text: str) -> None:
    assert plain(value, digits) == text
