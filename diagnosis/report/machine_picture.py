"""The machine from above: wheels and steering axles with the symbol of their worst fault."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from diagnosis.pages.labels import span
from diagnosis.pages.svg import badge, text
from diagnosis.report.judged_parts import unpowered
from diagnosis.report.standing import Standing, standings_of
from diagnosis.results.candidates import label_of, symbol_of
from diagnosis.results.document import IntervalRow, ReportDocument, WheelPlace
from diagnosis.results.durations import covered_s
from diagnosis.results.machine_words import HYDRAULIC, MachineWords, words_of
from diagnosis.results.vocabulary import Kind, Severity
from replay.faults import Side, State

_MARGIN, _LINE = 26.0, 15  # room for text on either side, and characters that fit in a line of it
_ALONG, _ACROSS = {"F": "front", "M": "middle", "R": "rear"}, {"R": "right", "L": "left"}
_SHORT_NAME = re.compile("[FMR][RL]")
_W, _TYRE_W, _TYRE_H, _PITCH, _JOINT = 372.0, 50.0, 96.0, 132.0, 58.0


@dataclass(frozen=True)
class Condition:
    """What the picture says of one wheel or axle: state, lines of text, and the fault that it opens."""

    state: str
    lines: tuple[str, ...]
    fault: str
    title: str


def condition(
    component: str,
    kind: Kind,
    faults: Sequence[IntervalRow],
    standings: Mapping[tuple[str, str], Standing],
    words: MachineWords = HYDRAULIC,
) -> Condition:
    """Worst fault of a component, or how its parts stand; what is of severity *info* is a remark.

    Parameters
    ----------
    component : str
        Wheel or axle.
    kind : Kind
        Which of the two.
    faults : Sequence[IntervalRow]
        The report's intervals.
    standings : Mapping[tuple[str, str], Standing]
        How each component and side stands; those that are missing were not judged.
    words : MachineWords
        How to speak of the machine.
    """
    every = [f for f in faults if f["component"] == component and f["kind"] == kind]
    mine = [f for f in every if f["severity"] != Severity.INFO]
    if every and not mine:
        found = condition(component, kind, [], standings, words)
        remark = f"{len(every)} remark{'s' * (len(every) > 1)}"
        return Condition(found.state, (*found.lines, remark), every[0]["id"], f"{found.title}; {remark}")
    if mine:
        worst = min(mine, key=_urgency)
        name = words.part_name(kind, worst["side"])
        label = label_of(worst).lower()
        same = [f for f in mine if f["side"] == worst["side"] and label_of(f).lower() == label]
        length = span(covered_s((f["start_s"], f["stop_s"]) for f in same))
        more: tuple[str, ...] = (f"and {len(mine) - len(same)} more",) if len(mine) > len(same) else ()
        faulty = {side for f in mine for side in Side(f["side"]).sides}
        more += tuple(
            f"{words.part_name(kind, side)} {how}"
            for (c, side), how in standings.items()
            if c == component and side not in faulty and how in (Standing.NOT_JUDGED, Standing.NOT_LONG_ENOUGH)
        )
        heading = name[0].upper() + name[1:]
        title = f"{component}: {name} {label}, {length}{''.join(f', {x}' for x in more)}"
        return Condition(symbol_of(worst), (heading, label, length, *more), worst["id"], title)
    own = {words.part_name(kind, side): how for (c, side), how in standings.items() if c == component}
    open_ = {name: how for name, how in own.items() if how is not Standing.CLEARED}
    if own and not open_:
        return Condition(State.HEALTHY, ("Healthy",), "", f"{component}: no fault found")
    if open_ and all(how is Standing.NOT_STEERED for how in open_.values()):
        resting = (
            [str(Standing.NOT_STEERED)] if len(open_) == len(own) else [f"{name} {how}" for name, how in open_.items()]
        )
        title = f"{component}: {', '.join(('no fault found', *resting))}"
        return Condition(State.NOT_EXCITED, ("No fault found", *resting), "", title)
    if all(how is Standing.NOT_JUDGED for how in own.values()):
        return Condition(State.NOT_ASSESSED, ("Not judged",), "", f"{component}: not judged")
    alike = len(open_) == len(own) and len(set(open_.values())) == 1
    said = list(dict.fromkeys(open_.values())) if alike else [f"{name} {how}" for name, how in open_.items()]
    return Condition(
        State.NOT_ASSESSED, ("No fault found", *said), "", f"{component}: {', '.join(('no fault found', *said))}"
    )


def _urgency(fault: IntervalRow) -> tuple[int, int, float]:
    """Place among the faults of one component, as among the actions: of those to stop for a drive's comes first."""
    severity = Severity(fault["severity"])
    sides = {Side.ACTUATOR.value: 0, Side.SENSOR_OR_ACTUATOR.value: 1}
    return -severity.rank, sides.get(fault["side"], 2) if severity is Severity.HIGH else 0, fault["start_s"]


def _rows(wheels: Sequence[str], geometry: Mapping[str, WheelPlace]) -> list[list[str]]:
    """Wheels in rows from the front, each from left to right; a grid of two columns without geometry."""
    if not all(w in geometry for w in wheels):
        columns = 1 if len(wheels) == 1 else 2 if len(wheels) <= 8 else 4
        return [list(wheels[i : i + columns]) for i in range(0, len(wheels), columns)]
    length = max((abs(geometry[w]["x"]) for w in wheels), default=0.0)
    rows: list[list[str]] = []
    for w in sorted(wheels, key=lambda w: -geometry[w]["x"]):
        if rows and abs(geometry[rows[-1][0]]["x"] - geometry[w]["x"]) <= 0.15 * length:
            rows[-1].append(w)
        else:
            rows.append([w])
    return [sorted(r, key=lambda w: -(geometry[w]["y"] + geometry[w]["offset"])) for r in rows]


def _hit(name: str, c: Condition, shapes: Markup) -> Markup:
    if not c.fault:
        return Markup('<g data-c="{}" role="img" aria-label="{}"><title>{}</title>{}</g>').format(
            name, c.title, c.title, shapes
        )
    return Markup(
        '<g class="hit" data-c="{}" data-f="{}" role="button" tabindex="0" aria-label="{}"><title>{}</title>{}</g>'
    ).format(name, c.fault, c.title, c.title, shapes)


def _short(words: str, length: int) -> str:
    return words if len(words) <= length else words[: length - 1] + "…"


def axles_in_words(report: ReportDocument) -> list[tuple[str, str]]:
    """What is wrong with axles, or keeps them from being called healthy, in words after its symbol: in the picture they have the symbol alone."""
    found = _conditions(report)
    return [(found[a].state, found[a].title) for a in report["machine"]["axles"] if found[a].state != State.HEALTHY]


def places_in_words(report: ReportDocument) -> str:
    """What the names of the wheels stand for, where they are the usual short ones: ``FR = front right``; else empty."""
    wheels = report["machine"]["wheels"]
    if words_of(report["machine"]).part != "wheel" or not all(_SHORT_NAME.fullmatch(w) for w in wheels):
        return ""
    return ", ".join(f"{w} = {_ALONG[w[0]]} {_ACROSS[w[1]]}" for w in wheels)


def _conditions(report: ReportDocument) -> dict[str, Condition]:
    """What the picture says of every wheel and axle, by name."""
    machine, faults, standings = report["machine"], report["intervals"], standings_of(report)
    parts = ((Kind.WHEEL, machine["wheels"]), (Kind.STEER, machine["axles"]))
    found = {c: condition(c, kind, faults, standings, words_of(machine)) for kind, names in parts for c in names}
    free = unpowered(machine)
    return {c: _free(f, words_of(machine).part) if c in free else f for c, f in found.items()}


def _free(c: Condition, part: str) -> Condition:
    """What the picture says of a wheel without a drive."""
    return Condition(c.state, (*c.lines, f"free {part}"), c.fault, f"{c.title}; free {part}, without a drive")


def machine_picture(report: ReportDocument) -> Markup:
    """Picture of the machine for a report; wheels stand in a grid where the geometry is not known."""
    machine = report["machine"]
    wheels, axles, geometry = machine["wheels"], machine["axles"], machine["geometry"] or {}
    words, conditions = words_of(machine), _conditions(report)
    rows = _rows(wheels, geometry)
    placed = bool(wheels) and all(w in geometry for w in wheels)
    top = 40.0 if placed else 26.0
    wide = max((len(r) for r in rows), default=1)
    parts: list[Markup] = []
    bottom = top + _PITCH * len(rows) - (_PITCH - _TYRE_H)
    if placed:
        parts.append(Markup('<path class="nose" d="M186 8l9 13h-18z"/>') + text(203, 19, "front", "lbl"))
        shape = '<rect class="body" x="146" y="{}" width="80" height="{}" rx="18"/>'
        parts.append(Markup(shape).format(top - 6, bottom - top + 12))
    else:
        parts.append(
            text(186, 12, "positions not known" if words.part == "wheel" else "joints in their listed order", "lbl mid")
        )
    axle_rows: dict[str, float] = {}
    for i, row in enumerate(rows):
        y = top + i * _PITCH
        for j, w in enumerate(row):
            centre, outward = _column(j, len(row), wide)
            parts.append(_wheel(w, centre, y, outward, words.part, conditions[w]))
            if placed:
                axle_rows.setdefault(geometry[w]["axle"], y + _TYRE_H / 2)
    extra = 0
    for a in axles:
        c = conditions[a]
        if a in axle_rows and not a.endswith("_steer"):
            parts.append(_axle(a, 186, axle_rows[a], c))
        else:
            parts.append(_axle(a, 100 + 172 * (extra % 2), bottom + 40 + 48 * (extra // 2), c))
            extra += 1
    height = bottom + 30 + (48 * ((extra + 1) // 2) + 4 if extra else 0)
    note = "front at the top" if placed else f"positions not known, {words.parts} in their listed order"
    return Markup(
        '<svg class="machine" viewBox="{x:.0f} 0 {w:.0f} {h:.0f}" role="group" aria-label="{m}, {n}">{p}</svg>'
    ).format(
        x=-_MARGIN,
        w=_W + 2 * _MARGIN,
        h=height,
        n=note,
        m="Machine from above" if words.part == "wheel" else "Joints",
        p=Markup("").join(parts),
    )


def _column(j: int, count: int, wide: int) -> tuple[float, int]:
    """Centre of a wheel and the side its text stands on (−1 left, 1 right, 0 none)."""
    if wide > 2:
        return 40 + (_W - 80) * (j + 0.5) / count, 0
    if count == 1:
        return _W / 2, 1
    return (123.0, -1) if j == 0 else (249.0, 1)


def _wheel(name: str, x: float, y: float, outward: int, part: str, c: Condition) -> Markup:
    round_ = part == "joint"  # a joint is drawn as a circle
    width, height = (_JOINT, _JOINT) if round_ else (_TYRE_W, _TYRE_H)
    shapes = Markup('<rect class="tyre {}" x="{}" y="{}" width="{}" height="{}" rx="{}"/>').format(
        c.state, x - width / 2, y + (_TYRE_H - height) / 2, width, height, width / 2 if round_ else 12
    )
    shapes += text(x, y + 30, _short(name, 6), "name") + badge(c.state, x, y + 60, 24)
    style = "side end" if outward < 0 else "side"
    lines = [(piece, not i) for i, line in enumerate(c.lines) for piece in textwrap.wrap(line, _LINE)]
    for i, (line, bold) in enumerate(lines if outward else ()):
        shapes += text(
            x + outward * 36,
            y + _TYRE_H / 2 + 5 + 17 * (i - (len(lines) - 1) / 2),
            line,
            style + (" b" if bold else ""),
        )
    return _hit(name, c, shapes)


def _axle(name: str, x: float, y: float, c: Condition) -> Markup:
    shapes = Markup('<rect class="axle {}" x="{}" y="{}" width="72" height="40" rx="9"/>').format(
        c.state, x - 36, y - 20
    )
    shapes += text(x, y - 6, _short(name, 10), "name small") + badge(c.state, x, y + 9, 17)
    return _hit(name, c, shapes)
