"""What became of a machine's faults since another of its missions, as a report keeps it.

The key ``previous`` of ``report.json`` holds the comparison without the older document, so that the page can be made
again from the newer result alone. ``older`` and ``newer`` go by the logs' clocks, not by the order of the arguments.
"""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.comparison.compare import Comparison, compare_reports, comparison_json, machine_difference
from diagnosis.comparison.losses import losses_of_both
from diagnosis.results.comparison_document import ComparedMissionRow, LossChangeRow, OtherMissionRow, PreviousRow
from diagnosis.results.document import MachineIdentity, ReportDocument
from replay.errors import ConfigError

THIS, OTHER = "this mission", "the other mission"


def with_previous(
    report: ReportDocument,
    previous: ReportDocument,
    name: str = "",
    open_faults: Sequence[str] = (),
    asof_ns: int | None = None,
) -> ReportDocument:
    """Give a report with the comparison with another mission of the same machine under the key ``previous``.

    Parameters
    ----------
    report : ReportDocument
        Document of the mission, as in ``report.json``.
    previous : ReportDocument
        Document of the other mission.
    name : str
        What to call the other result in an error.
    open_faults : Sequence[str]
        Sentences on severe faults of earlier missions that nobody is known to have repaired.
    asof_ns : int or None
        When that was known [ns since 1970].

    Returns
    -------
    ReportDocument
        `report` with ``previous``: ``order`` (``earlier``, or ``later`` where the other mission was recorded after
        this one), ``mission`` (the other one), ``worse``, ``counts``, ``faults``, ``coverage`` (what changed),
        ``loss`` (ε̂ of each part in both), ``notes``.

    Raises
    ------
    ConfigError
        Where the other result is of another machine.
    LogError
        Where a document lacks what every report holds.
    """
    require_same_machine(report["machine"], previous, name or "the previous result")
    later = _start(previous) > _start(report) > 0
    pair = (report, previous) if later else (previous, report)
    names = (THIS, OTHER) if later else (OTHER, THIS)
    found = compare_reports(*pair, names, force=True)
    compact = _compact(found, pair, later)
    if open_faults:
        compact["open_faults"] = list(open_faults)
        if asof_ns is not None:
            compact["open_asof_ns"] = asof_ns
    return {**report, "previous": compact}


def require_same_machine(machine: MachineIdentity, previous: ReportDocument, name: str) -> None:
    """Refuse a result of another machine.

    Parameters
    ----------
    machine : MachineIdentity
        ``id`` and ``wheels`` of this mission's machine.
    previous : ReportDocument
        Document of the other mission.
    name : str
        What to call it.

    Raises
    ------
    ConfigError
        Where ids or wheels differ.
    """
    difference = machine_difference(machine, previous["machine"], (THIS, name))
    if difference:
        raise ConfigError(f"--previous {difference}; give a result of the same machine")


def _start(report: ReportDocument) -> int:
    return report["log"]["start_ns"]


def _compact(found: Comparison, pair: tuple[ReportDocument, ReportDocument], later: bool) -> PreviousRow:
    document = comparison_json(found)
    return {
        "order": "later" if later else "earlier",
        "mission": _without_name(document["newer"] if later else document["older"]),
        "worse": document["worse"],
        "counts": {name: n for name, n in document["counts"].items() if n},
        "faults": document["faults"],
        "coverage": [c for c in document["coverage"] if c["change"]],
        "loss": _losses(*pair),
        "notes": document["notes"],
    }


def _without_name(mission: ComparedMissionRow) -> OtherMissionRow:
    return {
        "files": mission["files"],
        "start_ns": mission["start_ns"],
        "duration_s": mission["duration_s"],
        "driving_s": mission["driving_s"],
        "verdict": mission["verdict"],
        "title": mission["title"],
        "machine": mission["machine"],
        "machine_id": mission["machine_id"],
        "open_loop": mission["open_loop"],
        "version": mission["version"],
    }


def _losses(older: ReportDocument, newer: ReportDocument) -> list[LossChangeRow]:
    return [
        {"component": component, "side": side, "older": before, "newer": now}
        for (component, side), (before, now) in losses_of_both(older, newer).items()
    ]
