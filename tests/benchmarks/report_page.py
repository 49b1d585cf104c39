"""Size and time of a report page; run as `python tests/benchmarks/report_page.py [FOLDER | PAGE...]`.

Four minutes at 1 kHz with 40 columns (aim: 8 MB, usable in 2 s and 1.5 s of the main thread, next fault in 0.4 s, zoom in
0.3 s), with all columns of five faults, half an hour, an hour (12 MB, 2.5 s), and thousands of faults; or the pages named
(`report_page.py m-report/report.html`). With a folder the pages are written there. With Chromium installed, what a user
waits for is measured (medians of five; processor times stand beside that of a fixed loop), and on Linux the memory of
the page's process (PSS: its own pages and its share of common ones) once drawn and after 50 interactions (aim: heap 250 MB).
"""

from __future__ import annotations

import contextlib
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

RUNS = 5
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-headless-shell")

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
    "240 s, 40 columns": lambda: machine(240.0, 2, 40),
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


def calibration() -> float:
    """Processor time [s] of a fixed loop: what the times of this machine at this moment are to be compared with."""
    begin = time.process_time()
    total = 0
    for i in range(3_000_000):
        total += i * i
    return time.process_time() - begin


def shown_in(page: Any, act: Callable[[], None]) -> float:
    """Seconds from an action until the evidence says otherwise what it draws, or has drawn another fault; at most three."""
    state = "() => location.hash + document.querySelector('#badge').textContent"
    before = page.evaluate(state)
    begin = time.perf_counter()
    act()
    with contextlib.suppress(Exception):  # two views may be told in the same words
        page.wait_for_function(f"before => ({state})() !== before", arg=before, polling=20, timeout=3000)
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => setTimeout(done)))")
    return time.perf_counter() - begin


def opened(playwright: Any, path: Path) -> dict[str, float]:
    """Open a page once: seconds, processor time of its main thread [s] and memory [MB], also after 50 interactions."""
    out, others = {"calibration": calibration()}, set(renderers())
    browser = playwright.chromium.launch(
        executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu", "--js-flags=--expose-gc"]
    )
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def metric(name: str) -> float:
        return next(float(m["value"]) for m in session.send("Performance.getMetrics")["metrics"] if m["name"] == name)

    begin = time.perf_counter()
    page.goto(path.as_uri())
    page.locator("html[data-ready]").wait_for(state="attached")
    out |= {"usable": time.perf_counter() - begin, "usable CPU": metric("TaskDuration")}
    page.locator("#figure .main-svg").first.wait_for()
    page.locator("#badge", has_not_text="drawing").wait_for()
    out |= {"first plots": time.perf_counter() - begin, "first plots CPU": metric("TaskDuration")}
    out["MB drawn"] = memory(others)
    page.wait_for_timeout(500)
    zooms, faults = [], []
    several = page.evaluate("() => Data.view.faults.length > 1")  # else there is no next one, and nothing to wait for
    for i in range(50):
        key = "jk"[i // 5 % 2] if several and i % 5 == 0 else "moef"[i % 5 - 1]
        taken = shown_in(page, lambda key=key: page.keyboard.press(key))
        (faults if key in "jk" else zooms).append(taken)
    out |= {"zoom": statistics.median(zooms)}
    if several:
        out |= {"first next fault": faults[0], "next fault": statistics.median(faults)}
    page.evaluate("gc()")
    out |= {"heap MB after 50": metric("JSHeapUsedSize") / 1e6, "MB after 50": memory(others)}
    page.keyboard.press("s")
    begin = time.perf_counter()
    page.keyboard.press("Enter")
    page.locator("#signals-figure .main-svg").first.wait_for()
    out["a signal added"] = time.perf_counter() - begin
    browser.close()
    return out


def waiting(path: Path) -> str:
    """Medians of five openings, in words."""
    if not CHROMIUM:
        return "no Chromium"
    from playwright.sync_api import sync_playwright

    with sync_playwright() as p:
        runs = [opened(p, path) for _ in range(RUNS)]
    return ", ".join(f"{k} {statistics.median(r[k] for r in runs):.2f}" for k in runs[0])


def main() -> None:
    pages = [Path(word).resolve() for word in sys.argv[1:] if word.endswith(".html")]
    for path in pages:
        print(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB; {waiting(path)}", flush=True)
    if pages:
        return
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
