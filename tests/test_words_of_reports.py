"""A whole report speaks of the machine as it is: an arm's never of wheels, valves or m/s."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import orjson

from diagnosis.pipeline import diagnose_signals
from diagnosis.report.page import build_page
from diagnosis.results.document import ReportDocument
from replay.log.source_options import SignalSource
from replay.machine.config import Control, Limits, Machine
from replay.signals.signal import Signal, Signals

_STEP_NS, _COUNT = 10_000_000, 4000
_FOREIGN = re.compile(r"valve|spool|\bwheels?\b(?!\.)|\bm/s\b|hydraul|\bice\b|tyre", re.IGNORECASE)
#: Keys whose words are fixed parts of the document, not sentences.
_FIXED = {
    "kind",
    "name",
    "component",
    "wheels",
    "readings",
    "paper",
    "words",
    "metrics",
    "channel",
    "signals",
    "missing",
}


def signal(name: str, values: np.ndarray[Any, np.dtype[np.float64]]) -> Signal:
    stamps = np.arange(values.size, dtype=np.int64) * _STEP_NS
    return Signal(name, stamps, values, SignalSource(column=name), "arm", guessed=False)


def arm_report() -> ReportDocument:
    """Two joints; the second one stops for good after a quarter of its motion."""
    machine = Machine(
        "arm", "", ("m1", "m2"), None, max_speed=1.5, control=Control(law="none"),
        limits=Limits(driving_speed=0.02), part="joint", speed_unit="rad/s",
    )  # fmt: skip
    t = np.arange(_COUNT) * _STEP_NS * 1e-9
    rng = np.random.default_rng(1)
    items = {}
    for k, joint in enumerate(machine.wheels):
        asked = np.sin(0.7 * t + k)
        moved = asked.copy()
        if joint == "m2":
            moved[_COUNT // 4 :] = 0.0
        items[f"wheel.{joint}.v_ref"] = signal(f"wheel.{joint}.v_ref", asked)
        items[f"wheel.{joint}.v"] = signal(f"wheel.{joint}.v", moved + 0.003 * rng.standard_normal(_COUNT))
    return diagnose_signals(Signals(items, {}), machine).report


def sentences(value: Any) -> list[str]:
    """Every text of a document but those of fixed keys."""
    if isinstance(value, str):
        return [value]
    if isinstance(value, dict):
        return [s for k, v in value.items() if k not in _FIXED for s in sentences(v)]
    return [s for v in value for s in sentences(v)] if isinstance(value, list) else []


def test_the_report_of_an_arm_never_speaks_of_wheels_valves_or_metres() -> None:
    report = arm_report()
    said = [s for s in sentences(orjson.loads(orjson.dumps(report))) if not s.startswith("wheel.")]
    assert report["intervals"], said
    assert [s for s in said if _FOREIGN.search(re.sub(r"wheel\.m\d\.\w+", "", s))] == []
    assert not [s for s in said if re.search(r"\{[a-z_.]+\}", s)]
    assert report["machine"]["words"] == {"drive": "drive", "part": "joint", "speed_unit": "rad/s"}
    assert all(f["sat"] is None or f["sat"]["unit"] == "rad/s" for f in report["intervals"])
    assert any("m2 joint" in a["text"] for a in report["verdict"]["actions"])
    assert {s["unit"] for s in report["signals"]} == {"rad/s"}
    assert {p["name"] for p in report["phases"]} <= {"moving", "standstill"}


def test_the_page_of_an_arm_says_the_same() -> None:
    page = build_page(arm_report(), {})
    text = re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL)
    text = re.sub(r"wheel\.[\w.]+", "", re.sub(r"<[^>]+>", " ", text))
    assert list(_FOREIGN.finditer(text)) == []
    assert "joint sensor" in text
    assert "rad/s" in text
