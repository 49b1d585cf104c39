"""Numbers and times of the page's scripts are those of the page itself: one format for each."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import diagnosis.report
from diagnosis.pages.labels import clock, span

_ASSETS = Path(diagnosis.report.__file__).parent / "assets"
#: Where digits are no text of the page: the address, and a file that is saved.
_MACHINE = {"address.js": 1, "data.js": 2}
_TIMES = (
    0.5,
    1.5,
    33.005,
    33.015,
    -75.25,
    -0.0004,
    0.0,
    0.0004,
    33.8412,
    59.9996,
    80.005,
    119.95,
    3599.9999,
    3600.0,
    7322.5,
    86_400.0,
)
_LENGTHS = (0.0025, 20.25, 20.35, 20.75, 0.0, 0.14, 0.9999, 1.0, 20.04, 119.94, 120.0, 7199.0, 7200.0, 36_000.0)


def test_scripts_write_times_and_lengths_as_the_page_does(open_page: Callable[..., Any]) -> None:
    page = open_page("decided")
    for digits in (0, 2, 3, 4):
        told = page.evaluate("([times, digits]) => times.map((t) => Now.clock(t, digits))", [_TIMES, digits])
        assert told == [clock(t, digits) for t in _TIMES]
    assert page.evaluate("(lengths) => lengths.map(Now.span)", _LENGTHS) == [span(s) for s in _LENGTHS]
    assert page.evaluate("[-0.25, -1e-9, 12].map((v) => Now.number(v))") == ["−0.25", "−1e−9", "12"]


def test_no_script_has_a_format_of_its_own() -> None:
    for script in sorted(_ASSETS.glob("*.js")):
        text = script.read_text(encoding="utf-8")
        if script.name == "data.js":
            text = re.sub(r"\n  number: .*?\n};\n", "\n};\n", text, flags=re.DOTALL)  # the one place
        found = len(re.findall(r"\.to(?:Fixed|Precision)\(", text))
        assert found == _MACHINE.get(script.name, 0), script.name


def test_a_heading_gives_a_late_time_as_sentences_and_axes_count_it_too(open_page: Callable[..., Any]) -> None:
    page = open_page("decided")
    heads = {f: page.locator(f"[data-ev={f}] p.muted").first.text_content() or "" for f in ("F1", "F2")}
    assert heads["F1"].startswith("0:30.000 to 0:36.000 · 6.0\u00a0s · ")
    assert heads["F2"].startswith("1:00.000 to 1:24.000 (60.000 to 84.000\u00a0s) · 24.0\u00a0s · ")
