"""Keys, addresses, files and paper of the report page in Chromium."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests import report_samples as samples
from tests.browser.downloads import saved

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]


def drawn(page: Any) -> Any:
    page.locator("#figure .main-svg").first.wait_for()
    expect(page.locator("#badge")).not_to_have_text("drawing")
    return page


def pages_of(pdf: bytes) -> int:
    return len(re.findall(rb"/Type\s*/Page\b(?!s)", pdf))


def test_arrows_pan_and_signs_zoom_within_the_mission(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", "#fault=F1&t=20,40"))
    for key, low, high in (
        ("ArrowRight", 25, 45),
        ("ArrowLeft", 20, 40),
        ("+", 25, 35),
        ("-", 20, 40),
        ("-", 10, 50),
        ("ArrowLeft", 0, 40),
        ("ArrowLeft", 0, 40),
        ("m", 0, 120),
    ):
        page.keyboard.press(key)
        page.wait_for_url(re.compile(f"#fault=F1&t={low}\\.0000,{high}\\.0000$"))


def test_back_and_forward_walk_through_the_faults(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", "#fault=F1&t=20,40"))
    heading = page.locator(".ev:not([hidden]) h2")
    page.keyboard.press("j")
    expect(heading).to_have_text(re.compile("^F2 · "))
    page.keyboard.press("j")
    expect(heading).to_have_text(re.compile("^F3 · "))
    page.go_back()
    expect(heading).to_have_text(re.compile("^F2 · "))
    page.go_back()
    expect(heading).to_have_text(re.compile("^F1 · "))
    page.wait_for_url(re.compile(r"#fault=F1&t=20\.0000,40\.0000$"))
    page.go_forward()
    expect(heading).to_have_text(re.compile("^F2 · "))
    page.evaluate("location.hash = '#fault=F1&t=31'")
    page.wait_for_url(re.compile(r"#fault=F1&t=30\.5000,31\.5000$"))


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ("fault=F99", "There is no fault F99 in this report: F1 is shown."),
        ("fault=F2&t=abc", "“abc” is not a time: expected t=seconds or t=from,to."),
        ("fault=F2&plots=wheel.FR.v,nope.v", "There is no signal nope.v in this report."),
        ("fault=%3Cb%3E&t=3,1", "There is no fault <b> in this report: F1 is shown. “3,1” is not a time"),
    ],
)
def test_what_the_address_asks_for_and_is_not_there_is_said(open_page: OPEN, asked: str, words: str) -> None:
    page = drawn(open_page("five_faults", f"#{asked}"))
    expect(page.locator("#missing")).to_contain_text(words)
    expect(page.locator("#live")).to_contain_text(words)
    page.keyboard.press("j")
    expect(page.locator("#missing")).to_have_count(0)


def test_each_plot_tells_how_it_is_drawn(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", "#fault=F1&t=29,31"))
    rows = page.evaluate("document.getElementById('figure').layout.annotations.filter(a => a.xref === 'paper').length")
    marks = page.locator("#figure .annotation-text", has_text="every sample")
    expect(marks).to_have_count(rows)
    page.keyboard.press("m")
    expect(page.locator("#figure .annotation-text", has_text="min–max of ")).to_have_count(rows)


def test_extremes_stored_of_a_long_mission_are_never_called_samples(open_page: OPEN) -> None:
    page = drawn(open_page("long_mission", "#fault=F1&t=29,31"))
    expect(page.locator("#badge")).to_contain_text("extremes of 64 samples stored")
    expect(page.locator("#badge")).to_contain_text("every sample: mfhca diagnose LOG --start 24 --end 36")
    expect(page.locator("#figure")).to_contain_text("min–max of 64 samples, times to ")
    dt, start, grey = page.evaluate(
        "[Data.view.dt, Data.view.faults.find((f) => f.id === 'F1').start,"
        " document.getElementById('figure').layout.shapes.filter((s) => s.opacity === 0.3).map((s) => [s.x0, s.x1])]"
    )
    assert grey[0][0] <= start <= grey[0][1] + 1e-9
    assert grey[0][1] - grey[0][0] == pytest.approx(64 * dt)
    expect(page.locator("#figure")).not_to_contain_text("every sample")
    download = saved(page, page.locator("[data-act=csv][data-of=evidence]"))
    assert " min of 64" in Path(download.path()).read_text(encoding="utf-8").splitlines()[0]


def test_files_of_a_fault(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults"))
    download = saved(page, page.get_by_role("button", name="JSON"))
    assert download.suggested_filename == "F1.json"
    assert json.loads(Path(download.path()).read_text("utf-8")) == samples.five_faults()[0]["intervals"][0]
    for form, begin in (("PNG", b"\x89PNG\r\n\x1a\n"), ("SVG", b"<svg")):
        download = saved(page, page.locator("#evidence").get_by_role("button", name=form))
        assert download.suggested_filename == f"F1.{form.lower()}"
        assert Path(download.path()).read_bytes().startswith(begin)


def test_table_of_faults_as_csv(open_page: OPEN) -> None:
    page = open_page("hostile")
    download = saved(page, page.get_by_role("button", name="CSV", exact=True))
    with Path(download.path()).open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert head[:6] == ["id", "component", "side", "mode", "start [s]", "stop [s]"]
    intervals = samples.hostile()[0]["intervals"]
    assert [r[0] for r in rows] == [f["id"] for f in intervals]
    assert [float(r[4]) for r in rows] == [f["start_s"] for f in intervals]
    assert not any(cell.startswith(("=", "+", "@")) for r in rows for cell in r)


def test_thousands_of_faults_all_have_their_evidence(open_page: OPEN) -> None:
    page = drawn(open_page("thousands", "#fault=F1198"))
    brief = page.locator("#brief")
    expect(brief.locator("h2")).to_have_text("F1198 · FL speed sensor stuck at 0.21 m/s")
    expect(brief).to_contain_text(samples.five_faults()[0]["intervals"][0]["evidence"][0])
    expect(brief.locator("#figure")).to_be_visible()
    expect(page.locator("tr.fault[aria-current]")).to_contain_text("F1198")
    page.locator("[data-act=copy]").click()
    copied = re.compile("F1198 FL speed sensor stuck")
    expect(page.locator("[data-act=copy]")).to_have_attribute("data-copied", copied)
    page.evaluate("location.hash = '#fault=F1'")
    expect(page.locator("article[data-ev=F1]")).to_be_visible()
    expect(brief).to_be_hidden()
    assert pages_of(page.pdf(format="A4")) == 2


@pytest.mark.parametrize(("name", "script"), [("five_faults", True), ("no_faults", False), ("hostile", False)])
def test_two_pages_on_paper(open_page: OPEN, name: str, script: bool) -> None:
    page = open_page(name, theme="dark", script=script)
    for paper in ("A4", "Letter"):
        assert pages_of(page.pdf(format=paper)) <= 2
    page.emulate_media(media="print")
    expect(page.locator("header.top")).to_be_hidden()
    expect(page.locator("#verdict")).to_be_visible()


def test_everything_on_paper_in_light_colours(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", theme="dark"))
    page.evaluate("window.print = () => { window.asked = document.documentElement.dataset.print }")
    page.get_by_role("button", name="Print all").click()
    assert page.evaluate("window.asked") == "all"
    assert pages_of(page.pdf(format="A4")) > 2
    page.evaluate("document.documentElement.dataset.print = 'all'")
    page.emulate_media(media="print")
    expect(page.locator("article.ev").last).to_be_visible()
    assert page.locator("html").get_attribute("data-theme") == "dark"


def test_no_sheet_of_paper_cuts_a_plot(open_page: OPEN) -> None:
    page = open_page("five_faults")
    page.locator("#figure .main-svg").first.wait_for()
    rows = page.locator("#figure .subplot").count()
    page.evaluate("document.documentElement.dataset.print = 'all'; dispatchEvent(new Event('beforeprint'))")
    sheets = page.locator("#figure, #figure ~ .sheet")
    assert sheets.count() == -(-rows // 5)
    heights = [s.bounding_box()["height"] for s in sheets.all()]
    assert max(heights) <= 1000  # an A4 sheet with its margins has 1030 CSS pixels
    plots = page.evaluate("document.querySelectorAll('#figure .subplot, .sheet .subplot').length")
    assert plots == rows
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.locator(".sheet").wait_for(state="detached")
    assert page.locator("#figure .subplot").count() == rows
