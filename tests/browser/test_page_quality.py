"""What page audits ask for beyond axe-core: sizes of targets, headings, reflow, focus, motion, and paper."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from tests.campaigns import campaign

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

OPEN = Callable[..., Any]
LEAST = 24  # CSS pixels, WCAG 2.2 target size (minimum)

# Left out: plotly's own drawing; links within a sentence; the width of a bar on the timeline, whose fault has a link of
# full size in the table; the skip link, which has a size when it has the focus. A control in a label is as large as that.
SMALL = """least => [...document.querySelectorAll('a[href],button,input,select,summary,[role=button]')].flatMap(e => {
  const style = getComputedStyle(e), box = (e.closest('label') || e).getBoundingClientRect();
  const within = e.tagName === 'A' && style.display === 'inline' && e.parentElement.textContent.trim() !== e.textContent.trim();
  if (!box.width || !box.height || style.visibility === 'hidden' || within || e.closest('.js-plotly-plot, .skip')) return [];
  const narrow = box.width < least && !e.matches('.fb');
  return narrow || box.height < least ? [`${e.tagName} ${e.textContent.trim()} ${box.width} x ${box.height}`] : [];
})"""
HEADINGS = """() => [...document.querySelectorAll('h1,h2,h3,h4,h5,h6')].filter(e => e.getClientRects().length)
  .map(e => Number(e.tagName[1]))"""
NAMELESS = """() => [...document.querySelectorAll('input,select,textarea,button,a[href],[role=button]')]
  .filter(e => !e.closest('.js-plotly-plot')).filter(e => !(e.getAttribute('aria-label') || e.textContent.trim() ||
    e.labels?.length || e.title)).map(e => e.outerHTML.slice(0, 80))"""


@pytest.mark.parametrize("width", campaign([320, 1280, 420], 2))
def test_targets_can_be_hit_and_nothing_scrolls_sideways(open_page: OPEN, width: int) -> None:
    for name in ("five_faults", "not_assessed"):
        page = open_page(name, width=width)
        assert page.evaluate(SMALL, LEAST) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_document_says_what_it_is(open_page: OPEN) -> None:
    page = open_page("five_faults")
    assert page.evaluate("document.documentElement.lang") == "en"
    assert "faults to repair" in page.title()
    assert page.locator("meta[name=viewport]").get_attribute("content") == "width=device-width, initial-scale=1"
    assert page.locator("main").count() == 1
    assert page.evaluate(NAMELESS) == []


@pytest.mark.parametrize("name", ["five_faults", "not_assessed"])
def test_headings_leave_no_level_out(open_page: OPEN, name: str) -> None:
    levels = open_page(name).evaluate(HEADINGS)
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b <= a + 1 for a, b in pairwise(levels))


def test_focus_is_seen_and_goes_down_the_page(open_page: OPEN) -> None:
    page = open_page("five_faults")
    state = """() => { const e = document.activeElement, s = getComputedStyle(e), r = e.getBoundingClientRect();
      return [e.outerHTML.slice(0, 120), s.outlineStyle, parseFloat(s.outlineWidth), r.width > 1 && r.height > 1,
              [...document.querySelectorAll('*')].indexOf(e)]; }"""
    page.locator("body").focus()
    places = []
    for _ in range(40):
        page.keyboard.press("Tab")
        tag, style, line, seen, place = page.evaluate(state)
        assert (style != "none" and line >= 2) or style == "auto", (tag, style, line)
        assert seen, tag
        places.append(place)
    assert places == sorted(places), "focus follows the order of the document"
    assert page.locator("[tabindex]:not([tabindex='0']):not([tabindex='-1'])").count() == 0


def test_first_screen_holds_answer_first_check_and_certainty(open_page: OPEN) -> None:
    page = open_page("five_faults")  # 1280 × 900
    for place in (".tag", ".go b", ".actions li:first-child b", ".actions li:first-child .sure", ".machine", ".facts"):
        box = page.locator(place).first.bounding_box()
        assert box["y"] + box["height"] < 880, place
    assert page.locator(".go").inner_text().startswith("May it go out again? No")
    assert page.locator(".actions .sure").first.inner_text().startswith("How sure: ")


def test_nothing_moves_where_motion_is_unwanted(open_page: OPEN) -> None:
    page = open_page("five_faults")
    page.emulate_media(reduced_motion="reduce")
    moving = """() => [...document.querySelectorAll('*')].filter(e => !e.closest('.js-plotly-plot')).filter(e => {
      const s = getComputedStyle(e); return s.animationName !== 'none' || parseFloat(s.transitionDuration) > 0 ||
        s.scrollBehavior === 'smooth'; }).map(e => e.className)"""
    assert page.evaluate(moving) == []
    page.evaluate("window.asked = []; Element.prototype.scrollIntoView = o => asked.push((o || {}).behavior || 'auto')")
    page.locator(".actions a").first.click()
    assert "smooth" not in page.evaluate("asked")


@pytest.mark.parametrize("paper", campaign(["A4", "Letter"]))
def test_prints_on_two_pages(open_page: OPEN, paper: str) -> None:
    page = open_page("five_faults")
    pdf = page.pdf(format=paper, print_background=True)
    assert pages_of(pdf) == 2


def pages_of(pdf: bytes) -> int:
    """Pages of a PDF, also where its objects are compressed."""
    parts = [pdf]
    for found in re.finditer(rb"stream\r?\n", pdf):
        try:
            parts.append(zlib.decompressobj().decompress(pdf[found.end() :]))
        except zlib.error:
            continue
    return sum(len(re.findall(rb"/Type\s*/Page\b(?!s)", part)) for part in parts)


@pytest.mark.parametrize("width", [400, 1110, 1200, 1310, 1440])
def test_the_severity_of_every_fault_is_on_the_page(open_page: OPEN, width: int) -> None:
    page = open_page("five_faults")
    page.set_viewport_size({"width": width, "height": 900})
    for cell in page.locator(".faults tr.fault td:last-child").all():
        box = cell.bounding_box()
        assert box is not None
        assert box["width"] > 40
        assert box["x"] + box["width"] <= width
