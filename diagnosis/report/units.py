"""Unit in which the page shows a column, and the factor to it: of its plot, as recorded, or by the column's name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from diagnosis.report.judged_parts import kind_of
from diagnosis.report.rows import Group, Row
from diagnosis.results.document import ReportDocument
from diagnosis.results.vocabulary import Kind, Tier
from replay.control.loop_columns import replayed_unit
from replay.faults import Side
from replay.machine.quantities import OPENING
from replay.machine.signal_table import BY_KIND, find_signal

DEGREES = 180.0 / math.pi
#: Leaf of the signal that tells what a component does.
MOTION = {Kind.WHEEL: "v", Kind.STEER: "phi"}
_COMPARED = ("residual", "threshold", "expected")
_OF_THE_SIGNAL = ("delta_bar", "delta_bar_std")
_UNKNOWN = "unknown unit"
_SIDES = {side.value for side in Side}


def motion_unit(kind: Kind) -> str:
    """Unit of what a component does, as recorded."""
    return BY_KIND[f"{kind}.{MOTION[kind]}"].shown_unit


def natural_unit(kind: Kind, side: Side) -> str:
    """Unit of the signal of a component's side: its motion, or the opening of its valve."""
    return OPENING if side == Side.ACTUATOR else motion_unit(kind)


def on_page(unit: str) -> tuple[str, float]:
    """Unit in which the page shows a recorded one, and the factor to it: angles in degrees."""
    return ("°", DEGREES) if unit == "rad" else ("°/s", DEGREES) if unit == "rad/s" else (unit, 1.0)


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
    return [known.get(c) or on_page(recorded.get(c) or _unit(c, report)) for c in columns]


def _unit(column: str, report: ReportDocument) -> str:
    head, _, rest = column.partition(".")
    component, _, leaf = rest.rpartition(".")
    if head == "evidence":
        part, _, side = component.rpartition(".")
        if side not in _SIDES:
            return _UNKNOWN
        kind = kind_of(part, report["machine"])
        if leaf in _COMPARED:
            return natural_unit(kind, Side(side)) if _measured(part, side, report) else motion_unit(kind)
        return natural_unit(kind, Side(side)) if leaf in _OF_THE_SIGNAL else "1"
    if head == "replay":
        return replayed_unit(leaf) or _UNKNOWN
    if head == "path":
        return "m"
    signal = find_signal(column)
    return _UNKNOWN if signal is None else signal.shown_unit


def _measured(component: str, side: str, report: ReportDocument) -> bool:
    """Whether a side is judged by what is measured of it; a model compares the motion that a valve gives."""
    return any(
        row["tier"] == Tier.DIRECT
        for row in report["coverage"]
        if row["component"] == component and row["side"] == side
    )
