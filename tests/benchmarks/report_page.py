"""Size and time of a report page; run as `python tests/benchmarks/report_page.py [FOLDER]`.

Four minutes at 1 kHz with 40 columns (aim: 8 MB, written in 1.5 s, usable in 2 s, zoom in 0.4 s), with all columns of
five faults, half an hour, an hour (12 MB, 2.5 s; renderer 250 MB), and thousands of faults. With a folder the pages are
written there; with Chromium installed, what a user waits for is measured, and on Linux the memory of the page's process
(PSS: its own pages and its share of common ones) once drawn and after all figures and some faults were looked at.
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

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.report.page import build_page
from diagnosis.results.evidence_columns import steps_around
from diagnosis.results.result import Closeups
from replay.arrays.envelope import bucket_of, envelope, rows_of, step_of
from tests import report_samples as samples
from tests.browser.evidence_samples import many_faults

Sample = tuple[dict[str, Any], samples.Columns, Closeups | None]


def machine(duration: float, faults: int, columns: int | None = None) -> Sample:
    """Mission at 1 kHz with so many faults, and all or the first so many columns beside the time."""
    wheels, axles = ["FR", "FL", "RR", "RL"], ["front", "rear"]
    report, all_columns = samples.mission(
        wheels, axles, samples.FAULTS[:faults], duration=duration, rate=1000.0, geometry=samples.PLACES
    )
    evidence = [k for k in all_columns if k.startswith("evidence.")]
    order = ["t", *evidence, *(k for k in all_columns if k not in evidence and k != "t")]
    return report, {k: all_columns[k] for k in order[: columns and columns + 1]}, None


def hours(count: float) -> Sample:
    """Mission as a result keeps it: extremes, and every sample around the faults."""
    report, columns, _ = machine(3600.0 * count, 5)
    size = len(columns.pop("t"))
    bucket = bucket_of(size)
    spans = [(round(1000 * f["start_s"]), round(1000 * f["stop_s"])) for f in report["intervals"]]
    step = steps_around(spans, size, 0.001)
    near = {k: v[step].astype(np.float32) for k, v in columns.items()}
    rows = {k: envelope(columns.pop(k), bucket).astype(np.float32) for k in list(columns)}
    return report, {"t": np.arange(rows_of(size, bucket)) * 0.001 * step_of(bucket), **rows}, Closeups(step, near)


CASES: dict[str, Callable[[], Sample]] = {
    "240 s, 40 columns": lambda: machine(240.0, 1, 40),
    "240 s, five faults": lambda: machine(240.0, 5),
    "0.5 h, five faults": lambda: machine(1800.0, 5),
    "1 h, five faults": lambda: hours(1.0),
    "3000 faults, 100 000 states": lambda: (*many_faults(3000, 100_000), None),
}


def renderers() -> dict[int, float]:
    """PSS [MB] of each Chromium process that draws a page; empty where /proc does not tell."""
    out = {}
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if b"--type=renderer" in (place / "cmdline").read_bytes():
                rows = (line.split() for line in (place / "smaps_rollup").read_text().splitlines())
                out[int(place.name)] = next(int(r[1]) for r in rows if r[0] == "Pss:") / 1024
        except OSError:  # it ended meanwhile
            continue
    return out


def memory(others: set[int]) -> float:
    """PSS [MB] of the largest renderer; of those started meanwhile where there are any."""
    found = renderers()
    return max((v for k, v in found.items() if k not in others), default=max(found.values(), default=float("nan")))


def waiting(path: Path) -> str:
    """Seconds from opening a page to its controls and first plots, and of zooming and adding a signal."""
    chromium = shutil.which("chromium")
    if not chromium:
        return "no Chromium"
    from playwright.sync_api import sync_playwright

    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        others = set(renderers())
        begin = time.perf_counter()
        page.goto(path.as_uri())
        page.locator("html[data-ready]").wait_for(state="attached")
        ready = time.perf_counter() - begin
        page.locator("#figure .main-svg").first.wait_for()
        page.locator("#badge", has_not_text="drawing").wait_for()
        drawn = time.perf_counter() - begin
        first = memory(others)
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
        page.locator("#loop").scroll_into_view_if_needed()
        for button in page.locator("[data-loop]").all():
            button.click()
            page.wait_for_timeout(500)
        for _ in range(4):
            page.keyboard.press("j")
            page.wait_for_timeout(500)
        last = memory(others)
        browser.close()
    zoomed = f"zoom {statistics.median(zooms):.2f} s (worst {max(zooms):.2f} s)"
    held = f"renderer {first:.0f} MB drawn, {last:.0f} MB after use"
    return f"usable {ready:.2f} s, first plots {drawn:.2f} s, {zoomed}, a signal added {added:.2f} s, {held}"


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
    for name, sample in CASES.items():
        report, columns, closeups = sample()
        build_page(*machine(1.0, 1)[:2])
        begin = time.perf_counter()
        text = build_page(report, columns, closeups=closeups)
        path = folder / f"{name.replace(' ', '-').replace(',', '')}.html"
        path.write_text(text, encoding="utf-8", newline="\n")
        seconds = time.perf_counter() - begin
        size = f"{len(text.encode()) / 1e6:.2f} MB written in {seconds:.2f} s"
        print(f"{name}, {len(columns) - 1} columns: {size}; {waiting(path)}", flush=True)


if __name__ == "__main__":
    main()
