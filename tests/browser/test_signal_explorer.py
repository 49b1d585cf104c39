"""The signal explorer in Chromium: any column, in any plot, by keyboard alone, at the time of the evidence."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import welch

from tests.browser.downloads import saved
from tests.browser.figures import shows_time
from tests.report_samples import five_faults

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]


def settled(page: Any, address: str) -> None:
    page.wait_for_url(re.compile(address))


def test_signals_are_chosen_and_removed_without_a_mouse(open_page: OPEN) -> None:
    page = open_page("five_faults", "#fault=F1&t=27,39")
    expect(page.locator("#found")).to_have_text(re.compile(r"^(\d+) of \1$"))
    page.keyboard.press("s")
    page.keyboard.type("FR.v_t")
    expect(page.locator("#columns option")).to_have_text(["wheel.FR.v_true"])
    page.keyboard.press("Enter")
    settled(page, "plots=wheel.FR.v_true$")
    page.locator("#signals-figure .main-svg").first.wait_for()
    expect(page.locator("#signals-badge")).to_have_text("every sample drawn · 100 Hz")
    page.keyboard.press("ControlOrMeta+A")
    page.keyboard.type("path")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    settled(page, "plots=wheel.FR.v_true;path.y$")
    page.locator("#into").select_option(label="plot 1")
    page.get_by_role("button", name="Add", exact=True).press("Enter")
    settled(page, "plots=wheel.FR.v_true,path.y;path.y$")
    expect(page.locator("#signals-figure")).to_contain_text("→ (m)")
    expect(page.locator("#signals-figure")).to_contain_text("every sample")
    page.get_by_role("button", name="Remove path.y from plot 1").press("Enter")
    settled(page, "plots=wheel.FR.v_true;path.y$")
    page.get_by_role("button", name="Remove all").press("Enter")
    settled(page, r"#fault=F1&t=27\.0000,39\.0000$")
    expect(page.locator("#signals-figure")).to_be_hidden()


def test_plots_keep_the_time_of_the_evidence_while_linked(open_page: OPEN) -> None:
    page = open_page("five_faults", "#fault=F1&t=27,39&plots=wheel.FR.v;wheel.FR.u")
    page.locator("#signals-figure .main-svg").first.wait_for()
    page.locator("#figure .main-svg").first.wait_for()
    shows_time(page, "signals-figure", [27.0, 39.0])
    page.locator("#signals-figure").focus()
    page.keyboard.press("ArrowRight")
    settled(page, r"t=30\.0000,42\.0000&")
    page.keyboard.press("+")
    settled(page, r"t=33\.0000,39\.0000&")
    expect(page.locator("#figure").get_by_text("34", exact=True)).to_be_visible()
    shows_time(page, "figure", [33.0, 39.0])
    page.get_by_label("same time as the evidence").uncheck()
    page.locator("#signals-figure").focus()
    page.keyboard.press("m")
    expect(page.locator("#signals-badge")).to_contain_text("envelope")
    shows_time(page, "signals-figure", [0.0, 120.0])
    shows_time(page, "figure", [33.0, 39.0])


def test_one_sample_is_seen_in_the_whole_mission(open_page: OPEN) -> None:
    page = open_page("spike", "#fault=F1&t=0,120&plots=imu.yaw_rate")
    page.locator("#signals-figure .main-svg").first.wait_for()
    expect(page.locator("#signals-figure")).to_contain_text("min–max of")
    x, y = page.evaluate("(d => [Array.from(d.x), Array.from(d.y)])(document.getElementById('signals-figure').data[0])")
    assert max(y) == pytest.approx(np.degrees(0.5), rel=2e-3)
    assert x[int(np.argmax(y))] == pytest.approx(77.77)
    assert len(y) < 4000


def test_files_of_the_chosen_signals(open_page: OPEN) -> None:
    page = open_page("five_faults", "#fault=F1&t=30,30.05&plots=wheel.FR.v,cmd,wheel.FR.v;path.x;cmd")
    page.locator("#signals-figure .main-svg").first.wait_for()
    settled(page, "plots=wheel.FR.v;path.x$")
    tools = page.locator("#signals-tools")
    download = saved(page, tools.get_by_role("button", name="CSV of view"))
    lines = Path(download.path()).read_text(encoding="utf-8").splitlines()
    assert lines[0] == '"t [s]","wheel.FR.v [m/s]","path.x [m]"'
    for form, begin in (("PNG", b"\x89PNG\r\n\x1a\n"), ("SVG", b"<svg")):
        download = saved(page, tools.get_by_role("button", name=form))
        assert download.suggested_filename == f"signals.{form.lower()}"
        assert Path(download.path()).read_bytes().startswith(begin)


def test_hostile_names_are_found_and_stay_text(open_page: OPEN) -> None:
    page = open_page("hostile")
    page.keyboard.press("s")
    page.keyboard.type("<script>")
    page.keyboard.press("Enter")
    page.locator("#signals-figure .main-svg").first.wait_for()
    expect(page.locator("#plots")).to_contain_text("<script>alert(1)</script>")
    expect(page.locator("#signals-figure")).to_contain_text("<script>alert(1)</script>")
    assert page.evaluate("document.querySelectorAll('img, main script').length") == 0
    address = page.evaluate("location.hash")
    page.evaluate("history.replaceState(null, '', '#')")
    page.get_by_role("button", name="Remove all").click()
    page.evaluate("a => { location.hash = a }", address)
    expect(page.locator("#plots")).to_contain_text("<script>alert(1)</script>")


def test_no_fault_no_link_to_evidence_but_signals(open_page: OPEN) -> None:
    page = open_page("no_faults", "#t=10,20&plots=wheel.FR.v")
    page.locator("#signals-figure .main-svg").first.wait_for()
    shows_time(page, "signals-figure", [10.0, 20.0])
    page.keyboard.press("-")
    settled(page, r"#t=5\.0000,25\.0000&plots=wheel.FR.v$")


def test_signals_stand_by_part_and_several_are_added_at_once(open_page: OPEN) -> None:
    page = open_page("five_faults", "#fault=F1&t=27,39")
    groups = page.eval_on_selector_all("#columns optgroup", "all => all.map(g => g.label)")
    assert {"FR", "RL", "front", "machine"} <= set(groups)
    assert len(groups) == len(set(groups))
    page.locator("#columns").select_option(["wheel.FR.v", "wheel.FL.v"])
    page.get_by_role("button", name="Difference").click()
    settled(page, r"plots=wheel\.FL\.v%7Cwheel\.FR\.v$")
    page.get_by_role("button", name="Change per second").click()
    settled(page, r";d%3Awheel\.FL\.v,d%3Awheel\.FR\.v$")
    figure = page.locator("#signals-figure")
    expect(figure).to_contain_text("wheel.FL.v − wheel.FR.v")
    expect(figure).to_contain_text("(m/s²)")
    columns = five_faults()[1]
    inside = (columns["t"] >= 28) & (columns["t"] <= 29)
    page.evaluate("location.hash = '#fault=F1&t=28,29&plots=wheel.FR.v%7Cwheel.FL.v;d%3Awheel.FL.v'")
    settled(page, r"t=28\.0000,29\.0000&plots=wheel\.FR")
    expect(figure).not_to_contain_text("Plot 3")
    page.wait_for_timeout(500)
    x, y, slope = page.evaluate(
        "(d => [Array.from(d[0].x), Array.from(d[0].y), Array.from(d[1].y)])(document.getElementById('signals-figure').data)"
    )
    keep = [i for i, t in enumerate(x) if 28 - 1e-6 <= t <= 29 + 1e-6]
    apart = columns["wheel.FR.v"] - columns["wheel.FL.v"]
    assert np.allclose(np.array(y)[keep], apart[inside], atol=2e-3)
    assert np.allclose(np.array(slope)[keep], np.gradient(columns["wheel.FL.v"], 0.01)[inside], atol=0.25)


def test_ready_choices_and_signals_against_each_other(open_page: OPEN) -> None:
    page = open_page("five_faults", "#fault=F1&t=27,39")
    page.locator("#preset").select_option("All speeds")
    settled(page, r"plots=wheel\.\w\w\.v,wheel\.\w\w\.v,wheel\.\w\w\.v,wheel\.\w\w\.v$")
    page.locator("#preset").select_option("Paper’s figure: Wheel speeds")
    expect(page.locator("#plots li")).to_have_count(4)
    page.locator("#preset").select_option("Opening against speed")
    settled(page, r"&view=xy$")
    expect(page.locator("#signals-other")).to_have_attribute("data-view", "xy")
    x, y = page.evaluate("(d => [Array.from(d.x), Array.from(d.y)])(document.getElementById('signals-other').data[0])")
    assert len(x) == len(y) == pytest.approx(1200, abs=5)
    assert max(x) > 10  # per cent of opening


def test_spectrum_is_that_of_welch(open_page: OPEN) -> None:
    page = open_page("five_faults", "#fault=F1&t=10,25&plots=wheel.FR.v&view=spectrum")
    expect(page.locator("#signals-other")).to_have_attribute("data-view", "spectrum")
    expect(page.locator("#signals-other")).to_contain_text("Welch, ")
    t = np.arange(3000) * 0.01
    y = np.sin(2 * np.pi * 7 * t) + 0.1 * np.random.default_rng(1).standard_normal(len(t))
    found = page.evaluate("y => Views.welch(y, 0.01)", y.tolist())
    frequency, power = welch(y, 100.0, nperseg=found["length"])
    assert found["length"] == 512
    assert np.allclose(found["f"], frequency)
    assert np.allclose(found["p"], power, rtol=1e-6)
