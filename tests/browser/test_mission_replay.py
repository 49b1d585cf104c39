"""The mission played in Chromium: one clock for machine, path, plots and mode probabilities; sentences at thresholds."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]


def test_one_clock_moves_everything(open_page: OPEN) -> None:
    page = open_page("decided", "#fault=F1&t=27,39")
    expect(page.locator("#stage")).to_be_hidden()
    page.locator("#scrub").fill("33")
    expect(page.locator("#clock")).to_have_text("0:33.00")
    expect(page.locator("#stage-machine [data-c=FR] rect.tyre")).to_have_class("tyre stuck")
    expect(page.locator("#stage-machine [data-c=FR] .live text").first).to_contain_text("0.21 m/s")
    inside = """() => [...document.querySelectorAll('#stage-machine [data-c] > rect.tyre')].every(tyre => [...tyre.parentNode.querySelectorAll(
      '.live rect')].every(bar => { const [a, b] = [bar, tyre].map(e => e.getBoundingClientRect()); return b.left < a.left && a.right < b.right && b.top
      < a.top && a.bottom < b.bottom; }))"""
    assert page.evaluate(inside), "no bar is hidden by an axle"
    expect(page.locator("#stage-machine [data-c=FR] .live text").first).to_contain_text(
        re.compile(r"(valve|asked) −?[\d.]+ %")
    )
    expect(page.locator("#stage-machine [data-c=FR] .says")).to_have_text("stuck")  # at this time, not over the mission
    assert page.locator("#stage-path .here").get_attribute("visibility") == "visible"
    expect(page.locator("#stage-modes > div", has_text="FR speed sensor")).to_contain_text(
        "stuck 99 %"
    )  # as it is stated
    page.locator("#stage-figure .reading p").first.wait_for()
    page.locator("#figure .reading p").first.wait_for()
    page.locator("#scrub").fill("10")
    expect(page.locator("#stage-machine [data-c=FR] rect.tyre")).to_have_class("tyre healthy")
    expect(page.locator("#stage-machine [data-c=FR] .says")).to_have_text("healthy")


def test_a_fault_is_called_at_its_time_what_its_heading_calls_it(open_page: OPEN) -> None:
    page = open_page("unclear", "#fault=F1&t=27,39")
    page.locator("#scrub").fill("33")
    part = page.locator("#stage-modes > div", has_text="FR speed sensor")
    expect(part.locator("span").last).to_have_text("faulty, kind unclear")
    expect(page.locator("#stage-machine [data-c=FR] .says")).to_have_text("faulty, kind unclear")


def test_sentences_say_why_now_and_lead_to_their_time(open_page: OPEN) -> None:
    page = open_page("decided", "#fault=F1&t=27,39")
    page.locator("#scrub").fill("36.5")
    first = page.locator(
        "#events button", has_text="FR speed sensor: the probability that it deviates passes 90 %"
    ).first
    expect(first).to_contain_text(
        re.compile(r"^0:30\.\d{3} · FR .*stuck \d+ %; the residual is [\d.]+ times its threshold\.$")
    )
    expect(page.locator("#events button", has_text="FR speed sensor: the residual").first).to_contain_text(
        re.compile(r"m/s, passes its threshold of 0\.0\d+ m/s")
    )
    expect(page.locator("#why")).to_contain_text("falls below 90 % again")
    first.click()
    expect(page.locator("#clock")).to_have_text(re.compile(r"^0:30\.\d\d$"))
    expect(page.locator("#why")).to_contain_text("FR speed sensor")


def test_it_plays_and_pauses_by_a_key(open_page: OPEN) -> None:
    page = open_page("decided", "#fault=F1&t=27,39")
    page.locator("#speed").select_option("20")
    page.locator("#verdict").click()
    page.keyboard.press("p")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    expect(page.locator("#clock")).not_to_have_text(re.compile(r"^0:0[01]\."))
    page.keyboard.press("p")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    stands = page.locator("#clock").inner_text()
    page.wait_for_timeout(200)
    assert page.locator("#clock").inner_text() == stands


def test_plots_follow_the_clock_to_where_it_is_led(open_page: OPEN) -> None:
    page = open_page("decided", "#fault=F1&t=27,39")
    page.locator("#figure .main-svg").first.wait_for()
    expect(page.locator("#badge")).not_to_have_text("drawing")
    page.locator("#scrub").fill("80")
    page.wait_for_url(re.compile(r"#fault=F1&t=74\.0000,86\.0000$"))
    first = page.locator("#events button", has_text="FR speed sensor: the probability").first
    first.click()
    page.wait_for_url(re.compile(r"#fault=F1&t=2[45]\.\d+,3[67]\.\d+$"))
    page.keyboard.press("m")
    page.keyboard.press("j")  # what is chosen takes the clock along
    page.wait_for_url(re.compile(r"#fault=F2&"))
    page.wait_for_function(
        "() => { const [a, b] = document.getElementById('figure').layout.xaxis.range; return Now.t >= a && Now.t <= b; }"
    )


def test_a_probability_without_a_fault_says_what_the_residual_does(open_page: OPEN) -> None:
    page = open_page("unstated")
    page.locator("#scrub").fill("61")
    said = page.locator("#events button", has_text=re.compile(r"^1:00\.\d{3} · FL drive valve: the probability"))
    expect(said).to_contain_text("no fault is stated here: the residual does not stay beyond its threshold.")
