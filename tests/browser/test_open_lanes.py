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
        re.compile(r"^(Nearest to|Furthest beyond) its threshold at \d+\.\d{3} s: residual ")
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
