"""Units that the name of a column or symbol states: in brackets at its end, or as its last word."""

from __future__ import annotations

import re

from replay.machine.units import known_unit
from replay.signals.name_words import folded

# Ends of names that people give to columns.
_ENDS = (
    (r"rpm|u_?min|umdr_?min|tr_?min|1_min|min_1", "rpm"), (r"mm_s|mmps|mm_per_s", "mm/s"), (r"cm_s|cm_per_s", "cm/s"),
    (r"mps|m_s|m_per_s|mpers", "m/s"), (r"kmh|kph|km_h", "km/h"),
    (r"rads|rad_s|radps|rad_per_s", "rad/s"), (r"degs|deg_s|degps|deg_per_s|dps|grad_s", "deg/s"), (r"deg|grad", "deg"),
    (r"pct|percent|prozent|pourcent", "%"), (r"bar", "bar"), (r"nm", "N·m"),
)  # fmt: skip
# Ends that may be another word: ms a time, Rad a wheel, current a quantity.
_DOUBTFUL = (
    (r"ms", "m/s"), (r"rps", "rad/s"), (r"rad", "rad"), (r"amps?|current", "A"), (r"volts?|voltage", "V"), (r"mm", "mm"),
)  # fmt: skip
_CAPITAL = re.compile(r"(?<=[a-z])(?=[A-Z])")
_BRACKET = re.compile(r"\s*[\[(]([^\[\]()]*)[\])]\s*$")


def bare_name(name: str) -> tuple[str, str]:
    """Name without a unit at its end, and that unit as it is written: ``n_ist_VR [1/min]``: ``n_ist_VR``, ``1/min``.

    Brackets that hold a number or the name of a part are no unit.
    """
    found = _BRACKET.search(name)
    inside = "" if found is None else found[1].strip()
    if found is not None and not inside.isdigit() and (known_unit(inside) or not re.fullmatch(r"\w{2,}", inside)):
        return name[: found.start()], inside
    before, _, last = name.rstrip().rpartition(" ")
    if found is None and before and re.search(r"[/%°]", last) and known_unit(last):
        return before, last
    return name, ""


def unit_by_word(name: str, bare: str) -> str:
    """Unit that the last words of a name state, else those before a place at its end; empty where neither does.

    Parameters
    ----------
    name : str
        As recorded: ``wheel_rpm_FL``.
    bare : str
        Without places at its end, of which the whole may be a unit: ``wheel_rpm``, or ``RPM`` of ``RPM_FL``.
    """
    return unit_by_end(name) or ("" if bare == name else unit_by_end(f"of_{bare}"))


def unit_by_end(name: str, doubtful: bool = False) -> str:
    """Unit that the last words of a name state (``n_ist_VR_rpm``), empty where they state none.

    Parameters
    ----------
    name : str
        As recorded.
    doubtful : bool
        Whether ends count that may be another word as well, and names that are nothing but a unit.
    """
    words = _CAPITAL.sub("_", folded(re.sub(r"\[\d+\]", "", name)))  # nSpeedRpm: n_Speed_Rpm
    plain = re.sub(r"[^a-z0-9]+", "_", words.lower()).strip("_")
    for pattern, unit in _ENDS + (_DOUBTFUL if doubtful else ()):
        if re.search(rf"{'(^|_)' if doubtful else '_'}({pattern})$", plain):
            return unit
    return ""
