"""Values out of range say what they may have been meant as."""

from __future__ import annotations

import pytest

from replay.errors import ConfigError, check_range


def test_a_value_in_range_passes() -> None:
    check_range("limits.brief", 1.0, 0.0, 2.0, "s")


def test_a_value_in_another_unit_gets_the_line_to_write() -> None:
    with pytest.raises(ConfigError) as caught:
        check_range(
            "geometry.wheel_diameter", 330, 0.02, 5.0, "m", mistaken=(("millimetres", 1e-3), ("centimetres", 1e-2))
        )
    assert "330 looks like millimetres or centimetres: write wheel_diameter = 0.33 or 3.3 in [geometry]" in str(
        caught.value
    )


def test_a_value_that_is_wrong_in_either_unit_gets_no_hint() -> None:
    with pytest.raises(ConfigError) as caught:
        check_range(
            "geometry.wheel_diameter", -1, 0.02, 5.0, "m", mistaken=(("millimetres", 1e-3), ("centimetres", 1e-2))
        )
    assert "looks like" not in str(caught.value)
