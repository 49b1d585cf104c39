"""`fleet.csv`: one row per mission, in a form that no spreadsheet takes for a formula."""

from __future__ import annotations

import csv
import io
import re

from diagnosis.audit.fleet.fleet_types import FleetDocument, MissionRow
from diagnosis.pages.labels import utc, visible
from diagnosis.results.candidates import UNCLEAR

COLUMNS = (
    "machine", "mission", "state", "reason", "verdict", "title", "start_utc", "start_ns", "duration_s", "driving_s",
    "distance_m", "faults", "worst_component", "worst_side", "worst_mode", "worst_severity", "worst_epsilon",
    "worst_epsilon_low", "worst_epsilon_high", "injected", "copy_of", "report", "files",
)  # fmt: skip


#: Whether texts, each after a zero, are all cells as they are: no quotes around them, nothing to escape.
_PLAIN = re.compile(r"(?:\0(?:[0-9A-Za-z][ !#-+\--~]*)?)*").fullmatch
#: A cell before it is written.
Value = str | float | None


def fleet_csv(document: FleetDocument) -> str:
    """Missions of a fleet's document as comma-separated values with a line of headings."""
    labels = [m["label"] for m in document["machines"]]
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(COLUMNS)
    for m in document["missions"]:
        cells = _row(m, labels)
        if _PLAIN("".join([f"\0{v}" for v in cells if v.__class__ is str])):
            out.write(",".join(["" if v is None else str(v) for v in cells]) + "\n")
        else:
            rows.writerow([_cell(v) for v in cells])
    return out.getvalue()


def _row(m: MissionRow, labels: list[str]) -> list[Value]:
    worst = m["faults"][0] if m["faults"] else None
    unclear = worst is not None and worst.get("unclear", False)
    epsilon = None if worst is None or unclear else worst["epsilon"]
    start = m.get("start_ns")
    return [
        "" if m["machine"] is None else labels[m["machine"]],
        m["name"],
        m["state"],
        m["reason"],
        m["verdict"],
        m.get("title"),
        "" if start is None else utc(start),
        start,
        m.get("duration_s"),
        m.get("driving_s"),
        m.get("distance_m"),
        len(m["faults"]) if m["verdict"] is not None else None,
        *(
            ("", "", "", "")
            if worst is None
            else (worst["component"], worst["side"], UNCLEAR if unclear else worst["mode"], worst["severity"])
        ),
        *(("", "", "") if epsilon is None else (epsilon["value"], epsilon["low"], epsilon["high"])),
        "" if "open_loop" not in m else "yes" if m["open_loop"] else "no",
        m.get("copy_of"),
        m.get("report"),
        " ".join(m["files"]),
    ]


def _cell(value: Value) -> Value:
    """Text made visible, and quoted by an apostrophe where a spreadsheet would run it; numbers as they are."""
    if not isinstance(value, str):
        return value
    text = visible(value)
    return "'" + text if text.lstrip()[:1] in {"=", "+", "-", "@"} else text
