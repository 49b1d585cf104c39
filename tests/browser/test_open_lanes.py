"""Lanes without a fault in Chromium: opened, they show residual, nearest approach to the threshold and what would have shown."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.evidence_samples import healthy_evidence

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]


def test_a_healthy_lane_is_opened_by_keyboard(open_page: OPEN) -> None:
    page = open_page("healthy_evidence")
    lane = page.locator(".more[data-part='FR.sensor']")
    lane.locator("summary").press("Enter")
    lane.locator(".main-svg").first.wait_for()
    residual, threshold = (healthy_evidence()[1][f"evidence.FR.sensor.{n}"] for n in ("residual", "threshold"))
    near = max(abs(residual) / threshold)
    expect(lane.locator(".near")).to_have_text(
        re.compile(r"^(Nearest to|Furthest beyond) its threshold at \d:\d\d\.\d{3}: residual ")
    )
    part = re.search(r"([\d.]+) % of the threshold", lane.locator(".near").inner_text())
    assert part
    assert float(part[1]) == pytest.approx(100 * near, rel=0.03)
    expect(lane.locator(".lane-figure")).to_contain_text("± threshold")
    page.locator(".more .lane-figure").first.focus()
    page.keyboard.press(".")
    expect(lane.locator(".reading p").first).to_contain_text(" s ")


def test_an_open_lane_says_how_near_each_check_came(open_page: OPEN) -> None:
    page = open_page("healthy_evidence", script=False)
    lane = page.locator(".more").first
    lane.locator("summary").click()
    expect(lane.locator(".part")).to_contain_text("against its second measurement")
    expect(lane.locator(".part")).to_contain_text("15 %, limit 25 %; largest at 1:07.5")
    expect(lane.locator(".part")).to_contain_text(re.compile(r"Loss for 2\ss\s*30\s%"))


@pytest.mark.parametrize("width", [1440, 400])
def test_an_open_lane_reads_in_lines(open_page: OPEN, width: int) -> None:
    """The values stood one letter a line in a lane of 7000 px."""
    page = open_page("healthy_evidence")
    page.set_viewport_size({"width": width, "height": 900})
    page.locator(".more").first.locator("summary").click()
    values = page.locator(".more[open] .part .kv dd")
    long = "speed per opening beside the other wheels', from one part of the mission to the next, or growing"
    page.locator(".more[open] .part .kv dt").first.evaluate("(e, long) => { e.textContent = long; }", long)
    assert min(values.evaluate_all("es => es.map((e) => e.offsetWidth)")) > 150
    assert max(values.evaluate_all("es => es.map((e) => e.offsetHeight)")) < 90


def test_a_threshold_that_is_huge_for_a_moment_does_not_flatten_the_residual(open_page: OPEN) -> None:
    page = open_page("healthy_evidence")
    page.evaluate("Data.later()")
    spans = page.evaluate(
        """async () => { const row = Lanes.rows("FR", "sensor").find((r) => r.threshold !== undefined), real = Data.samples, found = [];
          for (const huge of [0, 100]) {
            Data.samples = async (c, ...more) => { const d = await real.call(Data, c, ...more), y = Float64Array.from(d.y); if (c === row.threshold && huge) y[0] = huge; return { ...d, y }; };
            found.push((await Lanes.nearest(row)).span);
          }
          Data.samples = real; return found; }"""
    )
    assert spans[1] == pytest.approx(spans[0], rel=0.2)
