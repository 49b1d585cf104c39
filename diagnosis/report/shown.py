"""What a mission would have shown: one table, and for each part the smallest loss over time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from diagnosis.report.judged_parts import kind_of
from diagnosis.results.clearing_rows import DetectabilityRow, DetectabilityTrace
from diagnosis.results.detectability import Deviation
from diagnosis.results.document import ReportDocument
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.plain_numbers import plain
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

_WIDE, _HIGH = 2000, 100
_STEP_S = 2.0  # drawn for a place without another one

#: Columns of the table: deviation, its length [s], heading.
_COLUMNS: tuple[tuple[Deviation, float | None, str], ...] = (
    (Deviation.INEFFICIENT, 2.0, ">Loss for 2 s"),
    (Deviation.INEFFICIENT, 10.0, ">Loss for 10 s"),
    (Deviation.INEFFICIENT, None, ">Loss all the time"),
    (Deviation.NO_SIGNAL, 2.0, ">Dead for 2 s"),
    (Deviation.STUCK, 10.0, ">Stuck for 10 s"),
    (Deviation.EXCESS, 10.0, ">Too much for 10 s"),
    (Deviation.OFFSET, 10.0, ">Offset for 10 s"),
    (Deviation.NOISY, 10.0, ">Noise for 10 s"),
    (Deviation.DELAY, None, ">Delay"),
)
HEADS: tuple[str, ...] = ("Part", *(words for _, _, words in _COLUMNS), "Told from")


@dataclass(frozen=True)
class ShownLane:
    """The smallest loss of ten seconds that one part would have shown, over time: SVG paths over 0…2000 and 0…100."""

    component: str
    part: str
    first: bool
    area: str
    blind: str
    words: str


@dataclass(frozen=True)
class ShownPart:
    """A line of the table."""

    part: str
    cells: tuple[str, ...]
    told: str


def shown_parts(report: ReportDocument) -> list[ShownPart]:
    """Lines of the table, in the machine's order."""
    by_part = _by_part(report)
    out, words = [], words_of(report["machine"])
    for (component, side), rows in by_part.items():
        kind, cells = kind_of(component, report["machine"]), _cells(rows)
        out.append(ShownPart(words.part_words(kind, component, side), cells, _told(kind, side, rows, words)))
    return out


def cells_of(report: ReportDocument) -> dict[tuple[str, str], tuple[str, ...]]:
    """For each component and side the cells between the first and the last of `HEADS`."""
    return {key: _cells(rows) for key, rows in _by_part(report).items()}


def longer_is_harder(report: ReportDocument) -> bool:
    """Whether of some part a loss of ten seconds has to be larger than one of two seconds to be shown."""
    sizes = [
        [_needed(rows.get((Deviation.INEFFICIENT, length))) for length in (2.0, 10.0)]
        for rows in _by_part(report).values()
    ]
    return any(short < longer for short, longer in sizes)


def _needed(row: DetectabilityRow | None) -> float:
    """Size from which on a loss shows [1]; infinite where none does, not a number where it was not asked."""
    if row is None or not row["places"]:
        return math.nan
    return math.inf if row["size"] is None else row["size"]


_Rows = Mapping[tuple[str, float | None], DetectabilityRow]


def _by_part(report: ReportDocument) -> dict[tuple[str, str], _Rows]:
    out: dict[tuple[str, str], dict[tuple[str, float | None], DetectabilityRow]] = {}
    for row in report["detectability"]["rows"]:
        out.setdefault((row["component"], row["side"]), {})[row["deviation"], row["for_s"]] = row
    return {**out}


def _cells(rows: _Rows) -> tuple[str, ...]:
    return tuple(_cell(rows.get((deviation, length))) for deviation, length, _ in _COLUMNS)


def _cell(row: DetectabilityRow | None) -> str:
    """Smallest size, or at how many of the places it is found."""
    if row is None:
        return ""
    if not row["places"]:
        return "too brief"
    size, unit = row["size"], row["unit"]
    if not unit:
        share = row["share"] or 0.0
        return "found" if share >= 0.95 else f"found in {100 * share:.0f} %" if share >= 0.005 else "never found"
    if size is None:
        return "not shown"
    if not size:
        return "not cleared"
    if unit == "rad":
        return f"{plain(math.degrees(size), 2)}°"
    return f"{100 * size:.0f} %" if unit == "1" else f"{plain(size, 2)} {unit}"


def _told(kind: Kind, side: str, rows: Mapping[tuple[str, float | None], DetectabilityRow], words: MachineWords) -> str:
    """From what else such a fault is told."""
    told = next((r["told"] for r in rows.values()), side)
    other = Side.ACTUATOR if side == Side.SENSOR else Side.SENSOR
    return "every other part" if told != Side.SENSOR_OR_ACTUATOR else f"all but the {words.part_name(kind, other)}"


def shown_lanes(report: ReportDocument, duration: float) -> list[ShownLane]:
    """Lanes of the picture, in the machine's order. `duration` in s."""
    out: list[ShownLane] = []
    for trace in _merged(report["detectability"]["traces"]):
        component, side = trace["component"], trace["side"]
        part = words_of(report["machine"]).part_name(kind_of(component, report["machine"]), side)
        first = not out or out[-1].component != component
        area, blind = _paths(trace, duration)
        out.append(ShownLane(component, part, first, area, blind, _ten_seconds(report, trace)))
    return out


def _merged(traces: Sequence[DetectabilityTrace]) -> list[DetectabilityTrace]:
    """Both sides of a part as one where they show the same."""
    out: list[DetectabilityTrace] = []
    for trace in traces:
        if out and out[-1]["component"] == trace["component"] and out[-1]["loss"] == trace["loss"]:
            out[-1] = {**out[-1], "side": Side.SENSOR_OR_ACTUATOR}
        else:
            out.append(trace)
    return out


def _paths(trace: DetectabilityTrace, duration: float) -> tuple[str, str]:
    """Area below the smallest loss, and stretches in which no loss would show."""
    if not duration or not trace["start_s"]:
        return "", ""
    scale = _WIDE / duration
    area, blind = [], []
    for start, stop, loss in _steps(trace["start_s"], trace["loss"]):
        a, b = start * scale, stop * scale
        if loss is None:
            blind.append(f"M{a:.0f} 0H{b:.0f}V{_HIGH}H{a:.0f}Z")
        else:
            area.append(f"M{a:.0f} {_HIGH}V{_HIGH * (1.0 - loss):.0f}H{b:.0f}V{_HIGH}Z")
    return "".join(area), "".join(blind)


def _steps(starts: Sequence[float], losses: Sequence[float | None]) -> list[tuple[float, float, float | None]]:
    """Each place until the next one, or for as long as places mostly are apart."""
    apart = sorted(b - a for a, b in pairwise(starts))
    usual = 1.5 * apart[len(apart) // 2] if apart else _STEP_S
    ends = [min(b, a + usual) for a, b in pairwise(starts)] + [starts[-1] + usual]
    return list(zip(starts, ends, losses, strict=True))


def _ten_seconds(report: ReportDocument, trace: DetectabilityTrace) -> str:
    """What the table says of a loss of ten seconds."""
    sides = Side(trace["side"]).sides
    about = (trace["component"], Deviation.INEFFICIENT, 10.0)
    rows = [r for r in report["detectability"]["rows"] if (r["component"], r["deviation"], r["for_s"]) == about]
    return _cell(next((r for r in rows if r["side"] in sides), None))
