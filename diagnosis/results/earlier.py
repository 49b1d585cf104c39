"""Keys that `report.json` has gained within its schema, filled in for documents of earlier versions.

Nothing else knows of earlier versions: who reads a `ReportDocument` finds every key in it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from diagnosis.results.assessed import is_judged
from diagnosis.results.document import ReportDocument
from diagnosis.results.vocabulary import Tier, Verdict
from replay.machine.config import Limits

#: JSON whose shape is not known yet.
Json = Any
Row = dict[str, Json]


def completed(document: Row) -> Row:
    """A document with the keys that later versions added; values of a wrong type stay, for `validated` to refuse.

    Whether the machine may go out is added by `with_leave`, which needs sound figures.
    """
    out: Row = _with(document, loss=[], clearing=[], detectability={"rows": [], "traces": []})
    complete: dict[str, Callable[[Json], Json]] = {
        "log": _log,
        "machine": lambda row: _with(row, assumed=[]),
        "verdict": lambda row: _with(row, cleared=False, not_cleared="", scope=[]),
        "loss": lambda rows: _rows(rows, lambda row: _with(row, relative=False)),
        "coverage": lambda rows: _rows(rows, _coverage),
        "limits": lambda row: _with(row, clear_at=Limits().clear_at),
        "intervals": lambda rows: _rows(rows, lambda row: _with(row, detected_s=None)),
    }
    return {key: complete[key](value) if key in complete else value for key, value in out.items()}


def says_leave(document: Row) -> bool:
    """Whether a document says by itself that the machine may go out or not."""
    verdict = document.get("verdict")
    return isinstance(verdict, Mapping) and "cleared" in verdict


def with_leave(report: ReportDocument) -> ReportDocument:
    """Say whether the machine may go out, by damage and by how long the parts of the wheels were judged."""
    verdict = report["verdict"]
    doubt = _doubt(report) if verdict["status"] is Verdict.WATCH else ""
    cleared = verdict["status"] is Verdict.READY or (verdict["status"] is Verdict.WATCH and not doubt)
    return {**report, "verdict": {**verdict, "cleared": cleared, "not_cleared": doubt}}


def _doubt(report: ReportDocument) -> str:
    """Why faults to watch keep the machine in."""
    if any(f["damage"] for f in report["log"]["files"]):
        return "the log is damaged"
    wheels = [row for row in report["coverage"] if row["component"] not in report["machine"]["axles"]]
    least = report["limits"]["min_assessed"]
    short = sum(
        row["tier"] is Tier.NONE or not is_judged(row["decided_driving_s"], row["driving_s"], least) for row in wheels
    )
    if short:
        return f"{short} part{'s were' if short > 1 else ' was'} not judged long enough"
    return "" if wheels else "how long its parts were judged is not known"


def _with(row: Json, **later: Json) -> Json:
    return {**row, **{k: v for k, v in later.items() if k not in row}} if isinstance(row, dict) else row


def _rows(rows: Json, complete: Callable[[Json], Json]) -> Json:
    return [complete(row) for row in rows] if isinstance(rows, list) else rows


def _log(log: Json) -> Json:
    out = _with(log, open_loop=False)
    if isinstance(out, dict) and "files" in out:
        out["files"] = _rows(out["files"], lambda row: _with(row, clock=None))
    return out


def _coverage(row: Json) -> Json:
    decided = row.get("decided_driving_s") if isinstance(row, dict) else None
    return row if decided is None else _with(row, driving_s=decided, tier=Tier.MODEL if decided else Tier.NONE)
