"""Size and time of a report page, 240 s and an hour; run as `python tests/benchmarks/report_page.py [FOLDER]`.

With a folder the pages are written there; with Chromium installed, the time to the first plot is measured.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.report.page import build_page
from tests.report_samples import FAULTS, PLACES, mission

CASES = {"240 s, one fault": (240.0, 1), "240 s, five faults": (240.0, 5), "1 h, five faults": (3600.0, 5)}


def first_plot(path: Path) -> str:
    """Seconds from opening a page to its first plot, in headless Chromium."""
    chromium = shutil.which("chromium")
    if not chromium:
        return "no Chromium"
    from playwright.sync_api import sync_playwright

    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page()
        begin = time.perf_counter()
        page.goto(path.as_uri())
        ready = time.perf_counter() - begin
        page.locator("#figure .main-svg").first.wait_for()
        page.locator("#badge", has_not_text="drawing").wait_for()
        drawn = time.perf_counter() - begin
        begin = time.perf_counter()
        page.get_by_role("button", name="Mission", exact=True).click()
        page.locator("#badge", has_text="envelope").wait_for()
        zoomed = time.perf_counter() - begin
        browser.close()
    return f"page usable {ready:.2f} s, first plot {drawn:.2f} s, zoom to the mission {zoomed:.2f} s"


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
    for name, (duration, faults) in CASES.items():
        wheels, axles = ["FR", "FL", "RR", "RL"], ["front", "rear"]
        report, columns = mission(wheels, axles, FAULTS[:faults], duration=duration, rate=1000.0, geometry=PLACES)
        build_page({}, {})
        begin = time.perf_counter()
        text = build_page(report, columns)
        seconds = time.perf_counter() - begin
        path = folder / f"{name.replace(' ', '-').replace(',', '')}.html"
        path.write_text(text, encoding="utf-8", newline="\n")
        print(
            f"{name}, {len(columns)} columns: {len(text.encode()) / 1e6:.2f} MB in {seconds:.2f} s; {first_plot(path)}"
        )


if __name__ == "__main__":
    main()
