"""What an audit's fleet knows beyond a mission, in words for the mission's page."""

from __future__ import annotations

import re

from diagnosis.pages.labels import utc, utc_moment
from diagnosis.report.tables import Context
from diagnosis.results.document import ReportDocument
from diagnosis.results.fleet_note_row import FleetNoteRow
from diagnosis.results.vocabulary import Leave

_PAGE = re.compile(r"(\.\./)*fleet\.html")


def fleet_section(report: ReportDocument) -> Context | None:
    """Everything that the banner shows, None where the fleet says what the mission says.

    Parameters
    ----------
    report : ReportDocument
        The document with names made visible.
    """
    note = report.get("fleet")
    if note is None:
        return None
    leave = Leave(note["leave"])
    return {
        "title": repairs_words(note) or f"By the fleet page: {leave}",
        "repaired": bool(note["repairs"]),
        "leave": leave.value,
        "reason": note["reason"],
        "page": note["page"] if _PAGE.fullmatch(note["page"]) else "",
        "asof": utc(note["asof_ns"])[:10],
    }


def repairs_words(note: FleetNoteRow) -> str:
    """What was repaired since the mission: ``Repaired since this mission: FR speed sensor (F1), 2026-10-05 12:30 UTC``."""
    said = [f"{r['part']} ({', '.join(r['faults'])}), {utc_moment(r['repaired_ns'])}" for r in note["repairs"]]
    return f"Repaired since this mission: {'; '.join(said)}" if said else ""


def repaired_faults(report: ReportDocument) -> dict[str, str]:
    """When each fault's part was repaired after the mission, by the fault's id; those that were not are left out."""
    note = report.get("fleet")
    return {f: utc_moment(r["repaired_ns"]) for r in (note["repairs"] if note else ()) for f in r["faults"]}
