"""A fit as a JSON document and as a commented machine file."""

from __future__ import annotations

import dataclasses
from typing import Any

from diagnosis.fitting.machine import Constant
from diagnosis.fitting.missions import FitResult
from replay.machine.toml_text import dump_machine

SCHEMA = "mfhca-fit/1"


def number(value: float | None) -> str:
    """Four digits; a dash where there is none."""
    return "–" if value is None else f"{value:.4g}"


def stated(c: Constant) -> str:
    """Value with its standard deviation."""
    if c.value is None:
        return "–"
    return number(c.value) if c.std is None else f"{number(c.value)} ± {c.std:.2g}"


def remark(c: Constant) -> str:
    """Whether the constant is in the new machine, and why not or how to read it."""
    if c.written:
        return c.why
    kept = "not given" if c.before is None else "unchanged"
    return f"{kept}: {c.why}" if c.value is not None else f"{kept}; not identifiable: {c.why}"


def fit_document(result: FitResult) -> dict[str, Any]:
    """JSON document of a fit."""
    return {
        "schema": SCHEMA,
        "machine": result.machine.name,
        "missions": list(result.missions),
        "seconds": result.seconds,
        "driving_s": result.driving,
        "constants": [dataclasses.asdict(c) for c in result.constants],
        "unit_errors": [dataclasses.asdict(e) for e in result.unit_errors],
        "left_out": list(result.left_out),
        "notes": list(result.notes),
    }


def fit_toml(result: FitResult) -> str:
    """Machine file with the fitted constants; comments tell where they come from."""
    count = len(result.missions)
    head = [
        f"Constants by `mfhca fit` from {count} healthy mission{'' if count == 1 else 's'}: {result.seconds:.0f} s, "
        f"{result.driving:.0f} s of them driving.",
        *(f"  {name}" for name in result.missions),
        *(f"UNIT ERROR: {e.text}. Constants that rest on it are not written." for e in result.unit_errors),
        *(f"Left out: {text}" for text in result.left_out),
    ]
    notes: dict[str, list[str]] = {"": head}
    for c in result.constants:
        section = c.key.partition(".")[0]
        behind = f"{c.windows} windows, {c.missions} missions" if c.windows else f"{c.missions} missions"
        text = f"{c.key} = {stated(c)} {c.unit} ({behind})" if c.written else f"{c.key}: {remark(c)}"
        notes.setdefault(section, []).append(f"{text}; {c.why}" if c.written and c.why else text)
    notes.setdefault("control", []).extend(result.notes)
    return dump_machine(result.machine, notes)
