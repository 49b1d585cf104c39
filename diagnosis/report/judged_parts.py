"""Parts of the machine: which kind they are, and which of them were judged at all."""

from __future__ import annotations

from diagnosis.results.document import MachineRow, ReportDocument
from diagnosis.results.vocabulary import Kind
from replay.faults import DECIDED


def kind_of(component: str, machine: MachineRow) -> Kind:
    """Whether a component is a wheel or a steering axle."""
    return Kind.STEER if component in machine["axles"] and component not in machine["wheels"] else Kind.WHEEL


def judged_sides(report: ReportDocument) -> dict[tuple[str, str], bool]:
    """Whether any time of each component and side was decided."""
    return {
        (row["component"], row["side"]): any(row["seconds"].get(s, 0.0) > 0 for s in DECIDED)
        for row in report["coverage"]
    }
