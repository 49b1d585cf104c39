"""Words, symbols and number formats of the report page; names from logs are made visible and inert here."""

from __future__ import annotations

import datetime
import unicodedata
from collections.abc import Mapping
from typing import Any

from replay.faults import FaultMode, State

#: Modes and states with a symbol of their own; anything else is drawn as `outside_table`.
FAULT_MODES = tuple(m.value for m in FaultMode)
UNDECIDED = (
    State.NOT_EXCITED.value,
    State.MASKED.value,
    State.SLIP.value,
    State.NO_DATA.value,
    State.NOT_ASSESSED.value,
)

_STATE_LABELS = {
    "healthy": "Healthy",
    "stuck": "Stuck",
    "no_signal": "No signal",
    "inefficient": "Inefficient",
    "noisy": "Noisy",
    "outside_table": "Outside the tables",
    "not_excited": "Not excited",
    "masked": "Masked by another fault",
    "slip": "Wheel slip",
    "no_data": "No data",
    "not_assessed": "Not assessed",
}
_PARTS = {
    ("wheel", "sensor"): "speed sensor",
    ("wheel", "actuator"): "drive valve",
    ("wheel", "sensor_or_actuator"): "speed sensor or drive valve",
    ("steer", "sensor"): "steering-angle sensor",
    ("steer", "actuator"): "steering valve",
    ("steer", "sensor_or_actuator"): "steering-angle sensor or valve",
}
VERDICTS = {
    "ready": ("healthy", "Ready for the next mission"),
    "watch": ("inefficient", "Watch"),
    "stop": ("stuck", "Stop and repair"),
    "not_assessed": ("not_assessed", "Not assessed"),
}


def visible(text: str) -> str:
    r"""Text with control, bidirectional and other invisible characters spelt out (``\u202e``), all else verbatim."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        c if c == " " or unicodedata.category(c) not in {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"} else _spelt(c)
        for c in text
    )


def _spelt(char: str) -> str:
    code = ord(char)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def made_visible(value: Any) -> Any:
    """Copy of a JSON value with `visible` applied to every string and key."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, Mapping):
        return {visible(str(k)): made_visible(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [made_visible(v) for v in value]
    return value


def known(state: str) -> str:
    """Class name of a mode or state; unknown words become ``outside_table``."""
    return state if state in _STATE_LABELS else "outside_table"


def state_label(state: str, side: str = "") -> str:
    """Words for a mode or state; a noisy actuator is disturbed."""
    if state == "noisy" and side == "actuator":
        return "Disturbed"
    return _STATE_LABELS.get(state, state)


def part(kind: str, side: str) -> str:
    """Words for the part of a component on one side, such as *speed sensor*."""
    return _PARTS.get((kind, side), side.replace("_", " "))


def clock(seconds: float, digits: int = 0) -> str:
    """Mission time as ``m:ss`` or ``h:mm:ss``, with decimals where asked for."""
    ticks = round(seconds * 10**digits)
    whole, rest = divmod(abs(ticks), 10**digits)
    minutes, s = divmod(whole, 60)
    hours, m = divmod(minutes, 60)
    text = f"{hours}:{m:02d}:{s:02d}" if hours else f"{m}:{s:02d}"
    return ("−" if ticks < 0 else "") + text + (f".{rest:0{digits}d}" if digits else "")


def span(seconds: float) -> str:
    """Length of time with a unit that suits it."""
    if seconds < 1:
        return f"{seconds * 1e3:.0f} ms"
    if seconds < 120:
        return f"{seconds:.1f} s"
    if seconds < 7200:
        return f"{seconds / 60:.1f} min"
    return f"{seconds / 3600:.1f} h"


def number(value: Any, digits: int = 3) -> str:
    """Value in significant digits without an exponent where it can be avoided; an en dash where there is none."""
    if not isinstance(value, int | float) or isinstance(value, bool) or value != value:
        return "–"
    if isinstance(value, int):
        return grouped(value)
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
        text = grouped(round(value)) if abs(value) >= 1000 else f"{value:.6f}".rstrip("0")
    return text.replace("-", "−")


def bounded(epsilon: Mapping[str, Any], digits: int = 3) -> str:
    """An estimate with its 95 % bounds."""
    value, low, high = (
        f"{round(epsilon[k], digits) + 0.0:.{digits}f}".replace("-", "−") for k in ("value", "low", "high")
    )
    return f"{value} ({low} to {high})"


def grouped(value: int) -> str:
    """Integer with thin spaces between thousands."""
    return f"{value:,}".replace(",", "\u202f").replace("-", "−")


def utc(start_ns: Any) -> str:
    """Nanoseconds since 1970 as a date and time in UTC."""
    try:
        moment = datetime.datetime.fromtimestamp(int(start_ns) // 10**9, tz=datetime.UTC)
    except (TypeError, ValueError, OverflowError, OSError):
        return "unknown"
    return moment.strftime("%Y-%m-%d %H:%M:%S")


def sat_text(mean: float, unit: str) -> str:
    """Saturation value with its unit; angles in degrees."""
    if unit == "rad":
        return f"{number(mean * 57.29577951308232)}°"
    return f"{number(mean)}{'' if unit in {'', '1', 'fraction'} else ' ' + unit}"


def fault_title(fault: Mapping[str, Any]) -> str:
    """One line that names component, part, mode and size of a fault."""
    kind, side, mode = fault["kind"], fault["side"], fault["mode"]
    what = f"{fault['component']} {part(kind, side)}"
    sat, epsilon = fault.get("sat"), fault.get("epsilon")
    words = state_label(mode, side).lower()
    if mode == "stuck" and sat:
        return f"{what} stuck at {sat_text(sat['mean'], sat.get('unit', ''))}"
    if mode == "no_signal":
        return f"{what}: no {'control ' if side == 'actuator' else ''}signal"
    if mode == "inefficient" and epsilon:
        return f"{what} inefficient, {100 * epsilon['value']:.0f} % lost"
    if mode == "noisy" and sat:
        return f"{what} {words}, {sat_text(sat['rms'], sat.get('unit', ''))} r.m.s."
    return f"{what} {words}"
