"""Unit in which the page shows a column, and the factor to it: of its plot, as recorded, or by the column's name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from diagnosis.report.compared_channels import DEGREES, VALVE_UNIT
from diagnosis.report.judged_parts import kind_of
from diagnosis.report.rows import Group, Row
from diagnosis.results.document import MachineRow, ReportDocument
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

_LEAVES = {
    "v": "m/s", "v_ref": "m/s", "v_true": "m/s", "e": "m/s", "phi": "rad", "phi_ref": "rad", "phi_true": "rad",
    "u": VALVE_UNIT, "u_applied": VALVE_UNIT, "u_difference": VALVE_UNIT, "psi": "1", "psi_printed": "1",
    "psi_implied": "1", "rho": "1/s", "omega": "rad/s", "yaw_rate": "rad/s", "speed": "m/s", "x": "m", "y": "m",
    "lat": "°", "lon": "°",
}  # fmt: skip
_NATURAL = ("residual", "threshold", "expected", "delta_bar", "delta_bar_std")


def units_of(
    columns: Sequence[str],
    report: ReportDocument,
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
) -> list[tuple[str, float]]:
    """Unit shown and factor to it, for each column."""
    known: dict[str, tuple[str, float]] = {}
    for row in (r for rows in [*figures.values(), *(g.rows for g in groups)] for r in rows):
        for t in row.traces:
            known.setdefault(t.column, (row.right[1] if t.right and row.right else row.unit, t.scale))
        for c in (*(row.band or ()), *((row.threshold,) if row.threshold else ())):
            known.setdefault(c, (row.unit, row.band_scale))
    recorded = {s["name"]: s["unit"] for s in report["signals"]}
    return [known.get(c) or _shown(recorded.get(c) or _unit(c, report["machine"])) for c in columns]


def _unit(column: str, machine: MachineRow) -> str:
    head, _, rest = column.partition(".")
    component, _, leaf = rest.rpartition(".")
    if head != "evidence":
        return _LEAVES.get(leaf, "1")
    part, _, side = component.rpartition(".")
    if leaf not in _NATURAL:
        return "1"
    return VALVE_UNIT if side == Side.ACTUATOR else "rad" if kind_of(part, machine) == Kind.STEER else "m/s"


def _shown(unit: str) -> tuple[str, float]:
    return ("°", DEGREES) if unit == "rad" else ("°/s", DEGREES) if unit == "rad/s" else (unit, 1.0)
