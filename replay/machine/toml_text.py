"""Write machine files (TOML)."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import Machine
from replay.machine.drive_model import drive_table
from replay.machine.effort_model import effort_table
from replay.machine.geometry import own_axle
from replay.machine.toml_file import MACHINE_LEVEL


def signal_line(name: str, source: SignalSource) -> str:
    """Line of [signals] that `load_machine` reads back."""
    return f"{text_of(name)} = {{ {', '.join(_table(source))} }}"


def source_line(pattern: str, options: SourceOptions) -> str:
    """Line of [sources] with what differs from the defaults."""
    given = [f for f in dataclasses.fields(options) if getattr(options, f.name) != f.default]
    values = {f.name: getattr(options, f.name) for f in given}
    parts = [f"{k} = {v if isinstance(v, float) else text_of(str(v))}" for k, v in values.items()]
    return f"{text_of(pattern)} = {{ {', '.join(parts)} }}"


def dump_machine(machine: Machine, notes: Mapping[str, Sequence[str]] | None = None) -> str:
    """Write every setting of a machine as TOML that `load_machine` reads back.

    Parameters
    ----------
    machine : Machine
        The settings.
    notes : Mapping[str, Sequence[str]] or None
        Comment lines by section; those of "" stand at the top.
    """
    said = {section: _comments(lines) for section, lines in (notes or {}).items()}

    def head(section: str) -> list[str]:
        return [f"[{section}]", *said.get(section, [])]

    lines = [*said.get("", []), *head("machine"), f"name = {text_of(machine.name)}", f"id = {text_of(machine.id)}"]
    lines += [f"wheels = [{', '.join(text_of(w) for w in machine.wheels)}]", *_kind(machine), "", *head("geometry")]
    lines += [f"{key} = {real_text(getattr(machine, key))}" for key in MACHINE_LEVEL]
    if machine.geometry is not None:
        lines.append(f"wheel_diameter = {real_text(machine.geometry.wheel_diameter)}")
        for w, g in machine.geometry.wheels.items():
            steer = "own" if g.axle == own_axle(w) else g.axle
            place = (
                f"x = {real_text(g.x)}, y = {real_text(g.y)}, offset = {real_text(g.offset)}, steer = {text_of(steer)}"
            )
            lines.append(f"{key_text(w)} = {{ {place} }}")
    lines += ["", *head("control"), *_table(machine.control, {"lambda_": "lambda"})]
    lines += ["", *head("plant"), f"coupling = {text_of(machine.plant.coupling)}"]
    if machine.plant.flow is not None:
        lines.append(f"flow = {real_text(machine.plant.flow)}")
    lines += [f"{key_text(w)} = {{ {', '.join(_table(p))} }}" for w, p in machine.plant.wheels.items()]
    if machine.drives or "drive" in said:
        lines += [
            "",
            *head("drive"),
            *(f"{key_text(w)} = {_inline(drive_table(d))}" for w, d in machine.drives.items()),
        ]
    if machine.efforts or "effort" in said:
        lines += [
            "",
            *head("effort"),
            *(f"{key_text(w)} = {_inline(effort_table(e))}" for w, e in machine.efforts.items()),
        ]
    if machine.steering or "steering" in said:
        lines += ["", *head("steering")]
        lines += [f"{key_text(a)} = {{ {', '.join(_table(p))} }}" for a, p in machine.steering.items()]
    lines += ["", *head("limits"), *_table(machine.limits)]
    for section, items in (("noise", machine.noise), ("sources", machine.sources), ("signals", machine.signals)):
        lines += ["", *head(section), *(f"{key_text(k)} = {{ {', '.join(_table(v))} }}" for k, v in items.items())]
    if machine.advice:
        lines += ["", *head("advice"), *(f"{text_of(k)} = {text_of(v)}" for k, v in machine.advice.items())]
    return "\n".join(lines) + "\n"


def _kind(machine: Machine) -> list[str]:
    """What moves the machine, where that is not what a machine file without these lines means."""
    usual = {"drive": "auto", "part": "wheel", "speed_unit": "m/s" if machine.part == "wheel" else ""}
    given = {key: getattr(machine, key) for key in usual}
    lines = [f"unpowered = [{', '.join(text_of(w) for w in machine.unpowered)}]"] if machine.unpowered else []
    return lines + [f"{key} = {text_of(value)}" for key, value in given.items() if value != usual[key]]


def _comments(lines: Sequence[str]) -> list[str]:
    """Comment lines; what TOML forbids in comments becomes a space."""
    return ["# " + "".join(c if c >= " " and c != "\x7f" else " " for c in line) for line in lines]


def _table(item: Any, rename: Mapping[str, str] | None = None) -> list[str]:
    out = []
    for f in dataclasses.fields(item):
        value, default = getattr(item, f.name), f.default
        if (
            value is None
            or (isinstance(value, tuple) and not value)
            or (isinstance(item, SignalSource) and value == default)
        ):
            continue
        if isinstance(value, tuple):
            text = _inline(list(value))
        else:
            text = (
                text_of(value)
                if isinstance(value, str)
                else str(value).lower()
                if isinstance(value, bool)
                else real_text(value)
            )
        out.append(f"{(rename or {}).get(f.name, f.name)} = {text}")
    return out


def _inline(value: Any) -> str:
    """Nested tables and lists of numbers on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key_text(k)} = {_inline(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_inline(v) for v in value) + "]"
    return str(value) if isinstance(value, int) else real_text(value)


def real_text(value: float) -> str:
    """A number that reads back as it is. In the unit of the key."""
    return repr(float(value))


def text_of(value: str) -> str:
    """Text in quotes."""
    out = value.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c >= " " and c != "\x7f" else f"\\u{ord(c):04X}" for c in out) + '"'


def key_text(name: str) -> str:
    """A key, in quotes where it must be."""
    return name if name.isascii() and name.replace("_", "").replace("-", "").isalnum() else text_of(name)
