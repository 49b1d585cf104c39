"""Colours of fault modes and states as CSS: variables and the rules that every mode has, written from the table.

A row that is added to `diagnosis.results.fault_rows` is visible on all pages without a rule of its own. Patterns, and colours
of lines or letters that the contrast asks for, stand in ``style.css``, which follows these rules and may override them.
"""

from __future__ import annotations

from collections.abc import Iterable

from diagnosis.results.fault_rows import LOOKS
from replay.faults import FaultMode

_LIGHT_LETTERS, _BLACK, _DARK_PAGE = "#fff", "#000", "#0b0f14"
_RULES = (
    (".ic.{m}", "background: var(--{m}); color: var(--on-{m}); box-shadow: none;"),
    (".tyre.{m}, .axle.{m}", "stroke: var(--{m});"),
    (".bg.{m} > rect", "fill: var(--{m}); stroke: none;"),
    (".bg.{m} .gl", "color: var(--on-{m});"),
    (".ln.{m}", "stroke: var(--{m}); stroke-width: 12;"),
    (".fb.{m}", "background: var(--{m}); color: var(--on-{m});"),
    (".spark rect.{m}, .panel .f.{m}", "fill: var(--{m});"),
    (".conf .{m}, .stack .{m}", "background: var(--{m});"),
    (".leg.{m}", "stroke: var(--{m});"),
    (".mark.{m} .ring, .panel .mk.{m}", "stroke: var(--{m}-line);"),
)


def mode_style() -> str:
    """CSS of all modes: ``--stuck`` is a mode's colour, ``--stuck-line`` of thin lines, ``--on-stuck`` of letters on it."""
    light = " ".join(_variables(state, look.light, _BLACK) for state, look in LOOKS.items() if look.light)
    dark = " ".join(_variables(state, look.dark, _DARK_PAGE) for state, look in LOOKS.items() if look.dark)
    return f":root {{ {light} }}\n[data-theme=dark] {{ {dark} }}\n" + mode_rules(_RULES)


def mode_rules(rules: Iterable[tuple[str, str]]) -> str:
    """CSS rules, selector and body, for every mode: ``{m}`` stands for its name."""
    lines = [f"{selector} {{ {body} }}\n".replace("{m}", m) for m in FaultMode for selector, body in rules]
    return "".join(lines)


def _variables(state: str, colour: str, dark_letters: str) -> str:
    letters = max((_LIGHT_LETTERS, dark_letters), key=lambda c: contrast(colour, c))
    return f"--{state}: {colour}; --{state}-line: {colour}; --on-{state}: {letters};"


def contrast(a: str, b: str) -> float:
    """Contrast of two colours ``#rgb`` or ``#rrggbb``, 1 to 21 (WCAG 2.2). A ratio, without a unit [1]."""
    low, high = sorted((_luminance(a), _luminance(b)))
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: str) -> float:
    """Relative luminance of a colour, 0 to 1 (WCAG 2.2)."""
    digits = colour[1:] if len(colour) == 7 else "".join(2 * c for c in colour[1:])
    parts = [int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
