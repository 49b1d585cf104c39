"""A draft of a machine as a commented machine file."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

import numpy as np

from replay.machine.config import Machine, haulotte
from replay.machine.geometry import own_axle
from replay.machine.toml_text import key_text, real_text, signal_line, source_line, text_of
from replay.machine.units import kept_unit
from replay.setup.all_channels import ChannelRow
from replay.setup.draft_notes import Draft
from replay.setup.offered import offered_line
from replay.setup.ranges import range_text
from replay.signals.signal import Signal
from replay.signals.timeline import median_period

_WIDTH = 110
_LISTED = 60


def machine_text(draft: Draft, logs: str, rows: Sequence[ChannelRow] = ()) -> str:
    """Machine file of a draft, with where each number comes from, the open questions, and the channels that are not used.

    Parameters
    ----------
    draft : Draft
        The machine.
    logs : str
        What it was drafted from, in words.
    rows : Sequence[ChannelRow]
        Every channel of the logs.
    """
    machine = draft.machine
    lines = [
        *_comment(f"Machine file of mfhca, from {logs}."),
        *_comment("What is marked QUESTION the log does not tell: check it. `mfhca config init` explains every key."),
        "",
        "[machine]",
        *_said(draft, "machine"),
        f"name = {text_of(machine.name)}",
        f"wheels = [{', '.join(text_of(w) for w in machine.wheels)}]",
        *([f"# unpowered = [{', '.join(text_of(w) for w in draft.unpowered)}]"] if draft.unpowered else []),
        "",
        "[geometry]",
        *_said(draft, "geometry"),
        *_geometry(machine),
        "",
        "[control]",
        *_control(machine),
    ]
    if machine.sources or draft.notes.get("sources"):
        lines += ["", "[sources]", *_said(draft, "sources"), *(source_line(k, v) for k, v in machine.sources.items())]
    lines += ["", "[signals]", *_said(draft, "signals")]
    for name, origin in machine.signals.items():
        found = draft.signals.items.get(name)
        lines.append(f"{signal_line(name, origin)}{'' if found is None else f'  # {_holds(found)}'}")
    return "\n".join([*lines, *_unused(machine, rows)]) + "\n"


def _said(draft: Draft, section: str) -> list[str]:
    return [line for text in draft.notes.get(section, []) for line in _comment(text)]


def _comment(text: str) -> list[str]:
    clean = "".join(c if c >= " " and c != "\x7f" else " " for c in text)
    return textwrap.wrap(clean, _WIDTH, initial_indent="# ", subsequent_indent="#   ", break_long_words=False)


def _geometry(machine: Machine) -> Iterable[str]:
    if machine.gear_ratio != 1.0 or any(s.at == "motor" for s in machine.signals.values()):
        yield f"gear_ratio = {real_text(machine.gear_ratio)}"
    yield f"max_speed = {real_text(machine.max_speed)}  # m/s, at the rim"
    if machine.axles:
        yield f"max_steer = {real_text(round(machine.max_steer, 6))}  # rad"
    if machine.geometry is None:
        return
    yield f"wheel_diameter = {real_text(round(machine.geometry.wheel_diameter, 6))}  # m"
    yield "# x forward, y to the left, offset from the steering joint to the wheel [m]; steer: front, rear, own or fixed"
    for w, g in machine.geometry.wheels.items():
        offset = f"offset = {real_text(g.offset)}, " if g.offset else ""
        steer = "own" if g.axle == own_axle(w) else g.axle
        yield f"{key_text(w)} = {{ x = {real_text(g.x)}, y = {real_text(g.y)}, {offset}steer = {text_of(steer)} }}"


def _control(machine: Machine) -> list[str]:
    if machine.control.law == "none":
        return ['law = "none"  # another controller than the paper\'s']
    lines = [f"law = {text_of(machine.control.law)}"]
    if machine.geometry == haulotte().geometry:
        c = machine.control
        lines += [f"xi = {real_text(c.xi)}", f"beta = {real_text(c.beta)}", f"k_ps = {real_text(c.k_ps)}"]
    if machine.plant.flow is not None:
        lines += ["", "[plant]", f"flow = {real_text(machine.plant.flow)}  # m/s over all wheels"]
    return lines


def _holds(signal: Signal) -> str:
    """Rate and range in SI."""
    period, known = median_period(signal.stamps), signal.values[np.isfinite(signal.values)]
    rate = f"{1e9 / period:.4g} Hz" if period > 0 else "one sample"
    unit = kept_unit(signal.name, signal.origin.unit).replace("1", "")
    return f"{rate}, {range_text(known.min(), known.max(), 3)} {unit}".rstrip() if len(known) else f"{rate}, no number"


def _unused(machine: Machine, rows: Sequence[ChannelRow]) -> list[str]:
    """Channels that no signal is taken from, as comments."""
    used = {s.label for s in machine.signals.values()}
    heading = "pose.pose.orientation"
    rest = [r for r in rows if r.name not in used and f"{r.topic}.{heading}" not in used]
    rest = [r for r in rest if r.low != r.high and "covariance" not in r.field]
    if not rest:
        return []
    out = ["", "# Also in the log, and not used (`mfhca channels LOG --all` has rates and more):"]
    for r in rest[:_LISTED]:
        offered = offered_line(machine, r)
        could = f"; could be {', '.join(r.could_be)}" if r.could_be else ""
        unit = f" {r.unit}{'?' if r.guessed else ''}" if r.unit else ""
        where = f"topic = {text_of(r.topic)}, field = {text_of(r.field)}" if r.topic else f"column = {text_of(r.name)}"
        out.append(f"#   {where}   {r.low:.4g} … {r.high:.4g}{unit}{could}")
        out += [f"#     if it is so: {offered}"] if offered else []
    return out + ([f"#   and {len(rest) - _LISTED} more"] if len(rest) > _LISTED else [])
