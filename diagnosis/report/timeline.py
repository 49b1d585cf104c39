"""Lanes of the fault timeline: states merged to what a screen can show, faults as bars on top."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from diagnosis.pages.labels import clock, fault_title, span
from diagnosis.report.judged_parts import kind_of, sides_of_parts
from diagnosis.report.standing import Standing, standings_of
from diagnosis.results.candidates import label_of, symbol_of
from diagnosis.results.consequences import Stated, causes_of
from diagnosis.results.document import IntervalRow, PhaseRow, ReportDocument
from diagnosis.results.durations import covered_s
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.vocabulary import Kind, Severity
from replay.faults import FAULT_STATES, Side, State

_BUCKETS = 2000
_TOUCHING = 1e-6  # percent of a lane: one bar ends where the next begins
_LEAST_WIDTH, _MOST_ROWS = 0.6, 3  # percent of a lane that a bar takes at least on a screen; bars above each other
_TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400)


#: State or phase, start and stop [s].
Span = tuple[str, float, float]


@dataclass(frozen=True)
class Bar:
    """One fault on a lane; places in percent of the mission.

    Attributes
    ----------
    follows : bool
        Another fault may be its cause.
    slight : bool
        Of severity *info*: it paints no part.
    row, rows : int
        Where bars would cover each other they share the lane's height.
    """

    fault: str
    state: str
    left: float
    width: float
    label: str
    title: str
    follows: bool = False
    slight: bool = False
    row: int = 0
    rows: int = 1


@dataclass(frozen=True)
class Line:
    """All stretches of one state on a lane, as an SVG path over 0…2000."""

    state: str
    label: str
    d: str


@dataclass(frozen=True)
class Lane:
    """One component and side."""

    component: str
    part: str
    state: str
    lines: tuple[Line, ...]
    bars: tuple[Bar, ...]
    faulty: str
    first: bool = False
    side: str = ""


@dataclass(frozen=True)
class Timeline:
    """Lanes with faults, lanes without, phases and time marks."""

    lanes: tuple[Lane, ...]
    quiet: tuple[Lane, ...]
    summary: str
    phases: tuple[Bar, ...]
    ticks: tuple[tuple[float, str], ...]
    follows: bool = False


def merged(spans: Iterable[Span], duration: float) -> list[tuple[str, int, int]]:
    """Spans on a grid of 2000 stretches: faults are never lost, of the others the one at a stretch's middle counts.

    Times in s.
    """
    order: list[str] = []
    grid = np.full(_BUCKETS, -1)
    faults: list[tuple[int, int, int]] = []
    scale = _BUCKETS / duration if duration > 0 else 0.0
    for name, start, stop in spans:
        if name not in order:
            order.append(name)
        a, b = start * scale, stop * scale
        if name in FAULT_STATES:
            first = min(_BUCKETS - 1, max(0, math.floor(a)))
            faults.append((first, max(first + 1, math.ceil(b)), order.index(name)))
        else:
            grid[max(0, math.ceil(a - 0.5)) : max(0, math.ceil(b - 0.5))] = order.index(name)
    for first, last, code in faults:
        grid[first:last] = code
    edges = np.flatnonzero(np.diff(grid, prepend=-2, append=-2))
    runs = zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
    return [(order[grid[a]], a, b) for a, b in runs if grid[a] >= 0]


def _lines(spans: Sequence[Span], side: str, duration: float) -> tuple[Line, ...]:
    runs = sorted(merged(spans, duration), key=lambda r: r[0])
    return tuple(
        Line(state, state_label(state, side), "".join(f"M{a} 5H{b}" for _, a, b in group))
        for state, group in groupby(runs, key=lambda r: r[0])
    )


def causes(faults: Sequence[IntervalRow]) -> dict[str, str]:
    """Faults that may be no more than a consequence, each with the fault that may be its cause; see `causes_of`."""
    return causes_of([Stated(*(f[key] for key in Stated._fields)) for f in faults])  # type: ignore[literal-required]


def _bar(fault: IntervalRow, duration: float, words: MachineWords, cause: str = "") -> Bar:
    left = 100 * fault["start_s"] / duration
    width = 100 * (fault["stop_s"] - fault["start_s"]) / duration
    label = f"{fault['id']} {label_of(fault).lower()}"
    times = f"{clock(fault['start_s'], 2)} to {clock(fault['stop_s'], 2)}"
    title = f"{fault['id']}: {fault_title(fault, words)}, {times}" + (f"; may follow from {cause}" if cause else "")
    slight = fault["severity"] == Severity.INFO
    return Bar(fault["id"], symbol_of(fault), left, width, label, title, bool(cause), slight)


def side_by_side(bars: Iterable[Bar]) -> tuple[Bar, ...]:
    """Bars, ordered by their start, that would cover each other on a screen, in rows of their own."""
    out: list[Bar] = []
    group: list[Bar] = []
    ends: list[float] = []

    def close() -> None:
        out.extend(replace(b, rows=len(ends)) for b in group)
        group.clear()
        ends.clear()

    for b in bars:
        if ends and b.left >= max(ends) - _TOUCHING:
            close()
        row = next((i for i, end in enumerate(ends) if b.left >= end - _TOUCHING), len(ends))
        stop = b.left + max(b.width, _LEAST_WIDTH)
        if row == len(ends) < _MOST_ROWS:
            ends.append(stop)
        else:
            row = min(row, _MOST_ROWS - 1)
            ends[row] = max(ends[row], stop)
        group.append(replace(b, row=row))
    close()
    return tuple(out)


def _main_state(spans: Sequence[Span]) -> str:
    """State of a lane without faults: healthy where any of it is, else the longest."""
    seconds: dict[str, float] = {}
    for state, start, stop in spans:
        seconds[state] = seconds.get(state, 0.0) + stop - start
    if seconds.get(State.HEALTHY, 0.0) > 0:
        return State.HEALTHY
    return max(seconds, key=lambda k: seconds[k]) if seconds else State.NOT_ASSESSED


def ticks(duration: float) -> tuple[tuple[float, str], ...]:
    """Time marks: place in percent and words. `duration` in s."""
    if duration <= 0:
        return ()
    step = next((s for s in _TICKS if duration / s <= 8), duration)
    count = int(duration / step + 1e-9)
    return tuple((100 * k * step / duration, clock(k * step, 0 if step >= 1 else 1)) for k in range(count + 1))


def timeline(report: ReportDocument, duration: float, bars: Collection[str] | None = None) -> Timeline:
    """Lanes for the components of a report in machine order, sensor before actuator.

    Parameters
    ----------
    report : ReportDocument
        The document.
    duration : float
        Length of the time axis [s].
    bars : Collection[str] or None
        Names of the faults that get a bar of their own, the others are part of their lane's line; None: all.
    """
    faults, machine_words = report["intervals"], words_of(report["machine"])
    standings = standings_of(report)
    cause = causes([f for f in faults if bars is None or f["id"] in bars])
    lanes: list[Lane] = []
    quiet: list[Lane] = []
    counts: dict[Standing, int] = {}
    for (c, kind, side), spans in _spans_by_lane(report).items():
        mine = [f for f in faults if f["component"] == c and f["kind"] == kind and side in Side(f["side"]).sides]
        group = lanes if mine else quiet
        first = not group or group[-1].component != c
        state = _main_state(spans)
        words = standings.get((c, side), Standing.NOT_JUDGED)
        if state == State.HEALTHY and words is not Standing.CLEARED:
            state = State.NOT_ASSESSED
        if mine:
            group.append(_faulty_lane(c, side, state, mine, spans, duration, bars, cause, first, machine_words))
            continue
        counts[words] = counts.get(words, 0) + 1
        name = machine_words.part_name(kind, side)
        group.append(Lane(c, name, state, _lines(spans, side, duration), (), "", first, side))
    summary = f"{len(quiet)} lane{'s' * (len(quiet) != 1)} without a fault: " + ", ".join(
        f"{n} {words}" for words, n in counts.items()
    )
    phases = _phases(report["phases"], duration)
    return Timeline(tuple(lanes), tuple(quiet), summary, phases, ticks(duration), bool(cause))


def _spans_by_lane(report: ReportDocument) -> dict[tuple[str, Kind, str], list[Span]]:
    """States of each component and side, in the machine's order; none where nothing was recorded."""
    machine = report["machine"]
    out: dict[tuple[str, Kind, str], list[Span]] = {part: [] for part in sides_of_parts(machine)}
    for s in report["states"]:
        lane = out.setdefault((s["component"], kind_of(s["component"], machine), s["side"]), [])
        lane.append((s["state"], s["start_s"], s["stop_s"]))
    return out


def _faulty_lane(
    component: str,
    side: str,
    beside: str,
    faults: Sequence[IntervalRow],
    spans: Sequence[Span],
    duration: float,
    bars: Collection[str] | None,
    cause: Mapping[str, str],
    first: bool,
    machine_words: MachineWords,
) -> Lane:
    """Lane with faults; those without a bar of their own are part of its line.

    Remarks, of severity *info*, leave the part in the state `beside` them and count for no faulty time.
    """
    own = [f for f in sorted(faults, key=lambda f: f["start_s"]) if bars is None or f["id"] in bars]
    bars_of = [_bar(f, duration, machine_words, cause.get(f["id"], "")) for f in own] if duration > 0 else []
    drawn = side_by_side(bars_of)
    if len(own) < len(faults):
        spans = [*spans, *((f["mode"], f["start_s"], f["stop_s"]) for f in faults)]
    painting = [f for f in faults if f["severity"] != Severity.INFO]
    total = covered_s((f["start_s"], f["stop_s"]) for f in painting)
    share = 100 * total / duration if duration > 0 else 0.0
    words = f"{share:.1f} %" if share >= 0.05 else span(total) if painting else "remark"
    name = machine_words.part_name(faults[0]["kind"], side)
    state = symbol_of(painting[0]) if painting else beside
    return Lane(component, name, state, _lines(spans, side, duration), drawn, words, first, side)


def _phases(phases: Sequence[PhaseRow], duration: float) -> tuple[Bar, ...]:
    bars = []
    for name, a, b in merged([(p["name"], p["start_s"], p["stop_s"]) for p in phases], duration):
        left, width = 100 * a / _BUCKETS, 100 * (b - a) / _BUCKETS
        times = f"{clock(left * duration / 100)} to {clock((left + width) * duration / 100)}"
        style = name if name in {"forward", "reverse", "standstill", "turning"} else "other"
        bars.append(Bar("", style, left, width, name if width > 0.5 * len(name) else "", f"{name}, {times}"))
    return tuple(bars)
