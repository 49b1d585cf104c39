"""Unit in which the page shows a column, and the factor to it: of its plot, as recorded, or by the column's name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from diagnosis.report.judged_parts import kind_of
from diagnosis.report.rows import Group, Row
from diagnosis.results.document import ReportDocument
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.stated_sizes import SAT
from diagnosis.results.vocabulary import Kind, Tier
from replay.control.loop_columns import replayed_unit
from replay.faults import Side
from replay.machine.quantities import OPENING
from replay.machine.signal_table import BY_KIND, find_signal

#: Of the effort of joints, as ROS has it.
EFFORT_UNIT = BY_KIND["wheel.effort"].shown_unit
DEGREES = 180.0 / math.pi
#: Leaf of the signal that tells what a component does.
MOTION = {Kind.WHEEL: "v", Kind.STEER: "phi"}
_COMPARED = ("residual", "threshold", "expected")
_OF_THE_SIGNAL = SAT
_UNKNOWN = "unknown unit"
_SIDES = {side.value for side in Side}


def motion_unit(kind: Kind, words: MachineWords) -> str:
    """Unit of what a component does, as it is kept."""
    return words.speed_unit if kind == Kind.WHEEL else BY_KIND[f"{kind}.{MOTION[kind]}"].shown_unit


def natural_unit(kind: Kind, side: Side, words: MachineWords) -> str:
    """Unit of the signal of a component's side: its motion, or the command of its drive."""
    return OPENING if side == Side.ACTUATOR else motion_unit(kind, words)


def on_page(unit: str, words: MachineWords) -> tuple[str, float]:
    """Unit in which the page shows a recorded one, and the factor to it: angles in degrees, commands in percent."""
    if unit in (OPENING, words.unit(OPENING)):
        return words.percent.strip(), 100.0
    if unit == words.speed_unit:
        return unit, 1.0
    return ("°", DEGREES) if unit == "rad" else ("°/s", DEGREES) if unit == "rad/s" else (unit, 1.0)


def units_of(
    columns: Sequence[str],
    report: ReportDocument,
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
) -> list[tuple[str, float]]:
    """Unit shown and factor to it, for each column."""
    words = words_of(report["machine"])
    known: dict[str, tuple[str, float]] = {}
    for row in (r for rows in [*figures.values(), *(g.rows for g in groups)] for r in rows):
        for t in row.traces:
            known.setdefault(t.column, (row.right[1] if t.right and row.right else row.unit, t.scale))
        for c in (*(row.band or ()), *((row.threshold,) if row.threshold else ())):
            known.setdefault(c, (row.unit, row.band_scale))
    recorded = {s["name"]: s["unit"] for s in report["signals"]}
    return [known.get(c) or on_page(recorded.get(c) or unit_of(c, report), words) for c in columns]


def unit_of(column: str, report: ReportDocument) -> str:
    """Unit of a column as it is kept: SI or the machine's unit of speed, ``1`` for shares, ``unknown unit`` where nothing tells."""
    words = words_of(report["machine"])
    head, _, rest = column.partition(".")
    component, _, leaf = rest.rpartition(".")
    if head == "evidence":
        part, _, side = component.rpartition(".")
        if side not in _SIDES:
            return _UNKNOWN
        kind = kind_of(part, report["machine"])
        if leaf in _COMPARED:
            return natural_unit(kind, Side(side), words) if _measured(part, side, report) else motion_unit(kind, words)
        return natural_unit(kind, Side(side), words) if leaf in _OF_THE_SIGNAL else "1"
    if head == "replay":
        unit = replayed_unit(leaf) or _UNKNOWN
        return words.speed_unit if unit == "m/s" else unit
    if head == "path":
        return "m"
    signal = find_signal(column)
    if signal is None:
        return _UNKNOWN
    return words.speed_unit if signal.group == "wheel" and signal.quantity == "speed" else signal.shown_unit


def _measured(component: str, side: str, report: ReportDocument) -> bool:
    """Whether a side is judged by what is measured of it; a model compares the motion that a valve gives."""
    return any(
        row["tier"] == Tier.DIRECT
        for row in report["coverage"]
        if row["component"] == component and row["side"] == side
    )
