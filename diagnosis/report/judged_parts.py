"""Parts of the machine: which kind they are, and which of them were judged at all."""

from __future__ import annotations

from diagnosis.results.document import MachineRow, ReportDocument
from diagnosis.results.vocabulary import Kind
from replay.faults import DECIDED, Side


def kind_of(component: str, machine: MachineRow) -> Kind:
    """Whether a component is a wheel or a steering axle."""
    return Kind.STEER if component in machine["axles"] and component not in machine["wheels"] else Kind.WHEEL


def unpowered(machine: MachineRow) -> tuple[str, ...]:
    """Wheels without a drive, which only roll along."""
    return tuple(machine.get("unpowered", ()))


def sides_of_parts(machine: MachineRow) -> list[tuple[str, Kind, Side]]:
    """Every component with each side that it has, in the machine's order, sensor before actuator."""
    parts = [(c, Kind.WHEEL) for c in machine["wheels"]] + [(c, Kind.STEER) for c in machine["axles"]]
    free = unpowered(machine)
    return [
        (c, kind, side)
        for c, kind in parts
        for side in (Side.SENSOR, Side.ACTUATOR)
        if side is Side.SENSOR or kind is Kind.STEER or c not in free
    ]


def judged_sides(report: ReportDocument) -> dict[tuple[str, str], bool]:
    """Whether any time of each component and side was decided."""
    return {
        (row["component"], row["side"]): any(row["seconds"].get(s, 0.0) > 0 for s in DECIDED)
        for row in report["coverage"]
    }
