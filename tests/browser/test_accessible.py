"""WCAG 2.2 AA and good practice as far as axe-core can tell, and the contrast of the page's colours, in both themes."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from typing import Any

import pytest

from tests.campaigns import campaign, campaign_of_rows

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

OPEN = Callable[..., Any]


@pytest.fixture(scope="module")
def axe() -> str:
    pytest.importorskip("axe_playwright_python", reason="axe-core is not installed: pip install axe-playwright-python")
    return (files("axe_playwright_python") / "axe.min.js").read_text("utf-8")


def breaches(page: Any, axe: str) -> list[str]:
    page.evaluate(axe)
    found = page.evaluate(
        "axe.run(document, { resultTypes: ['violations'] }).then(r => r.violations"
        ".flatMap(v => v.nodes.map(n => v.id + ' ' + n.target.join(' '))))"
    )
    return [str(f) for f in found]


@pytest.mark.parametrize(
    ("name", "width", "theme"),
    campaign_of_rows([("five_faults", 1280, "light"), ("not_assessed", 420, "dark"), ("five_faults", 1280, "dark")], 2),
)
def test_no_breach_of_any_rule(open_page: OPEN, axe: str, name: str, width: int, theme: str) -> None:
    address = "#fault=F1&t=20,50&plots=wheel.FR.v,wheel.FR.u;path.x" if name == "five_faults" else ""
    page = open_page(name, address, width=width, theme=theme)
    for figure in ("#figure", "#loop-figure", "#signals-figure:not([hidden])"):
        if page.locator(figure).count():
            page.locator(figure).scroll_into_view_if_needed()
            page.locator(f"{figure} .main-svg").first.wait_for()
    assert breaches(page, axe) == []
    page.keyboard.press("Escape")
    page.locator("[data-act=help]").click()
    assert breaches(page, axe) == []


def luminance(colour: str) -> float:
    levels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in levels)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


LEAST = (
    (4.5, ("text", "muted", "accent"), ("surface", "surface2", "bg", "accent-bg")),
    (
        3.0,
        ("stuck", "no_signal", "inefficient-line", "noisy", "outside_table", "healthy-text", "teal", "alt"),
        ("surface",),
    ),
)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_colours_stand_out(open_page: OPEN, theme: str) -> None:
    page = open_page("not_assessed", theme=theme)
    read = "n => getComputedStyle(document.documentElement).getPropertyValue('--' + n).trim()"

    def level(name: str) -> float:
        value = page.evaluate(read, name)
        return luminance("#" + "".join(2 * c for c in value[1:]) if len(value) == 4 else value)

    for least, front, back in LEAST:
        for f in front:
            for b in back:
                dark, light = sorted((level(f), level(b)))
                assert (light + 0.05) / (dark + 0.05) >= least, (f, b)


@pytest.mark.parametrize("name", campaign(["decided", "no_faults"]))
def test_no_breach_with_everything_unfolded(open_page: OPEN, axe: str, name: str) -> None:
    page = open_page(name, width=1280)
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    assert breaches(page, axe) == []


def test_a_fault_s_evidence_is_five_keys_away_at_most(open_page: OPEN) -> None:
    page = open_page("decided", width=1280)
    for key in "jg":
        page.keyboard.press(key)
    page.wait_for_function(
        "() => { const box = document.querySelector('article[data-ev=F2] h2').getBoundingClientRect();"
        " return box.top >= 0 && box.bottom <= innerHeight; }"
    )
