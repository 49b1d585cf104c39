"""Lanes of the fault timeline: states merged to what a screen can show, faults as bars on top."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from diagnosis.pages.labels import FAULT_MODES, clock, fault_title, known, part, span, state_label
from diagnosis.report.confidence import known_sides

_BUCKETS = 2000
_GONE = ("stuck", "no_signal")
_TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400)


@dataclass(frozen=True)
class Bar:
    """One fault on a lane; places in percent of the mission. `follows`: another fault may be its cause."""

    fault: str
    state: str
    left: float
    width: float
    label: str
    title: str
    follows: bool = False


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


@dataclass(frozen=True)
class Timeline:
    """Lanes with faults, lanes without, phases and time marks."""

    lanes: tuple[Lane, ...]
    quiet: tuple[Lane, ...]
    summary: str
    phases: tuple[Bar, ...]
    ticks: tuple[tuple[float, str], ...]
    follows: bool = False


def kind_of(component: str, machine: Mapping[str, Any]) -> str:
    """Whether a component is a wheel or a steering axle."""
    return (
        "steer"
        if component in (machine.get("axles") or ()) and component not in (machine.get("wheels") or ())
        else "wheel"
    )


def merged(spans: Iterable[Mapping[str, Any]], key: str, duration: float) -> list[tuple[str, int, int]]:
    """Spans on a grid of 2000 stretches: faults are never lost, of the others the one at a stretch's middle counts."""
    order: list[str] = []
    grid = np.full(_BUCKETS, -1)
    loud: list[tuple[int, int, int]] = []
    scale = _BUCKETS / duration if duration > 0 else 0.0
    for s in spans:
        word = s[key]
        if word not in order:
            order.append(word)
        a, b = s["start_s"] * scale, s["stop_s"] * scale
        if word in FAULT_MODES:
            first = min(_BUCKETS - 1, max(0, math.floor(a)))
            loud.append((first, max(first + 1, math.ceil(b)), order.index(word)))
        else:
            grid[max(0, math.ceil(a - 0.5)) : max(0, math.ceil(b - 0.5))] = order.index(word)
    for first, last, code in loud:
        grid[first:last] = code
    edges = np.flatnonzero(np.diff(grid, prepend=-2, append=-2))
    runs = zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
    return [(order[grid[a]], a, b) for a, b in runs if grid[a] >= 0]


def _lines(spans: Sequence[Mapping[str, Any]], side: str, duration: float) -> tuple[Line, ...]:
    runs = sorted(merged(spans, "state", duration), key=lambda r: r[0])
    return tuple(
        Line(known(state), state_label(state, side), "".join(f"M{a} 5H{b}" for _, a, b in group))
        for state, group in groupby(runs, key=lambda r: r[0])
    )


def causes(faults: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Faults that may be no more than a consequence, each with the fault that may be its cause.

    A stuck or silent part misleads what is inferred of its component's other side: a fault there that a model told,
    without a second measurement, and most of which lies within the other's time, may follow from it.
    """
    gone: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for f in faults:
        if f["mode"] in _GONE:
            gone.setdefault((f["component"], f["kind"]), []).append(f)
    out = {}
    for f in faults:
        if f.get("tier") == "direct" or f["mode"] in _GONE or f["side"] == "sensor_or_actuator":
            continue
        length = f["stop_s"] - f["start_s"]
        for g in gone.get((f["component"], f["kind"]), ()):
            shared = min(f["stop_s"], g["stop_s"]) - max(f["start_s"], g["start_s"])
            if g["side"] not in (f["side"], "sensor_or_actuator") and shared > 0.5 * length:
                out[f["id"]] = g["id"]
    return out


def _bar(fault: Mapping[str, Any], duration: float, cause: str = "") -> Bar:
    left = 100 * fault["start_s"] / duration
    width = 100 * (fault["stop_s"] - fault["start_s"]) / duration
    mode = state_label(fault["mode"], fault["side"])
    words = f"{fault['id']} {mode.lower()}"
    label = words if width > 10 else fault["id"] if width > 0.9 + 0.8 * len(fault["id"]) else ""
    times = f"{clock(fault['start_s'], 2)} to {clock(fault['stop_s'], 2)}"
    title = f"{fault['id']}: {fault_title(fault)}, {times}" + (f"; may follow from {cause}" if cause else "")
    return Bar(fault["id"], known(fault["mode"]), left, width, label, title, bool(cause))


def _on_lane(fault: Mapping[str, Any], component: str, kind: str, side: str) -> bool:
    return fault["component"] == component and fault["kind"] == kind and fault["side"] in {side, "sensor_or_actuator"}


def _quiet_state(spans: Sequence[Mapping[str, Any]]) -> str:
    seconds: dict[str, float] = {}
    for s in spans:
        seconds[s["state"]] = seconds.get(s["state"], 0.0) + s["stop_s"] - s["start_s"]
    if seconds.get("healthy", 0.0) > 0:
        return "healthy"
    return known(max(seconds, key=lambda k: seconds[k])) if seconds else "not_assessed"


def ticks(duration: float) -> tuple[tuple[float, str], ...]:
    """Time marks: place in percent and words."""
    if duration <= 0:
        return ()
    step = next((s for s in _TICKS if duration / s <= 8), duration)
    count = int(duration / step + 1e-9)
    return tuple((100 * k * step / duration, clock(k * step, 0 if step >= 1 else 1)) for k in range(count + 1))


def timeline(report: Mapping[str, Any], duration: float, bars: Collection[str] | None = None) -> Timeline:
    """Lanes for the components of a report in machine order, sensor before actuator.

    Parameters
    ----------
    report : Mapping[str, Any]
        The parsed ``report.json``.
    duration : float
        Length of the time axis [s].
    bars : Collection[str] or None
        Names of the faults that get a bar of their own, the others are part of their lane's line; None: all.
    """
    machine, faults = report.get("machine") or {}, report.get("intervals") or ()
    by_lane: dict[tuple[str, str, str], list[Mapping[str, Any]]] = {}
    for c in machine.get("wheels") or ():
        by_lane.update({(c, "wheel", side): [] for side in ("sensor", "actuator")})
    for c in machine.get("axles") or ():
        by_lane.update({(c, "steer", side): [] for side in ("sensor", "actuator")})
    for s in report.get("states") or ():
        kind = s.get("kind") or kind_of(s["component"], machine)
        by_lane.setdefault((s["component"], kind, s["side"]), []).append(s)
    brief = {key for key, side in known_sides(report).items() if not side.assessed}
    cause = causes([f for f in faults if bars is None or f["id"] in bars])
    lanes: list[Lane] = []
    quiet: list[Lane] = []
    counts: dict[str, int] = {}
    for (c, kind, side), spans in by_lane.items():
        mine = [f for f in faults if _on_lane(f, c, kind, side)]
        own = [f for f in sorted(mine, key=lambda f: f["start_s"]) if bars is None or f["id"] in bars]
        drawn = tuple(_bar(f, duration, cause.get(f["id"], "")) for f in own) if duration > 0 else ()
        if len(own) < len(mine):
            spans = [*spans, *({**f, "state": f["mode"]} for f in mine)]
        total = sum(f["stop_s"] - f["start_s"] for f in mine)
        share = 100 * total / duration if duration > 0 else 0.0
        faulty = "" if not mine else f"{share:.1f} %" if share >= 0.05 else span(total)
        state = known(mine[0]["mode"]) if mine else _quiet_state(spans)
        group = lanes if mine else quiet
        if not mine:
            words = "healthy" if state == "healthy" else f"{state_label(state).lower()} throughout"
            if state == "healthy" and (c, side) in brief:
                state, words = "not_assessed", "not judged long enough"
            counts[words] = counts.get(words, 0) + 1
        first = not group or group[-1].component != c
        group.append(Lane(c, part(kind, side), state, _lines(spans, side, duration), drawn, faulty, first))
    summary = f"{len(quiet)} lane{'s' * (len(quiet) != 1)} without a fault: " + ", ".join(
        f"{n} {words}" for words, n in counts.items()
    )
    return Timeline(tuple(lanes), tuple(quiet), summary, _phases(report, duration), ticks(duration), bool(cause))


def _phases(report: Mapping[str, Any], duration: float) -> tuple[Bar, ...]:
    runs = merged(report.get("phases") or (), "name", duration)
    bars = []
    for name, a, b in runs:
        left, width = 100 * a / _BUCKETS, 100 * (b - a) / _BUCKETS
        times = f"{clock(left * duration / 100)} to {clock((left + width) * duration / 100)}"
        style = name if name in {"forward", "reverse", "standstill", "turning"} else "other"
        bars.append(Bar("", style, left, width, name if width > 0.9 * len(name) else "", f"{name}, {times}"))
    return tuple(bars)
