"""Mapped and missing signals, for the terminal and as JSON."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import PurePath
from typing import TypedDict

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from cli.tables.layout import ByWidth, bullets, section, table, text, whole_lines
from diagnosis.clearing.forecast import Forecast, forecast
from diagnosis.decision.missing import applies, cost_of_missing
from diagnosis.results.machine_words import MachineWords, machine_words
from replay.machine.config import Machine
from replay.machine.units import kept_unit
from replay.mission import MissionFile
from replay.setup.ranges import range_text
from replay.signals.mapping import NO_CHANNEL
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import median_period


class MachinePart(TypedDict):
    """The machine, and where its settings come from."""

    name: str
    source: str
    wheels: list[str]


class FilePart(TypedDict):
    """One file of the mission."""

    path: str
    sha256: str
    bytes: int
    format: str
    notes: list[str]
    damage: list[str]


class MappedSignal(TypedDict):
    """A signal of the machine, the channel where it was found, and what it holds."""

    name: str
    channel: str
    recorded_unit: str | None
    unit: str
    guessed: bool
    source: str
    samples: int
    without_value: int
    rate_hz: float | None
    min: float | None
    max: float | None


class MissingSignal(TypedDict):
    """A signal that was not found, why, and what that costs the diagnosis."""

    name: str
    reason: str
    cost: str


class ForecastPart(TypedDict):
    """What the signals can tell of one side of some parts, and what to log to be told more."""

    components: list[str]
    side: str
    told: bool
    words: str
    log: list[str]


class SignalsDocument(TypedDict):
    """What `mfhca channels --json` prints."""

    machine: MachinePart
    files: list[FilePart]
    signals: list[MappedSignal]
    missing: list[MissingSignal]
    forecast: list[ForecastPart]
    notes: list[str]
    questions: list[str]


def signals_document(files: Sequence[MissionFile], signals: Signals, machine: Machine, source: str) -> SignalsDocument:
    """Mapped and missing signals as JSON values."""
    words = machine_words(machine, signals.items)
    return {
        "machine": {"name": machine.name, "source": source, "wheels": list(machine.wheels)},
        "files": [
            {
                "path": str(f.path),
                "sha256": f.sha256,
                "bytes": f.bytes,
                "format": f.format,
                "notes": list(f.summary.notes),
                "damage": list(f.summary.damage),
            }
            for f in files
        ],
        "signals": [_signal(s, words) for s in signals.items.values()],
        "missing": [
            {"name": name, "reason": reason, "cost": cost_of_missing(name, words, signals.items, machine.wheels)}
            for name, reason in signals.missing.items()
            if applies(name, words)
        ],
        "forecast": [
            {"components": list(f.components), "side": f.side, "told": f.told, "words": f.words, "log": list(f.log)}
            for f in forecast(signals.items, machine, words)
        ],
        "notes": list(signals.notes),
        "questions": list(signals.questions),
    }


def _signal(signal: Signal, words: MachineWords) -> MappedSignal:
    finite = signal.values[np.isfinite(signal.values)]
    period, unit = median_period(signal.stamps), kept_unit(signal.name, signal.origin.unit)
    return {
        "name": signal.name,
        "channel": signal.origin.label,
        "recorded_unit": signal.origin.unit or None,
        "unit": words.unit(unit) if signal.name.startswith("wheel.") else unit,
        "guessed": signal.guessed,
        "source": signal.source,
        "samples": int(signal.stamps.size),
        "without_value": int(signal.stamps.size - finite.size),
        "rate_hz": 1e9 / period if period else None,
        "min": float(finite.min()) if finite.size else None,
        "max": float(finite.max()) if finite.size else None,
    }


_LIST_ALL = (
    "`mfhca channels LOG --all` lists what the log holds; name its signals in [signals] of a machine file, which "
    "`mfhca config init --log LOG` drafts with what it finds likely."
)
_CHANNEL = re.compile(r"'[^']*'|\"[^\"]*\"|/\S+|; similar: .*")  # of a reason: what differs from part to part
_LIKEWISE = "; the others likewise"
_OF_ANOTHER = (" times max_speed ", "max_steer is", "in step with cmd.v")  # compare with the paper's machine
_STANDS_IN = (
    "no machine file was given: ranges of rotations are shown with the wheels of {} ({:.3g} m); "
    "`mfhca config init --log LOG` writes one from the log"
)
_NO_WHEEL = (
    "no machine file was given: {} stands in, and no signal of its wheels is in the log; `mfhca config init --log LOG` writes a machine file "
    "from the log"
)
_NAMED = (
    "no machine file was given: the wheels are those that the log names, and ranges of rotations are shown with wheels of {:.3g} m; "
    "`mfhca config init --log LOG` writes a machine file from the log"
)


def signals_parts(
    signals: Signals, machine: Machine, given: bool = True, doubted: bool = False
) -> list[RenderableType]:
    """Mapped signals, missing ones with their cost, and doubts, for the terminal.

    `given`: whether there is a machine file; `doubted`: whether the unit of the openings is in doubt.
    """
    words = machine_words(machine, signals.items)
    parts: list[RenderableType] = [
        text("No signal of the machine was found.", "bold"),
        text(_LIST_ALL, "dim"),
    ]
    if signals.items:
        several = len({s.source for s in signals.items.values()}) > 1
        rows = [_row(s, several, words) for s in signals.items.values()]
        wide = table(("signal", "channel", "unit", "Hz", "range"), rows, right=(3,))
        needs = sum(max(len(row[k]) for row in rows) + 2 for k in range(5))
        parts = [ByWidth(wide, _two_lines(rows), needs)]
    if signals.questions:
        parts += [section("To be answered before anything is judged"), bullets(signals.questions, "red")]
    if signals.missing:
        lines = [(name, _cost(cost, reason)) for name, cost, reason in _missing_groups(signals, machine, words)]
        parts += [section("Missing signals and their effect"), table(("signal", "effect"), lines)]
    told = forecast(signals.items, machine, words, doubted=doubted)
    if signals.items and told:
        by_part = [(_part(f, words), f.words, "\n".join(f.log)) for f in told]
        parts += [
            section("What can be told with these signals"),
            table(("part", "what shows", "log to tell more"), by_part),
        ]
    notes = [n for n in signals.notes if _is_doubt(n)]
    if not given:
        notes = [n for n in notes if not any(words in n for words in _OF_ANOTHER)]
        notes.insert(0, _not_given(machine, any(n.startswith("wheel.") for n in signals.items)))
    if notes:
        parts += [section("Notes"), bullets(notes)]
    return parts


def _not_given(machine: Machine, wheels: bool) -> str:
    """That no machine file was given, and what stands in; `wheels`: whether the log has signals of wheels."""
    if not wheels:
        return _NO_WHEEL.format(machine.name)
    size = 2 * (machine.wheel_radius or 0.0)
    return _STANDS_IN.format(machine.name, size) if machine.assumed else _NAMED.format(size)


def _two_lines(rows: Sequence[tuple[str, str, str, str, str]]) -> RenderableType:
    """Two lines for each signal: what it is and holds, and below it the whole name of its channel."""
    heads = ("signal", "unit", "Hz", "range")
    cells = [(name, unit, rate, span) for name, _, unit, rate, span in rows]
    widths = [max(len(c) for c in column) for column in zip(heads, *cells, strict=True)]

    def line(parts: Sequence[str]) -> str:
        aligned = [p.rjust(w) if k == 2 else p.ljust(w) for k, (p, w) in enumerate(zip(parts, widths, strict=True))]
        return "  ".join(aligned).rstrip()

    out = [Text(line(heads), style="dim")]
    for cell, (_, channel, *_) in zip(cells, rows, strict=True):
        out += [text(line(cell)), text(f"  {channel}", "dim")]
    return whole_lines(out)


def _row(signal: Signal, several: bool, words: MachineWords) -> tuple[str, str, str, str, str]:
    """Signal, channel with its file where there are several, recorded unit, rate, range in SI."""
    d = _signal(signal, words)
    span = (
        "no number"
        if d["min"] is None or d["max"] is None
        else f"{range_text(d['min'], d['max'], 4)} {d['unit'].replace('1', '')}"
    )
    how = (f"  in {PurePath(signal.source).name}" if several else "") + ("" if signal.guessed else "  (given)")
    rate = f"{d['rate_hz']:.4g}" if d["rate_hz"] else "–"
    return d["name"], d["channel"] + how, d["recorded_unit"] or d["unit"], rate, span.strip()


def _part(f: Forecast, words: MachineWords) -> str:
    return f"{', '.join(f.components)} {words.part_name(f.kind, f.side)}"


def _cost(cost: str, reason: str) -> Text:
    return text(cost) if reason == NO_CHANNEL else Text.assemble(text(cost), "\n", text(reason, "dim"))


def _is_doubt(note: str) -> bool:
    """Whether a note says more than the table of signals does."""
    return " is taken from " not in note or "would fit as well" in note or "not stated" in note


def _missing_groups(signals: Signals, machine: Machine, words: MachineWords) -> list[tuple[str, str, str]]:
    """Missing signals of equal cost, and of a reason that is equal but for names of channels, in one line each: names, cost, reason."""
    groups: dict[tuple[str, str, str], dict[str, list[str]]] = {}
    first: dict[tuple[str, str, str], str] = {}
    for name, reason in signals.missing.items():
        if not applies(name, words):
            continue
        group, _, rest = name.partition(".")
        part, _, leaf = rest.rpartition(".")
        key = group, cost_of_missing(name, words, signals.items, machine.wheels), _CHANNEL.sub("…", reason)
        leaves = groups.setdefault(key, {})
        leaves.setdefault(leaf, []).append(part)
        if first.setdefault(key, reason) != reason and not first[key].endswith(_LIKEWISE):
            first[key] += _LIKEWISE
    out = []
    every = {"wheel": machine.wheels, "steer": machine.axles}
    for key, leaves in groups.items():
        group, cost, reason = key[0], key[1], first[key]
        parts = next(iter(leaves.values()))
        if any(p != parts for p in leaves.values()):
            out += [(f"{group}.{p}.{leaf}", cost, reason) for leaf, named in leaves.items() for p in named]
            continue
        shown = "*" if tuple(parts) == every.get(group) and len(parts) > 1 else _listed(parts)
        out.append((".".join(x for x in (group, shown, _listed(list(leaves))) if x), cost, reason))
    return out


def _listed(names: Sequence[str]) -> str:
    """``FR`` or ``{FR,FL}``."""
    return names[0] if len(names) == 1 else "{" + ",".join(names) + "}"
