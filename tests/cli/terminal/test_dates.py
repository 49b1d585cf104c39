"""Dates of the command line, and moments in UTC and local time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest

from cli.terminal.dates import has_zone, moment_of, nanoseconds, shown_moment
from replay.errors import ConfigError


@pytest.fixture
def zone(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], None]]:
    """Sets the computer's time zone."""

    def set_zone(name: str) -> None:
        monkeypatch.setenv("TZ", name)
        time.tzset()

    yield set_zone
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    ("text", "ns"),
    [
        ("1970-01-01", 0),
        ("2026-10-05", 1_791_158_400 * 10**9),
        ("2026-10-05T14:30", 1_791_210_600 * 10**9),
        (" 2026-10-05 14:30:00.25 ", 1_791_210_600_250_000_000),
        ("2026-10-05T14:30+02:00", 1_791_203_400 * 10**9),
        ("2026-10-05T14:30Z", 1_791_210_600 * 10**9),
        ("2026-10-05T14:30 Europe/Berlin", 1_791_203_400 * 10**9),
        ("2026-10-05 14:30 +02:00", 1_791_203_400 * 10**9),
        ("2026-12-05T14:30 Europe/Berlin", 1_796_477_400 * 10**9),
    ],
)
def test_moments(text: str, ns: int) -> None:
    assert nanoseconds(moment_of("--start", text)) == ns


def test_the_time_of_this_computer(zone: Callable[[str], None]) -> None:
    zone("Europe/Berlin")
    assert moment_of("--on", "2026-10-05T14:30 local") == moment_of("--on", "2026-10-05T12:30")


@pytest.mark.parametrize(
    ("text", "stated"), [("2026-10-05T14:30", False), ("2026-10-05T14:30Z", True), ("2026-10-05 local", True)]
)
def test_which_dates_state_their_zone(text: str, stated: bool) -> None:
    assert has_zone(text) == stated


def test_a_zone_that_is_not_known_and_one_too_many() -> None:
    with pytest.raises(
        ConfigError, match="time zone 'Europe/Nowhere' is not known; expected one such as Europe/Berlin"
    ):
        moment_of("--on", "2026-10-05T14:30 Europe/Nowhere")
    with pytest.raises(ConfigError, match="has an offset and the zone local; give one of them"):
        moment_of("--on", "2026-10-05T14:30Z local")


@pytest.mark.parametrize("text", ["monday", "", "05.10.2026", "2026-02-30", "14:30", "1791158400"])
def test_what_is_no_date(text: str) -> None:
    with pytest.raises(ConfigError, match=r"--start .*: is no date; expected one such as 2026-10-05"):
        moment_of("--start", text)


@pytest.mark.parametrize("text", ["1969-12-31", "2100-01-01"])
def test_what_no_log_has(text: str) -> None:
    with pytest.raises(ConfigError, match="is out of range; expected 1970 to 2099"):
        moment_of("--start", text)


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("UTC", "2026-10-05 12:30:00 UTC"),
        ("Europe/Berlin", "2026-10-05 12:30:00 UTC (14:30:00 CEST)"),
        ("Pacific/Auckland", "2026-10-05 12:30:00 UTC (2026-10-06 01:30:00 NZDT)"),
    ],
)
def test_local_time_stands_beside_utc(zone: Callable[[str], None], name: str, shown: str) -> None:
    zone(name)
    assert shown_moment(nanoseconds(moment_of("--on", "2026-10-05T12:30"))) == shown


def test_a_time_beyond_calendars_is_no_error() -> None:
    assert shown_moment(10**30) == "an unknown time"


def test_a_clock_without_a_date_is_said_to_have_none() -> None:
    assert shown_moment(12 * 10**9).startswith("12 s of a clock without a date")
    assert shown_moment(73_214 * 10**9).startswith("73214 s of a clock without a date")
    assert shown_moment(-1_400_000).startswith("0 s of a clock without a date")
