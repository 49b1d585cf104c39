"""Size and time of a report page; run as `python tests/benchmarks/report_page.py [FOLDER]`.

Four minutes at 1 kHz with 40 columns (aim: 8 MB, written in 1.5 s, usable in 2 s, zoom in 0.4 s), with all columns of
five faults, an hour, and thousands of faults. With a folder the pages are written there; with Chromium installed, what a
user waits for is measured.
"""

from __future__ import annotations

import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.report.page import build_page
from tests import report_samples as samples
from tests.browser.evidence_samples import many_faults

Sample = tuple[dict[str, Any], samples.Columns]


def machine(duration: float, faults: int, columns: int | None = None) -> Sample:
    """Mission at 1 kHz with so many faults, and all or the first so many columns beside the time."""
    wheels, axles = ["FR", "FL", "RR", "RL"], ["front", "rear"]
    report, all_columns = samples.mission(
        wheels, axles, samples.FAULTS[:faults], duration=duration, rate=1000.0, geometry=samples.PLACES
    )
    evidence = [k for k in all_columns if k.startswith("evidence.")]
    order = ["t", *evidence, *(k for k in all_columns if k not in evidence and k != "t")]
    return report, {k: all_columns[k] for k in order[: columns and columns + 1]}


CASES: dict[str, Callable[[], Sample]] = {
    "240 s, 40 columns": lambda: machine(240.0, 1, 40),
    "240 s, five faults": lambda: machine(240.0, 5),
    "1 h, five faults": lambda: machine(3600.0, 5),
    "3000 faults, 100 000 states": lambda: many_faults(3000, 100_000),
}


def waiting(path: Path) -> str:
    """Seconds from opening a page to its controls and first plots, and of zooming and adding a signal."""
    chromium = shutil.which("chromium")
    if not chromium:
        return "no Chromium"
    from playwright.sync_api import sync_playwright

    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        begin = time.perf_counter()
        page.goto(path.as_uri())
        page.locator("html[data-ready]").wait_for(state="attached")
        ready = time.perf_counter() - begin
        page.locator("#figure .main-svg").first.wait_for()
        page.locator("#badge", has_not_text="drawing").wait_for()
        drawn = time.perf_counter() - begin
        zooms = []
        for name in ("Mission", "Fault", "Mission", "Onset", "Mission"):
            before = page.locator("#badge").inner_text()
            begin = time.perf_counter()
            page.get_by_role("button", name=name, exact=True).click()
            page.locator("#badge").filter(has_not_text=before).wait_for()
            zooms.append(time.perf_counter() - begin)
        page.keyboard.press("s")
        begin = time.perf_counter()
        page.keyboard.press("Enter")
        page.locator("#signals-figure .main-svg").first.wait_for()
        added = time.perf_counter() - begin
        browser.close()
    zoomed = f"zoom {statistics.median(zooms):.2f} s (worst {max(zooms):.2f} s)"
    return f"usable {ready:.2f} s, first plots {drawn:.2f} s, {zoomed}, a signal added {added:.2f} s"


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
    for name, sample in CASES.items():
        report, columns = sample()
        build_page(*machine(1.0, 1))
        begin = time.perf_counter()
        text = build_page(report, columns)
        path = folder / f"{name.replace(' ', '-').replace(',', '')}.html"
        path.write_text(text, encoding="utf-8", newline="\n")
        seconds = time.perf_counter() - begin
        size = f"{len(text.encode()) / 1e6:.2f} MB written in {seconds:.2f} s"
        print(f"{name}, {len(columns) - 1} columns: {size}; {waiting(path)}", flush=True)


if __name__ == "__main__":
    main()
