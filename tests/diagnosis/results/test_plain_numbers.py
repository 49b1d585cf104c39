from __future__ import annotations

import pytest

from diagnosis.results.plain_numbers import plain, with_minus_signs


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.3137, 3, "0.314"),
        (127.4, 2, "130"),
        (-1234.0, 3, "−1230"),
        (-1.2e-5, 2, "−0.000012"),
        (1e-9, 2, "0"),
        (0.0, 2, "0"),
        (-0.0, 2, "0"),
        (-6.1e-8, 2, "0"),
    ],
)
def test_numbers_have_no_exponent(value: float, digits: int, text: str) -> None:
    assert plain(value, digits) == text


def test_below_nothing_is_a_minus_sign() -> None:
    assert plain(-0.0879) == "−0.0879"
    assert plain(-1.25e-4, 2) == "−0.00013"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("read -0.6 m/s, then (-3.7 ms) and × -1", "read −0.6 m/s, then (−3.7 ms) and × −1"),
        ("on 2025-10-09, wheel-2, 3-4, [-1] of /joint-1", "on 2025-10-09, wheel-2, 3-4, [-1] of /joint-1"),
        ("drive -1.mcap, log -2/a.db3 and -3rd: -1.5.", "drive -1.mcap, log -2/a.db3 and -3rd: −1.5."),
        ("'/a'-1 and \"b\"-1 --5", "'/a'-1 and \"b\"-1 --5"),
    ],
)
def test_hyphens_of_names_and_dates_stay(text: str, told: str) -> None:
    assert with_minus_signs(text) == told
