"""Components of a fleet against its machines: in how many missions which mode was found, and what was never assessed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from diagnosis.audit.fleet.fleet_types import MachineRow, PartRow
from diagnosis.audit.fleet.page.svg import mark
from diagnosis.pages import labels
from diagnosis.results.candidates import UNCLEAR
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import words_of
from replay.faults import Side

_LEVELS = 4


@dataclass(frozen=True)
class Matrix:
    """Heads (component, its number of sides), sides, rows (machine, cells, sum), sums per column, and quiet machines."""

    heads: list[tuple[str, int]]
    sides: list[str]
    rows: list[tuple[str, list[Markup], int]]
    sums: list[int]
    quiet: int
    total: int


def matrix(machines: Sequence[MachineRow]) -> Matrix:
    """Machines in their order; those without a fault whose parts were all assessed are only counted."""
    columns = list(dict.fromkeys((p["component"], p["side"]) for m in machines for p in m["parts"]))
    place = {component: k for k, component in reversed(list(enumerate(c[0] for c in columns)))}
    columns.sort(key=lambda c: place[c[0]])
    tables = [{(p["component"], p["side"]): p for p in m["parts"]} for m in machines]
    most = max((n for t in tables for p in t.values() for n in (_count(p),)), default=0)
    rows, sums, quiet = [], [0] * len(columns), 0
    for m, table in zip(machines, tables, strict=True):
        counts = [_count(table[c]) if c in table else 0 for c in columns]
        blind = any(not p["assessed"] for p in table.values()) or not table
        if not any(counts) and not blind:
            quiet += 1
            continue
        sums = [a + b for a, b in zip(sums, counts, strict=True)]
        cells = [_cell(table.get(c), n, most, bool(table)) for c, n in zip(columns, counts, strict=True)]
        rows.append((m["label"], cells, sum(counts)))
    heads: list[tuple[str, int]] = []
    for component, _ in columns:
        if heads and heads[-1][0] == component:
            heads[-1] = (component, heads[-1][1] + 1)
        else:
            heads.append((component, 1))
    drives = {words_of(m).drive for m in machines}
    names = {Side.SENSOR.value: "sensor", Side.ACTUATOR.value: drives.pop() if len(drives) == 1 else "drive"}
    sides = [names.get(side, side) for _, side in columns]
    return Matrix(heads, sides, rows, sums, quiet, sum(sums))


def _count(part: PartRow) -> int:
    return sum(part["modes"].values())


def _cell(part: PartRow | None, count: int, most: int, judged: bool) -> Markup:
    if part is None and judged:
        return Markup('<td class="nil"><span class="sr">no such part</span></td>')
    if part is None or not count:
        if part is not None and part["assessed"]:
            return Markup('<td class="nil"><span class="sr">0</span></td>')
        return Markup(
            '<td class="blind" title="never judged long enough">–<span class="sr"> never judged long enough</span></td>'
        )
    level = 1 + (_LEVELS - 1) * (count - 1) // max(1, most - 1)
    modes = Markup("").join(
        Markup('<span class="m">{}<b>{}</b><span class="sr"> {}</span></span>').format(
            mark("warning" if mode == UNCLEAR else labels.known(mode)), n, state_label(mode, part["side"])
        )
        for mode, n in sorted(part["modes"].items(), key=lambda p: -p[1])
    )
    return Markup('<td class="h{}" title="{}">{}</td>').format(
        level, ", ".join(f"{state_label(k, part['side'])} in {n}" for k, n in part["modes"].items()), modes
    )
