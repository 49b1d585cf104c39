"""Reading values in Chromium: a cursor for the whole page, markers, scales, other looks at the rows of a fault."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]
RANGE = "a => document.getElementById('figure').layout[a].range"


def drawn(page: Any) -> Any:
    page.locator("#figure .main-svg").first.wait_for()
    expect(page.locator("#badge")).not_to_have_text("drawing")
    return page


def until(page: Any, words: str) -> None:
    """Wait until an expression holds: the page's policy forbids the browser's own way of waiting."""
    for _ in range(200):
        if page.evaluate(words):
            return
        page.wait_for_timeout(50)
    raise AssertionError(words)


def at(page: Any, seconds: float) -> dict[str, float]:
    """Where a time stands in the first row of the evidence."""
    page.locator("#looks").scroll_into_view_if_needed()
    return page.evaluate(  # type: ignore[no-any-return]
        "t => { const e = document.getElementById('figure'), b = e.getBoundingClientRect(), l = e._fullLayout;"
        " return { x: b.left + l.xaxis._offset + l.xaxis.l2p(t), y: b.top + l.yaxis._offset + 20 }; }",
        seconds,
    )


def test_cursor_and_markers_stand_in_headings_and_pictures(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", "#fault=F1&t=27,39"))
    place = at(page, 33.0)
    page.mouse.move(place["x"], place["y"])
    heads = page.locator("#figure .reading p")
    expect(heads).to_have_count(page.evaluate("document.getElementById('figure').layout.annotations.length"))
    expect(heads.first).to_contain_text(re.compile(r"0:3[23]\.\d{4} .*measured 0\.21"))
    expect(page.locator("#timeline .now").first).to_be_visible()
    assert page.locator("#path .here").get_attribute("visibility") == "visible"
    expect(page.locator(".machine [data-c=FR] .live text")).to_contain_text("0.21 m/s")
    expect(page.locator(".machine [data-c=FR] rect.tyre")).to_have_class("tyre stuck")
    page.mouse.click(place["x"], place["y"])
    place = at(page, 37.0)
    page.keyboard.down("Shift")
    page.mouse.click(place["x"], place["y"])
    page.keyboard.up("Shift")
    expect(heads.first).to_contain_text(re.compile(r"Δt (3\.9|4)"))
    expect(heads.first).to_contain_text(re.compile(r"measured 0\.\d+ Δ 0\.\d+"))
    page.keyboard.press("Escape")
    expect(heads).to_have_count(0)
    expect(page.locator("#timeline .now").first).to_be_hidden()


def test_cursor_and_markers_by_keys_are_spoken(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", "#fault=F1&t=27,39"))
    for key in (".", "a", ">", "b"):
        page.keyboard.press(key)
    expect(page.locator("#live")).to_contain_text(re.compile(r"^0:33\.\d{3}: commanded "))
    expect(page.locator("#figure .reading p").first).to_contain_text("Δt 0.")


def test_a_spike_does_not_flatten_a_robust_scale(open_page: OPEN) -> None:
    page = drawn(open_page("spike", "#t=0,120&plots=imu.yaw_rate"))
    page.locator("#signals-figure .main-svg").first.wait_for()
    height = "(r => r[1] - r[0])(document.getElementById('signals-figure')._fullLayout.yaxis.range)"
    before = page.evaluate(height)
    page.keyboard.press("y")
    expect(page.locator("#signals-figure")).to_contain_text("scale cut, values from ")
    robust = page.evaluate(height)
    assert robust < before / 2
    page.locator("#signals-figure").focus()
    page.keyboard.press("z")
    until(page, f"{height} < {0.6 * robust}")
    taller = page.evaluate(height)
    page.keyboard.press("y")  # off: what was made taller stays so
    page.wait_for_timeout(300)
    assert page.evaluate(height) == pytest.approx(taller)
    page.keyboard.press("Z")
    page.keyboard.press("Z")
    until(page, f"{height} > {1.5 * taller}")


def test_shift_and_scroll_make_values_taller_about_the_pointer_in_its_panel_alone(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", "#fault=F1&t=27,39"))
    axis = "document.getElementById('figure')._fullLayout.yaxis"
    page.locator("#figure").scroll_into_view_if_needed()
    box = page.locator("#figure").bounding_box()
    assert box is not None
    top, tall = (page.evaluate(f"{axis}2.{name}") for name in ("_offset", "_length"))
    low, high = page.evaluate(f"{axis}2.range")
    others = page.evaluate(f"[{axis}.range, {axis}3.range]")
    page.mouse.move(box["x"] + 300, box["y"] + top + 0.25 * tall)
    page.keyboard.down("Shift")
    page.mouse.wheel(0, -100)
    page.keyboard.up("Shift")
    still = high - 0.25 * (high - low)
    until(page, f"({axis}2.range[1] - {axis}2.range[0]) < {0.6 * (high - low)}")
    below, above = page.evaluate(f"{axis}2.range")
    assert above - 0.25 * (above - below) == pytest.approx(still, abs=0.02 * (high - low))
    assert page.evaluate(f"[{axis}.range, {axis}3.range]") == others


def test_residual_over_threshold_and_one_panel_for_all_wheels(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", "#fault=F1&t=27,39"))
    page.get_by_role("button", name="Residual ÷ threshold").click()
    expect(page.locator("#figure")).to_contain_text("Residual ÷ threshold")
    ratio = "document.getElementById('figure').data.find(d => d.name.includes('÷')).y.filter(Number.isFinite)"
    most = max(abs(v) for v in page.evaluate(ratio))
    assert most == pytest.approx(5.0, abs=1.0)
    page.locator("#peers").select_option("v")
    for wheel in ("FR", "FL", "RR", "RL"):
        expect(page.locator("#figure")).to_contain_text(f"Wheel speed {wheel}")
    page.keyboard.press("j")
    expect(page.locator("#figure")).to_contain_text("Wheel speed FL")


def test_a_link_shows_the_fault_that_it_names(open_page: OPEN) -> None:
    top = "document.querySelector('.ev:not([hidden]) h2').getBoundingClientRect().top"
    page = drawn(open_page("five_faults", "#fault=F3&t=40,50"))
    assert 0 < page.evaluate(top) < 450
    page = drawn(open_page("five_faults"))
    assert page.evaluate("scrollY") == 0
    for key in ("j", "j", "g"):
        page.keyboard.press(key)
    until(page, f"{top} > 0 && {top} < 450")
    expect(page.locator(".ev:not([hidden]) h2")).to_have_text(re.compile("^F3 · "))
    expect(page.locator("#figure")).to_be_focused()
    page = open_page("five_faults", "#plots=wheel.FR.v")
    page.locator("#signals-figure .main-svg").first.wait_for()
    where = "document.getElementById('signals').getBoundingClientRect().top"
    until(page, f"{where} > -5 && {where} < 600")


def test_loop_replay_follows_the_time_of_the_evidence(open_page: OPEN) -> None:
    page = drawn(open_page("five_faults", "#fault=F1&t=27,39"))
    page.locator("#loop").scroll_into_view_if_needed()
    page.locator("#loop-figure .main-svg").first.wait_for()
    shown = "document.getElementById('loop-figure').layout.xaxis.range.join()"
    assert page.evaluate(shown) == "27,39"
    page.keyboard.press("+")
    until(page, f"{shown} === '30,36'")
    page.locator("#loop-figure").focus()
    page.keyboard.press("-")
    page.wait_for_url(re.compile(r"t=27\.0000,39\.0000"))
    page.get_by_role("button", name="Whole mission").click()
    until(page, f"{shown} === '0,120'")
    page.wait_for_url(re.compile(r"t=27\.0000,39\.0000"))


def test_spikes_of_a_command_do_not_squash_what_is_measured(open_page: OPEN) -> None:
    page = open_page("five_faults")
    got = page.evaluate(
        """() => { const of = (role) => ({ role }), row = { traces: [of("commanded"), of("measured")] };
          const asked = { y: Array.from({ length: 200 }, (_, i) => (i === 50 ? 9 : Math.sin(i / 9))) }, flat = { y: asked.y.map((v) => Math.min(v, 1)) };
          const read = { y: Array.from({ length: 200 }, (_, i) => 2 * Math.sin(i / 9)) };
          return [Looks.asked(row, [asked, read]), Looks.asked(row, [flat, read]), Looks.asked(row, [flat, { y: asked.y }])]; }"""
    )
    assert (got[0]["most"], got[0]["range"][1] < 3, got[0]["range"][0] <= -1.9) == (9, True, True)
    assert got[1:] == [None, None]  # nothing is cut of what is measured
