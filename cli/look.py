"""`mfhca inspect` and `mfhca channels`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.app import command
from cli.console import Terminal
from cli.inputs import find_logs, machine_of, mission_paths
from cli.options import Json, Logs, MachineFile

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

    from replay.machine import Machine
    from replay.mission import MissionFile
    from replay.signals import Signal, Signals

INSPECT_EXAMPLES = """\b
Examples:
  mfhca inspect mission.mcap
  mfhca inspect logs/ "archive/**/*.bag" --json
  find . -name "*.mcap" | mfhca inspect -"""
CHANNELS_EXAMPLES = """\b
Examples:
  mfhca channels mission.mcap
  mfhca channels drive.bag plc-export.csv -m machine.toml"""

NOT_FOUND = "no channel fits by its name or message type"
_UNREADABLE = 3


@command
def inspect(
    terminal: Terminal,
    paths: Annotated[
        list[str],
        typer.Argument(metavar="PATH...", help="Files, folders, globs; - reads paths from stdin.", show_default=False),
    ],
    machine: MachineFile = None,
    json: Json = False,
) -> None:
    """Show what logs hold: topics, types, counts, rates, gaps, clocks, damage."""
    from cli.listing import inspect_document, inspect_parts
    from replay.errors import LogError, MfhcaError
    from replay.inspect import inspect_log
    from replay.mission import source_options

    the_machine, _ = machine_of(machine)
    found = find_logs(paths)
    failures = list(found.missing)
    documents: list[dict[str, Any]] = []
    for line in found.missing:
        terminal.error(line)
    for path in found.paths:
        try:
            with terminal.progress(f"reading {path}"):
                seen = inspect_log(path, source_options(path, the_machine))
        except (MfhcaError, OSError) as error:
            text = str(error) if isinstance(error, LogError) else f"{path}: {error}"
            failures.append(text)
            terminal.error(text)
            continue
        if json:
            documents.append(inspect_document(seen))
        else:
            terminal.show(*inspect_parts(seen), "")
    if found.left_aside:
        terminal.note(f"{found.left_aside} other files in the folders are no logs by their names")
    if json:
        terminal.show_json({"logs": documents, "errors": failures})
    if failures:
        raise typer.Exit(_UNREADABLE)


@command
def channels(terminal: Terminal, logs: Logs, machine: MachineFile = None, json: Json = False) -> None:
    """Show where each signal was found, what is missing, and what that costs the diagnosis."""
    paths = mission_paths(logs)
    the_machine, source = machine_of(machine)
    with terminal.progress("starting") as progress:
        from replay.mission import read_signals

        files, signals = read_signals(paths, the_machine, progress=progress)
    if json:
        terminal.show_json(signals_document(files, signals, the_machine, source))
        return
    from cli.tables import bullets, section

    terminal.show(*signals_parts(signals, the_machine))
    damage = [line for file in files for line in file.summary.damage]
    if damage:
        terminal.show(section("Damage"), bullets(damage))


def signals_document(files: Sequence[MissionFile], signals: Signals, machine: Machine, source: str) -> dict[str, Any]:
    """Mapped and missing signals as JSON values."""
    from diagnosis.costs import cost_of_missing

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
        "signals": [_signal(s) for s in signals.items.values()],
        "missing": [
            {"name": name, "reason": reason, "cost": cost_of_missing(name)} for name, reason in signals.missing.items()
        ],
        "notes": list(signals.notes),
    }


def _signal(signal: Signal) -> dict[str, Any]:
    import numpy as np

    from replay.timeline import median_period

    finite = signal.values[np.isfinite(signal.values)]
    period = median_period(signal.stamps)
    return {
        "name": signal.name,
        "channel": signal.origin.label,
        "recorded_unit": signal.origin.unit or None,
        "unit": si_unit(signal.name),
        "guessed": signal.guessed,
        "source": signal.source,
        "samples": int(signal.stamps.size),
        "without_value": int(signal.stamps.size - finite.size),
        "rate_hz": 1e9 / period if period else None,
        "min": float(finite.min()) if finite.size else None,
        "max": float(finite.max()) if finite.size else None,
    }


def si_unit(name: str) -> str:
    """SI unit of a canonical signal."""
    from replay.units import quantity_of

    units = {"speed": "m/s", "rotation": "rad/s", "angle": "rad", "length": "m", "fraction": "1", "pressure": "Pa"}
    return units.get(quantity_of(name), "deg" if quantity_of(name) == "position_deg" else "m/s^2")


def signals_parts(signals: Signals, machine: Machine) -> list[RenderableType]:
    """Mapped signals, missing ones with their cost, and doubts, for the terminal."""
    from rich.text import Text

    from cli.tables import bullets, section, table, text

    rows = []
    for signal in signals.items.values():
        d = _signal(signal)
        span = "no number" if d["min"] is None else f"{d['min']:.4g} … {d['max']:.4g} {d['unit'].replace('1', '')}"
        rows.append(
            (
                d["name"],
                Text("found" if signal.guessed else "given", style="dim" if signal.guessed else ""),
                d["channel"],
                d["recorded_unit"] or text("SI", "dim"),
                f"{d['rate_hz']:.4g}" if d["rate_hz"] else "–",
                span.strip(),
            )
        )
    parts: list[RenderableType] = []
    if rows:
        parts.append(table(("signal", "how", "channel", "unit", "Hz", "range"), rows, right=(4,)))
    else:
        parts.append(text("No signal of the machine was found.", "bold"))
    if signals.missing:
        lines = [(name, _cost(cost, reason)) for name, cost, reason in _missing_groups(signals.missing, machine)]
        parts += [section("Missing, and what it costs"), table(("signal", "cost"), lines)]
    notes = [n for n in signals.notes if _is_doubt(n)]
    if notes:
        parts += [section("Notes"), bullets(notes)]
    return parts


def _cost(cost: str, reason: str) -> Text:
    from rich.text import Text

    from cli.tables import text

    return text(cost) if reason == NOT_FOUND else Text.assemble(text(cost), "\n", text(reason, "dim"))


def _is_doubt(note: str) -> bool:
    """Whether a note says more than the table of signals does."""
    return " is taken from " not in note or "would fit as well" in note or "not stated" in note


def _missing_groups(missing: Mapping[str, str], machine: Machine) -> list[tuple[str, str, str]]:
    """Missing signals of equal cost and reason in one line each: names, cost, reason."""
    from diagnosis.costs import cost_of_missing

    groups: dict[tuple[str, str, str], dict[str, list[str]]] = {}
    for name, reason in missing.items():
        group, _, rest = name.partition(".")
        part, _, leaf = rest.rpartition(".")
        leaves = groups.setdefault((group, cost_of_missing(name), reason), {})
        leaves.setdefault(leaf, []).append(part)
    out = []
    every = {"wheel": machine.wheels, "steer": machine.axles}
    for (group, cost, reason), leaves in groups.items():
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
