"""What the fleet knows of a machine that its newest report cannot: open faults of earlier missions, repairs since, where it stands now."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from diagnosis.audit.fleet.document import fleet_document
from diagnosis.audit.fleet.leave import lists_of
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.words import fault_words, open_words
from diagnosis.audit.fleet_files import load_fleet
from diagnosis.audit.store.repairs import Repair, read_repairs, repaired_at
from diagnosis.audit.store.store import FILE_NAME, Store
from diagnosis.pages.labels import utc
from diagnosis.report.confidence import own_leave
from diagnosis.results.document import ReportDocument
from diagnosis.results.fleet_note_row import FleetNoteRow, RepairNoteRow
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Leave, Severity


@dataclass(frozen=True)
class Known:
    """What the fleet knows of one machine.

    Attributes
    ----------
    leave, reason : Leave, str
        Its list on the fleet page, and why it is there.
    grows : bool
        Whether a loss of its grows towards a half.
    open_faults : tuple[str, ...]
        Sentences on faults that are held open and that its last mission did not show.
    repairs : tuple[Repair, ...]
        That were recorded of it.
    """

    leave: Leave
    reason: str
    grows: bool
    open_faults: tuple[str, ...]
    repairs: tuple[Repair, ...]


def known_machines(store: Store) -> dict[str, Known]:
    """What the fleet knows, by the identity of the machine; those without one are left out.

    Raises
    ------
    OutputError
        Where the store cannot be read.
    """
    fleet = load_fleet(Path(store.folder) / FILE_NAME)
    document = fleet_document(fleet)
    repairs: dict[tuple[str, str], list[Repair]] = defaultdict(list)
    for r in read_repairs(store.database):
        repairs[r.machine].append(r)
    fast = {t["machine"] for t in document["trends"] if t.get("halving")}
    return {
        m.id: Known(left.leave, left.reason, k in fast, _open_faults(m), tuple(repairs[m.id, ""]))
        for k, (m, left) in enumerate(zip(fleet.machines, lists_of(document), strict=True))
        if m.id
    }


def _open_faults(m: Machine) -> tuple[str, ...]:
    return tuple(
        f"{fault_words(f, m.limits.words)}, last found in {f.last.name} ({utc(f.last.result.start_ns)[:10]}), no repair recorded"
        + open_words(f.open, f.clean, f.needed)
        for f in m.faults
        if f.open and f.since
    )


def fleet_note(
    known: Known, report: ReportDocument, folder: Path, output: Path, asof_ns: int, *, beside: Sequence[str] = ()
) -> FleetNoteRow | None:
    """What the newest report of a machine is to say of the fleet; None where the fleet says what the mission says.

    Parameters
    ----------
    known : Known
        What the fleet knows of the machine.
    report : ReportDocument
        Of the mission.
    folder, output : Path
        Of the report, and of the audit.
    asof_ns : int
        Now [ns since 1970].
    beside : Sequence[str]
        Open faults that the report tells beside it.
    """
    repairs = _repaired(report, known.repairs)
    differs = known.leave is not own_leave(report) and not beside
    if not (differs or known.grows or repairs):
        return None
    page = Path(os.path.relpath(output / "fleet.html", folder)).as_posix()
    return {"leave": known.leave, "reason": known.reason, "repairs": repairs, "page": page, "asof_ns": asof_ns}


def _repaired(report: ReportDocument, repairs: Sequence[Repair]) -> list[RepairNoteRow]:
    """Repairs of parts that a mission found faulty, made after it began."""
    words, found = words_of(report["machine"]), dict[tuple[str, int], list[str]]()
    for f in report["intervals"]:
        at = repaired_at(repairs, f["component"], f["side"])
        if f["severity"] != Severity.INFO and at is not None and report["log"]["start_ns"] < at:
            found.setdefault((words.part_words(f["kind"], f["component"], f["side"]), at), []).append(f["id"])
    return [{"faults": ids, "part": part, "repaired_ns": at} for (part, at), ids in found.items()]
