"""Local time beside UTC: the reader's, of that day, and nothing where the reader lives in UTC."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.parametrize(
    ("zone", "shown"),
    [
        ("Asia/Kolkata", "2025-10-09 14:23:20 local (UTC+5:30)"),
        ("America/New_York", "2025-10-09 04:53:20 local (UTC−4)"),
        ("UTC", None),
        pytest.param("Europe/Berlin", "2025-10-09 10:53:20 local (UTC+2)", marks=pytest.mark.long),
    ],
)
def test_the_reader_s_time_stands_beside_utc(
    browser: Any, pages: Callable[[str], Path], zone: str, shown: str | None
) -> None:
    context = browser.new_context(timezone_id=zone)
    try:
        tab = context.new_page()
        tab.goto(pages("no_faults").as_uri())
        start = tab.locator("dl.facts div", has_text="Start (UTC)").locator("dd")
        assert start.locator("time").inner_text() == "2025-10-09 08:53:20"
        local = start.locator(".local")
        assert local.count() == (shown is not None)
        if shown is not None:
            assert local.inner_text().strip() == shown
    finally:
        context.close()
