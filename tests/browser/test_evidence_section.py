"""The evidence section in Chromium: what decided each fault, with and without JavaScript, on narrow and wide screens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from tests.campaigns import campaign

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]
OVERFLOW = (
    "[...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth > e.clientWidth + 1)"
    ".map(e => e.getAttribute('aria-label'))"
)


def test_first_fault_shows_what_decided(open_page: OPEN) -> None:
    page = open_page("decided")
    article = page.locator("article[data-ev=F1]")
    expect(article).to_contain_text("Rests on second measurement: wheel.FR.v, wheel.FR.v_true")
    expect(article).to_contain_text("detected 20 ms after onset")
    expect(article).to_contain_text("Shape of the onset The measured speed dropped by 0.15 m/s at once")
    expect(article.locator(".edges svg.panel")).to_have_count(2)
    figure = article.locator("#figure")
    figure.locator(".main-svg").first.wait_for()
    expect(figure).to_contain_text("Probability that it deviates")
    expect(figure).to_contain_text("limit 0.9")
    expect(article.locator(".course")).to_be_hidden()


def test_plots_move_to_the_chosen_fault(open_page: OPEN) -> None:
    page = open_page("decided", "#fault=F4")
    expect(page.locator("article[data-ev=F4] #figure")).to_be_visible()
    expect(page.locator("article[data-ev=F4]")).to_contain_text("when it would have been detected is not known")
    page.keyboard.press("k")
    expect(page.locator("article[data-ev=F3] #figure")).to_be_visible()
    expect(page.locator("article[data-ev=F3] .edges")).to_contain_text("detected +4 s →")


def test_samples_are_dots_when_few_are_in_view(open_page: OPEN) -> None:
    page = open_page("decided", "#fault=F1&t=29.9,30.1")
    page.locator("#figure .scatterlayer .points path").first.wait_for()
    page.get_by_role("button", name="Mission", exact=True).click()
    expect(page.locator("#badge")).to_contain_text("envelope")
    expect(page.locator("#figure .scatterlayer .points path")).to_have_count(0)


def test_pictures_need_no_javascript(open_page: OPEN) -> None:
    page = open_page("decided", script=False)
    for fault in ("F1", "F2", "F3", "F4", "F5"):
        article = page.locator(f"article[data-ev={fault}]")
        expect(article.locator(".course svg.panel")).to_have_count(3)
        expect(article.locator(".course svg.panel").last).to_be_visible()
        expect(article.locator(".edges svg.panel").first).to_be_visible()


def test_injected_faults_are_announced(open_page: OPEN) -> None:
    expect(open_page("decided").locator(".banner")).to_contain_text("faults were injected into a recording")
    expect(open_page("five_faults").locator(".banner")).to_have_count(0)


@pytest.mark.parametrize("script", [True, False])
@pytest.mark.parametrize("width", campaign([360, 420]))
def test_narrow_screens_scroll_down_only(open_page: OPEN, width: int, script: bool) -> None:
    page = open_page("decided", width=width, script=script)
    if script:
        page.locator("#figure .main-svg").first.wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(OVERFLOW) == []


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_marks_stand_out_from_the_card(open_page: OPEN, theme: str) -> None:
    page = open_page("decided", theme=theme)
    colours = page.evaluate(
        "['.edges .smp', '.edges .ref'].map(s => getComputedStyle(document.querySelector(s)).stroke)"
        ".concat(getComputedStyle(document.querySelector('.card.evidence')).backgroundColor)"
    )
    assert len(set(colours)) == 3


def test_what_is_not_identifiable_is_no_faults_band(open_page: OPEN) -> None:
    """Both were grey bands as high as the panel beside a fault without signal."""
    page = open_page("five_faults")
    page.evaluate("Data.later()")
    heights = page.evaluate(
        """() => { const layout = { shapes: [], annotations: [] }, row = { component: "FR", unknown: [[1, 2]], small: [[3, 4]] };
          const figure = Object.assign(Object.create(Figure.prototype), { rows: [row], shades: [], curves: [] });
          figure.perRow = () => []; figure.shade(layout);
          return layout.shapes.map((s) => s.y1); }"""
    )
    assert heights == [0.09, 1]
