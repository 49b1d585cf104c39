"""The lane of what the machine did as a whole, in Chromium: chosen by keyboard and by address, and without scripts."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]
FOLLOWS = "The machine did not follow its commands"


def test_every_time_is_a_bar_with_the_title_of_the_event(open_page: OPEN) -> None:
    page = open_page("machine_events", script=False)
    bars = page.locator(".events .mev")
    assert bars.evaluate_all("es => es.map((e) => e.getAttribute('aria-label'))") == [
        "The gyro contradicts the wheels, throughout",
        f"{FOLLOWS}, 0:30.0 to 0:36.0",
        f"{FOLLOWS}, 1:20.0 to 1:40.0",
    ]
    expect(page.locator(".events .what")).to_have_text("machine")
    expect(page.locator(".events .mevl").first).to_have_text(FOLLOWS)


def test_the_keyboard_shows_its_time_beside_the_fault(open_page: OPEN) -> None:
    page = open_page("machine_events")
    page.locator("#figure .main-svg").first.wait_for()
    page.locator(".mev[data-e=M1]").first.press("Enter")
    expect(page.locator(".mev[aria-current]")).to_have_attribute("data-from", "30.0000")
    expect(page.locator("#live")).to_have_text(f"{FOLLOWS}, 0:30.0 to 0:36.0")
    page.wait_for_function("document.querySelector('.events .win').style.left.startsWith('23.')")  # 28.5 of 120 s
    page.keyboard.press("j")
    expect(page.locator(".mev[aria-current]")).to_have_count(0)


@pytest.mark.parametrize("name", ["machine_events", "machine_events_alone"])
def test_an_address_leads_there(open_page: OPEN, name: str) -> None:
    page = open_page(name, "#event=M1&t=80.0000,100.0000")
    expect(page.locator(".mev[aria-current]")).to_have_attribute("data-from", "80.0000")
    expect(page.locator("#missing")).to_have_count(0)


def test_an_event_that_is_not_there_is_told(open_page: OPEN) -> None:
    page = open_page("machine_events", "#event=M9")
    expect(page.locator("#missing")).to_have_text(re.compile("There is no event M9 of the machine in this report"))


@pytest.mark.parametrize("width", [1440, 820, 390])
def test_bars_stand_within_their_lane(open_page: OPEN, width: int) -> None:
    page = open_page("machine_events", width=width)
    inside = page.locator(".events").evaluate(
        "l => { const t = l.querySelector('.track').getBoundingClientRect(); return [...l.querySelectorAll('.mev, .mevl')].every((e) => "
        "{ const r = e.getBoundingClientRect(); return r.left >= t.left - 1 && r.right <= t.right + 6 && r.top >= t.top - 1 && r.bottom <= t.bottom + 1; }); }"
    )
    assert inside
