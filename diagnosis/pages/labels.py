"""Texts of the pages: numbers, times, names from logs made visible and inert, and titles of faults."""

from __future__ import annotations

import datetime
import math
import unicodedata
from collections.abc import Mapping
from enum import Enum
from string import Formatter
from typing import Any, TypeVar, cast

from markupsafe import Markup

from diagnosis.results.candidates import candidates_of, unclear_words
from diagnosis.results.document import IntervalRow
from diagnosis.results.durations import seconds_words
from diagnosis.results.fault_rows import LOOKS, row_of, state_label
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.size_rows import EpsilonRow
from diagnosis.results.sizes import gain_words, loss_known
from replay.faults import FaultMode, Side
from replay.machine.quantities import OPENING

T = TypeVar("T")


def visible(text: str) -> str:
    r"""Text with control, bidirectional and other invisible characters escaped (``\u202e``), all else verbatim."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        c if c == " " or unicodedata.category(c) not in {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"} else _escaped(c)
        for c in text
    )


def _escaped(char: str) -> str:
    code = ord(char)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def made_visible(value: T) -> T:
    """Copy of a JSON value with `visible` applied to every string and key; members of enumerations stay what they are."""
    return cast(T, _made_visible(value))


def _made_visible(value: object) -> object:
    kind = value.__class__
    if kind is str:
        return visible(cast(str, value))
    if kind is float or kind is int or value is None or isinstance(value, Enum):
        return value
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, dict | Mapping):
        return {visible(str(k)): _made_visible(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_made_visible(v) for v in value]
    return value


def known(state: str) -> str:
    """Class name of a mode or state; words of other tools' documents become ``outside_table``."""
    return state if state in LOOKS else "outside_table"


def mode_legend(mode: FaultMode) -> str:
    """Heading of a mode for both sides: ``Noisy / disturbed``."""
    sensor, actuator = (state_label(mode, side) for side in (Side.SENSOR, Side.ACTUATOR))
    return sensor if actuator == sensor else f"{sensor} / {actuator.lower()}"


def clock(seconds: float, digits: int = 0) -> str:
    """Mission time as ``m:ss`` or ``h:mm:ss``, with decimals where asked for. Time in s."""
    ticks = round(seconds * 10**digits)
    whole, rest = divmod(abs(ticks), 10**digits)
    minutes, s = divmod(whole, 60)
    hours, m = divmod(minutes, 60)
    text = f"{hours}:{m:02d}:{s:02d}" if hours else f"{m}:{s:02d}"
    return ("−" if ticks < 0 else "") + text + (f".{rest:0{digits}d}" if digits else "")


def span(seconds: float) -> str:
    """Length of time with a unit that suits it. Length in s."""
    return seconds_words(seconds)


def number(value: object, digits: int = 3) -> str:
    """Value in significant digits without an exponent where it can be avoided; an en dash where there is none."""
    if not isinstance(value, int | float) or isinstance(value, bool) or math.isnan(value):
        return "–"
    if isinstance(value, int):
        return grouped(value)
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
        text = grouped(round(value)) if abs(value) >= 1000 else f"{value:.6f}".rstrip("0")
    return text.replace("-", "−")


def bounded(epsilon: EpsilonRow, digits: int = 3) -> str:
    """An estimate with its 95 % bounds."""
    value, low, high = (
        f"{round(v, digits) + 0.0:.{digits}f}".replace("-", "−")
        for v in (epsilon["value"], epsilon["low"], epsilon["high"])
    )
    return f"{value} ({low} to {high})"


def grouped(value: int) -> str:
    """Integer with thin spaces between thousands."""
    return f"{value:,}".replace(",", "\u202f").replace("-", "−")


#: Stamps nearer to 1970 are of a clock without a date: simulated time, or time since something was switched on [ns since 1970].
UNDATED_NS = 365 * 86_400 * 10**9


def utc(start_ns: Any) -> str:
    """Nanoseconds since 1970 as a date and time in UTC."""
    try:
        moment = datetime.datetime.fromtimestamp(int(start_ns) // 10**9, tz=datetime.UTC)
    except (TypeError, ValueError, OverflowError, OSError):
        return "unknown"
    return moment.isoformat(" ")[:19]


def utc_moment(ns: int) -> str:
    """Nanoseconds since 1970 to the minute, with their zone: ``2026-10-05 12:30 UTC``."""
    return f"{utc(ns)[:16]} UTC"


def utc_mark(start_ns: Any, length: int = 19, *, both: bool = False) -> Markup:
    """The same as an element, to which the page's script adds the reader's local time: as a hint, or also beside it.

    Parameters
    ----------
    start_ns : int
        Nanoseconds since 1970.
    length : int
        Characters to show; 16: without seconds.
    both : bool
        Whether local time stands beside it.
    """
    kind = ' class="both"' if both else ""
    return Markup(f"<time{kind}>{utc(start_ns)[:length]}</time>")


def sat_text(mean: float, unit: str, words: MachineWords) -> str:
    """Saturation value with its unit; angles in degrees, commands in percent.

    `unit` is that of the mean: m/s, rad or a fraction of opening.
    """
    if unit == OPENING:
        return f"{number(100 * mean)}{words.percent}"
    if unit == "rad":
        return f"{number(mean * 57.29577951308232)}°"
    return f"{number(mean)}{'' if unit in {'', '1', 'fraction'} else ' ' + unit}"


def fault_title(fault: IntervalRow, words: MachineWords) -> str:
    """One line that names component, part, mode and size of a fault."""
    side, mode, sat, epsilon = fault["side"], fault["mode"], fault["sat"], fault["epsilon"]
    part = words.part_words(fault["kind"], fault["component"], side)
    if modes := candidates_of(fault):
        return f"{part} {unclear_words(side, modes)}"
    sizes = {"part": part}
    if sat:
        noise = sat["rms"] * (epsilon["value"] if epsilon else 1.0)  # what stands in the readings is ε × sat
        sizes |= {"mean": sat_text(sat["mean"], sat["unit"], words), "rms": sat_text(noise, sat["unit"], words)}
    if epsilon and loss_known(epsilon["low"], epsilon["high"]):
        lost = f"{100 * epsilon['value']:.0f} %"
        sizes["lost"] = f"reads {lost} too little" if side == Side.SENSOR else f"{lost} lost"
    row = row_of(side, mode)
    if row is not None and row.title and {name for _, name, _, _ in Formatter().parse(row.title) if name} <= set(sizes):
        return row.title.format_map(sizes)
    gain = gain_words(epsilon["value"]) if epsilon and mode == FaultMode.OUTSIDE_TABLE else ""
    return f"{part} {state_label(mode, side).lower()}" + (f": {gain}" if gain else "")
