"""Time and size of the fleet page: `python tests/benchmarks/fleet_page.py [MISSIONS [MACHINES]]`.

A made-up store of 5000 missions of 100 machines (aim: written in 5 s, page of 5 MB at most), with and without a
baseline; with Chromium installed, also until the page can be used, of a search, and of sorting the machines.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.audit.fleet.document import fleet_document
from diagnosis.audit.fleet.page.page import build_fleet_page
from diagnosis.audit.fleet_files import load_fleet, write_fleet
from tests import fleet_samples as samples


def waiting(path: Path) -> str:
    """Seconds until the page can be used, of a search and of sorting."""
    chromium = shutil.which("chromium") or shutil.which("chromium-headless-shell")
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
        begin = time.perf_counter()
        page.locator("#find").fill("speed sensor no signal")
        page.locator("#hits", has_text="of").wait_for()
        found = time.perf_counter() - begin
        begin = time.perf_counter()
        page.locator("[data-sort=bad] button").click()
        page.locator("[data-sort=bad][aria-sort]").wait_for()
        ordered = time.perf_counter() - begin
        browser.close()
    return f"usable {ready:.2f} s, search {found:.2f} s, sorting {ordered:.2f} s"


def main() -> None:
    """Write a store, build, measure, print."""
    missions, machines = (int(a) for a in (*sys.argv[1:3], *("5000", "100")[len(sys.argv[1:3]) :]))
    out = Path(tempfile.mkdtemp())
    store = samples.write_store(out / "fleet.sqlite", samples.large(machines, missions // machines))
    earlier = samples.write_store(out / "before" / "fleet.sqlite", samples.large(machines, missions // machines - 5))
    files = write_fleet(store, out)
    begin = time.perf_counter()
    fleet = load_fleet(store)
    read = time.perf_counter()
    document = fleet_document(fleet)
    told = time.perf_counter()
    build_fleet_page(document)
    built = time.perf_counter()
    files = write_fleet(store, out)
    alone = time.perf_counter()
    write_fleet(store, out, baseline=earlier)
    both = time.perf_counter()
    sizes = ", ".join(f"{p.name} {p.stat().st_size / 1e6:.2f} MB" for p in (files.html, files.json, files.csv))
    print(
        f"{missions} missions of {machines} machines: read with trends {read - begin:.2f} s, document {told - read:.2f} s, page {built - told:.2f} s"
    )
    print(f"whole {alone - built:.2f} s, with a baseline {both - alone:.2f} s; {sizes}")
    print(waiting(files.html))
    shutil.rmtree(out)


if __name__ == "__main__":
    main()
