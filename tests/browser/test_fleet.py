"""The fleet page in Chromium: no error, no request, no breach of its policy; search, sorting, links and both themes."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import pytest

from diagnosis.audit.fleet_files import write_fleet
from tests import fleet_samples as samples
from tests.campaigns import campaign_of_rows

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect

OPEN = Callable[..., Any]


def few_since() -> list[samples.Sample]:
    """The store that `few` is compared with: two missions less of each machine, and a fault that is gone."""
    older = [s for s in samples.few() if s.day is not None and s.day <= 11]
    noisy = [samples.Fault("RR", "actuator", "noisy", "medium")]
    return [*older, samples.Sample("HX4-02/last", "HX4-02", 11.5, verdict="watch", faults=noisy)]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    root = tmp_path_factory.mktemp("fleets # 1")
    written: dict[str, Path] = {}

    def page(name: str) -> Path:
        if name not in written:
            out = root / name
            missions = getattr(samples, name)()
            store = samples.write_store(out / "fleet.sqlite", missions)
            older = samples.write_store(root / "older" / "fleet.sqlite", few_since()) if name == "few" else None
            for m in missions if name == "few" else ():
                if m.state == "ok":
                    samples.write_report(out, m.name, min_epsilon=0.1, min_assessed=10.0)
            written[name] = write_fleet(store, out, baseline=older).html
        return written[name]

    return page


@pytest.fixture(scope="module")
def axe() -> str:
    pytest.importorskip("axe_playwright_python", reason="axe-core is not installed: pip install axe-playwright-python")
    return (files("axe_playwright_python") / "axe.min.js").read_text("utf-8")


@pytest.mark.parametrize(
    ("name", "width", "theme"),
    [
        ("few", 420, "dark"),
        ("few", 2560, "light"),
        ("few", 3840, "dark"),
        ("hostile", 420, "light"),
        ("hostile", 1280, "dark"),
    ],
)
def test_page_fits_the_screen(open_page: OPEN, name: str, width: int, theme: str) -> None:
    page = open_page(name, width=width, theme=theme)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("html").get_attribute("data-theme") == theme


@pytest.mark.parametrize(
    ("name", "width", "theme"),
    campaign_of_rows(
        [("few", 420, "light"), ("hostile", 1280, "dark"), ("few", 1280, "light"), ("few", 1280, "dark")], 2
    ),
)
def test_no_breach_of_any_rule(open_page: OPEN, axe: str, name: str, width: int, theme: str) -> None:
    page = open_page(name, width=width, theme=theme)
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    page.evaluate(axe)
    found = page.evaluate(
        "axe.run(document, { resultTypes: ['violations'] }).then(r => r.violations"
        ".flatMap(v => v.nodes.map(n => v.id + ' ' + n.target.join(' '))))"
    )
    assert found == []


def test_everything_can_be_read_without_scripts(open_page: OPEN) -> None:
    page = open_page("few", script=False, theme="dark")
    expect(page.get_by_role("heading", level=1)).to_have_text(
        "1 of 6 machines must not go out, 4 may go out, 1 must be checked first"
    )
    expect(page.locator("#machines tbody tr")).to_have_count(6)
    expect(page.locator("#find")).to_be_hidden()
    page.locator("#m0 summary").click()
    expect(page.locator("#m0 tbody tr").first).to_be_visible()
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(15, 20, 26)"


def test_every_link_leads_to_a_report_or_within_the_page(open_page: OPEN) -> None:
    page = open_page("few")
    addresses = page.evaluate("[...document.links].map(a => a.href)")
    outside = {unquote(urlparse(a).path) for a in addresses if "#" not in a or "report.html" in a}
    assert len(outside) > 60
    assert [p for p in outside if not Path(p).is_file()] == []
    inside = {a.partition("#")[2] for a in addresses if "fleet.html#" in a}
    assert [i for i in inside if not page.locator(f"[id='{i}']").count()] == []


def test_strips_show_the_worst_fault_of_each_mission(open_page: OPEN) -> None:
    page = open_page("few")
    cells = page.locator("#machines tbody tr").first.locator(".cells > .c")
    expect(cells).to_have_count(14)
    assert [c.split()[-1] for c in cells.evaluate_all("cells => cells.map(c => c.className)")][-3:] == [
        "inefficient",
        "inefficient",
        "stuck",
    ]
    assert cells.last.get_attribute("title").endswith("front steering sensor stuck and 1 more")
    assert cells.last.get_attribute("href") == "missions/HX4-07/2026-11-14/report.html"


def test_search_finds_missions_by_machine_part_and_mode(open_page: OPEN) -> None:
    page = open_page("few")
    find, rows = page.locator("#find"), page.locator("#missions tbody tr:visible")
    find.fill("rr NO signal")
    expect(page.locator("#hits")).to_have_text("3 of 74")
    expect(rows).to_have_count(3)
    find.fill("hx4-07 2026-11-14")
    expect(rows).to_have_count(1)
    find.fill("")
    page.locator("#which").select_option("failed")
    expect(page.locator("#hits")).to_have_text("2 of 74")
    page.locator("#which").select_option("")
    expect(rows).to_have_count(0)


def test_machines_can_be_sorted_from_the_keyboard(open_page: OPEN) -> None:
    page = open_page("few")
    names = page.locator("#machines tbody th a")
    worst_first = names.all_inner_texts()
    page.locator("[data-sort=bad] button").focus()
    page.keyboard.press("Enter")
    expect(page.locator("[data-sort=bad]")).to_have_attribute("aria-sort", "descending")
    assert names.all_inner_texts()[:3] == ["HX4-07", "HX4-03", "HX4-08"]
    page.locator("[data-sort=rank] button").click()
    assert names.all_inner_texts() == worst_first


def test_a_machines_name_opens_its_missions(open_page: OPEN) -> None:
    page = open_page("few")
    expect(page.locator("#m2 tbody tr").first).to_be_hidden()
    page.locator("#machines tbody th a").nth(2).click()
    expect(page.locator("#m2 tbody tr").first).to_be_visible()


def test_missions_show_their_result_on_a_telephone(open_page: OPEN) -> None:
    page = open_page("few", width=420)
    page.locator("#m0 summary").click()
    row = page.locator("#m0 tbody tr").first
    for cell in row.locator("td").all():
        box = cell.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 420
    expect(row.locator(".st")).to_be_visible()
    scrolled = page.locator("#m0 .scroll")
    assert scrolled.evaluate("e => e.scrollWidth <= e.clientWidth")


def test_paper_has_a_title_and_a_date(open_page: OPEN) -> None:
    page = open_page("few")
    page.emulate_media(media="print")
    expect(page.locator("#verdict h1")).to_be_visible()
    expect(page.locator("#verdict .dated")).to_be_visible()
    expect(page.locator("#verdict .dated")).to_contain_text("logs from 2026-10-26 to 2026-11-08")
    assert "logs from 2026-10-26" in page.title()


def test_theme_can_be_chosen(open_page: OPEN) -> None:
    page = open_page("few", theme="light")
    page.locator("#theme").click()
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")
    expect(page.locator("#theme")).to_have_attribute("aria-pressed", "true")


def test_hostile_names_stay_text(open_page: OPEN) -> None:
    page = open_page("hostile")
    assert page.locator("img").count() == 0
    expect(page.locator("#machines")).to_contain_text(samples.HOSTILE[1])
    page.locator("#find").fill("<script>")
    expect(page.locator("#hits")).to_have_text("2 of 6")
    assert not [a for a in page.evaluate("[...document.links].map(a => a.protocol)") if a != "file:"]


def test_changes_against_the_earlier_audit_stand_on_top(open_page: OPEN) -> None:
    page = open_page("few")
    changes = page.locator("#changes")
    expect(changes.locator(".badge")).to_have_text("Worse or missing")
    expect(changes.locator("h3")).to_have_text(["+ New (2)", "✓ Resolved (1)", "Machines"])
    assert page.evaluate("document.querySelector('#changes').offsetTop < document.querySelector('#machines').offsetTop")
