"""Whole report documents from the few keys that a test is about."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from diagnosis.results.document import SCHEMA, ReportDocument
from diagnosis.results.validation import report_of
from replay.machine.config import Limits

_UNKNOWN = {"mission": None, "driving": None}
_FIGURES = {"tracking_error": _UNKNOWN, "control_effort": _UNKNOWN}
_FILE = {"path": "a.mcap", "sha256": "", "bytes": 1, "format": "mcap", "damage": [], "notes": []}
_FAULT = {"kind": "wheel", "start_ns": 0, "stop_ns": 0, "epsilon": None, "sat": None, "probability": 0.99}
_FAULT |= {"hypotheses": [], "advice": "", "evidence": [], "tier": "none"}


def whole_report(document: dict[str, Any]) -> ReportDocument:
    """The report with what is given, and nothing known where nothing is given."""
    lists = (
        "readings",
        "intervals",
        "states",
        "phases",
        "coverage",
        "loss",
        "clearing",
        "signals",
        "missing",
        "quality",
    )
    log = {"files": [], "start_ns": 0, "rate_hz": 100.0, "distance_m": None, "driving_s": 0.0} | document["log"]
    log["files"] = [_FILE | file for file in log["files"]]
    whole: dict[str, Any] = {
        **{name: [] for name in lists},
        **document,
        "schema": SCHEMA,
        "tool": {"name": "mfhca-replay", "version": ""} | document.get("tool", {}),
        "log": log,
        "machine": {"name": "", "id": "", "axles": [], "geometry": None, "source": ""} | document["machine"],
        "verdict": {"title": "", "text": "", "caveats": [], "actions": []} | document["verdict"],
        "metrics": {"wheels": {}, "average": _FIGURES, "paper": []} | document.get("metrics", {}),
        "limits": asdict(Limits()) | document.get("limits", {}),
    }
    whole["intervals"] = [_FAULT | row for row in whole["intervals"]]
    return report_of(whole, "sample")
