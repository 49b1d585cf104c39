"""Take `docs/pictures/report.png` anew: the first screen of the report of the first sample, by headless Chromium.

`python .ci/picture.py` after a change of the page that shows on it.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from cli.main import run  # noqa: E402 - from this repository

SAMPLES, PICTURE = ROOT / "sample_logs", ROOT / "docs" / "pictures" / "report.png"
_SIZE, _COLOURS = {"width": 1200, "height": 860}, 128

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name, sync_playwright() as p:
        folder = Path(name)
        log, machine = SAMPLES / "three_faults.mcap", SAMPLES / "haulotte.toml"
        run(["diagnose", str(log), "-m", str(machine), "-o", str(folder / "report"), "--fail-on", "never", "-q"])
        chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-headless-shell")
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport=_SIZE)
        page.goto((folder / "report" / "report.html").as_uri())
        page.wait_for_timeout(2000)  # until all plots of the first screen are drawn
        page.screenshot(path=folder / "page.png")
        browser.close()
        with Image.open(folder / "page.png") as shot:
            shot.convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE).save(PICTURE, optimize=True)
