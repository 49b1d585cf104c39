"""Pages of comparisons, scores and counterfactual missions: no breach of any rule of axe-core, nothing scrolls sideways."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from tests.diagnosis.comparison import test_page as comparisons
from tests.diagnosis.evaluation import test_page as scores

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

LOG = [
    "simulate",
    "-q",
    "--duration",
    "50",
    "--rate",
    "100",
    "--scenario",
    "healthy",
    "--fault",
    "FR sensor stuck 20 22",
]
FOUND = """axe.run(document, { resultTypes: ['violations'] }).then(r => r.violations
  .flatMap(v => v.nodes.map(n => v.id + ' ' + n.target.join(' '))))"""


def comparison(folder: Path) -> Path:
    report, fault = comparisons.report, comparisons.fault
    page = folder / "comparison.html"
    page.write_text(comparisons.page(report("FR", "M"), report("FR", "M", fault("FR"))), encoding="utf-8")
    return page


def scored(folder: Path) -> Path:
    page = folder / "scores.html"
    page.write_text(scores.build_scores_page(scores.document(("a", scores.counted()))), encoding="utf-8")
    return page


def counterfactual(folder: Path) -> Path:
    log = folder / "m.mcap"
    assert run([*LOG, "-o", str(log)]) == 0
    assert run(["counterfactual", str(log), "--controller", "p", "--draws", "3", "-o", str(folder / "out")]) == 0
    return folder / "out" / "counterfactual.html"


@pytest.mark.parametrize("made", [comparison, scored, counterfactual])
def test_no_breach_of_any_rule(browser: Any, tmp_path: Path, made: Callable[[Path], Path]) -> None:
    pytest.importorskip("axe_playwright_python", reason="axe-core is not installed: pip install axe-playwright-python")
    axe = (files("axe_playwright_python") / "axe.min.js").read_text("utf-8")
    path = made(tmp_path)
    for width, theme in ((1280, "light"), (820, "dark")):
        page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=theme)
        page.goto(path.as_uri())
        if made is counterfactual:
            page.locator("#figure .main-svg").first.wait_for()
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.evaluate(axe)
        assert page.evaluate(FOUND) == []
        page.context.close()
