"""Words about trends: every time has its unit."""

from __future__ import annotations

import pytest

from diagnosis.audit.fleet.trend_types import Axis
from diagnosis.audit.fleet.words import forecast_words, time_words
from diagnosis.audit.trends.trend import Forecast


@pytest.mark.parametrize(("axis", "unit"), [("hours", "h of driving"), ("days", "days")])
@pytest.mark.parametrize(
    ("forecast", "words"),
    [
        (Forecast("crossing", 0.0, 15.0, None, 30.0), "at any time, likely in 15 {}; latest not known"),
        (Forecast("crossing", 4.0, 15.0, None, 30.0), "in 4 {} at the soonest, likely in 15 {}; latest not known"),
        (Forecast("crossing", 4.0, 15.0, 20.0, 30.0), "in 4 to 20 {} (90 %)"),
        (Forecast("not_within", horizon=30.0), "within 30 {}"),
    ],
)
def test_every_time_of_a_forecast_has_the_unit_of_the_axis(
    forecast: Forecast, words: str, axis: Axis, unit: str
) -> None:
    assert forecast_words(forecast, 0.1, axis).endswith(words.replace("{}", unit))


def test_one_day_is_no_days() -> None:
    assert [time_words(x, "days") for x in (0.5, 0.999, 1.0, 2.0)] == ["0.5 days", "1 day", "1 day", "2 days"]
    assert time_words(1.0, "hours") == "1 h of driving"
