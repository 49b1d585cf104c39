"""Pages of missions whose columns are extremes: every sample around faults, and no spike is lost at any zoom."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.browser.downloads import saved
from tests.browser.evidence_samples import SPIKES, spikes, spikes_long
from tests.campaigns import campaign

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]


def shown(page: Any, low: float, high: float, column: str = "wheel.FR.v") -> list[list[float]]:
    """Brings the explorer's plot to a time and gives its curve."""
    page.evaluate(f"location.hash = '#fault=F1&t={low},{high}&plots={column}'")
    page.wait_for_url(re.compile(f"t={low:.4f},{high:.4f}&plots"))
    figure = page.locator("#signals-figure")
    for _ in range(100):
        found = [float(v) for v in page.evaluate("document.getElementById('signals-figure').layout.xaxis.range")]
        if found == [low, high]:
            break
        page.wait_for_timeout(50)
    assert found == [low, high]
    expect(figure).to_be_visible()
    curve: list[list[float]] = page.evaluate(
        "(d => [Array.from(d.x), Array.from(d.y)])(document.getElementById('signals-figure').data[0])"
    )
    return curve


@pytest.mark.parametrize("name", campaign(["spikes_long", "spikes"]))
def test_three_milliseconds_are_seen_at_every_zoom(open_page: OPEN, name: str) -> None:
    page = open_page(name, "#fault=F1&t=0,120&plots=wheel.FR.v")
    page.locator("#signals-figure .main-svg").first.wait_for()
    for low, high in ((0.0, 120.0), *((at - w, at + w) for at in SPIKES for w in (20.0, 3.0, 0.4, 0.01))):
        x, y = shown(page, round(low, 4), round(high, 4))
        peaks = [t for t, v in zip(x, y, strict=True) if v > 1.9]
        wide = (high - low) / 100 + 0.07
        for at in SPIKES:
            if low <= at <= high:
                assert any(abs(t - at) < wide for t in peaks), (low, high, at)
        assert all(min(abs(t - at) for at in SPIKES) < wide for t in peaks), (low, high, peaks)


def test_extremes_add_no_turns_to_a_curve_that_rises_and_falls_once(open_page: OPEN) -> None:
    page = open_page("spikes_long", "#fault=F1&t=0,60&plots=evidence.FR.sensor.p_stuck")
    page.locator("#signals-figure .main-svg").first.wait_for()
    _, y = shown(page, 10.0, 60.0, "evidence.FR.sensor.p_stuck")
    turns = np.sign(np.diff(y))
    turns = turns[turns != 0]
    assert np.count_nonzero(turns[1:] != turns[:-1]) == 1
    assert max(y) == pytest.approx(0.96, abs=0.01)


def test_buttons_land_where_every_sample_is_kept(open_page: OPEN) -> None:
    page = open_page("spikes_long")
    page.locator("#figure .main-svg").first.wait_for()
    badge, rows = page.locator("#badge"), page.locator("#figure .annotation-text")
    for fault in ("F1", "F2", "F4"):
        page.locator(f"tr.fault[data-f={fault}] td.num").click()
        for name in ("Onset", "End"):
            page.get_by_role("button", name=name, exact=True).click()
            expect(badge).to_have_text("every sample drawn · 1000 Hz")
            expect(rows.filter(has_text="min–max")).to_have_count(0)
    page.get_by_role("button", name="Mission", exact=True).click()
    expect(badge).to_have_text(re.compile("min–max envelope · .* · every sample around faults"))
    expect(rows.filter(has_text="every sample")).to_have_count(0)


def test_samples_and_edges_are_the_recorded_ones(open_page: OPEN) -> None:
    page = open_page("spikes_long", "#fault=F1&t=29.98,30.02&plots=wheel.FR.v")
    page.locator("#signals-figure .main-svg").first.wait_for()
    _, columns = spikes()
    x, y = shown(page, 29.98, 30.02)
    assert len(x) >= 40
    for t, v in zip(x, y, strict=True):
        assert v == pytest.approx(columns["wheel.FR.v"][round(t * 1000)], abs=2e-4)
    expect(page.locator("article[data-ev=F1]")).to_contain_text("one mark for each sample")


def test_csv_holds_every_sample_near_a_fault_and_extremes_elsewhere(open_page: OPEN) -> None:
    page = open_page("spikes_long", "#fault=F1&t=32.49,32.52&plots=wheel.FR.v")
    page.locator("#signals-figure .main-svg").first.wait_for()

    def table() -> tuple[str, np.ndarray]:
        path = Path(saved(page, page.locator("[data-act=csv][data-of=signals]")).path())
        head, *lines = path.read_text(encoding="utf-8").splitlines()
        return head, np.array([[float(v) for v in line.split(",")] for line in lines])

    shown(page, 32.49, 32.52)
    head, rows = table()
    _, columns = spikes()
    assert head == '"t [s]","wheel.FR.v [m/s]"'
    np.testing.assert_allclose(rows[:, 0], np.arange(32_490, 32_521) / 1000, atol=1e-9)
    np.testing.assert_allclose(rows[:, 1], columns["wheel.FR.v"][32_490:32_521], atol=2e-4)
    shown(page, 77.68, 77.72)
    head, rows = table()
    _, envelopes, _ = spikes_long()
    assert re.fullmatch(r'"t \[s\]","wheel.FR.v \[m/s\] min of (\d+)","wheel.FR.v \[m/s\] max of \1"', head)
    assert rows[:, 2].max() == pytest.approx(1.998, abs=2e-4)
    assert rows[0, 0] <= 77.68
    assert np.nanmax(envelopes["wheel.FR.v"]) == 1.998


def test_no_dashes_run_along_dense_extremes(open_page: OPEN) -> None:
    page = open_page("five_faults")
    page.locator("#figure .main-svg").first.wait_for()
    said = page.evaluate("""() => {
      const x = [...Array(400).keys()], band = { exact: false, x, y: x.map(i => i % 2 ? 1 : -1) };
      const calm = { exact: false, x, y: x.map(i => Math.sin(i / 50)) }, part = { ...calm, y: calm.y.map((v, i) => i < 350 ? v : band.y[i]) };
      const s = { width: 1.5, dash: 'dash' };
      return [band, part, calm, { ...band, exact: true }].map(c => Figure.line(s, c)).map(l => [l.dash, l.opacity < 1]);
    }""")
    assert said == [["solid", True], ["solid", True], ["dash", False], ["dash", False]]
