"""What a fault's evidence compares: the channel and its reference, and the columns in which it was decided."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from diagnosis.pages.labels import number

DEGREES = 180.0 / math.pi
VALVE_UNIT = "of full opening"
_TIERS = {
    "direct": "second measurement",
    "signal": "channel alone",
    "tracking": "command tracking",
    "drive": "drive model",
    "steering": "steering model",
}


@dataclass(frozen=True)
class Pair:
    """Channel and reference of one fault.

    Attributes
    ----------
    title : str
        What is measured.
    measured, reference : str, str or None
        Columns.
    words : str
        What the reference is.
    apart : bool
        Whether the reference is recorded apart from the channel, so that a fault leaves it as it is.
    unit : str
        Unit of the values shown.
    scale : float
        Factor from a column's unit to `unit`.
    evidence : str
        Beginning of the names of the evidence columns.
    """

    title: str
    measured: str
    reference: str | None
    words: str
    apart: bool
    unit: str
    scale: float
    evidence: str

    def text(self, value: float) -> str:
        """Value with its unit."""
        return f"{number(value)}{'' if self.unit == '°' else ' '}{self.unit}"


def sides_of(side: str) -> tuple[str, ...]:
    """Sides whose evidence a fault shows."""
    return ("sensor", "actuator") if side == "sensor_or_actuator" else (side,)


def by_valve(fault: Mapping[str, Any], columns: Iterable[str]) -> bool:
    """Whether a fault was decided by the measured position of its valve."""
    group = "steer" if fault["kind"] == "steer" else "wheel"
    applied = f"{group}.{fault['component']}.u_applied"
    return fault["side"] == "actuator" and fault.get("tier") == "direct" and applied in columns


def pair_of(fault: Mapping[str, Any], columns: Mapping[str, Any]) -> Pair | None:
    """Channel of a fault and what it was compared with; None where the channel is not there.

    Parameters
    ----------
    fault : Mapping[str, Any]
        One of the report's intervals.
    columns : Mapping[str, Any]
        Columns by name.
    """
    c, direct = fault["component"], fault.get("tier") == "direct"
    bases = [f"evidence.{c}.{side}." for side in sides_of(fault["side"])]
    base = next((b for b in bases if any(name.startswith(b) for name in columns)), bases[0])
    steer = fault["kind"] == "steer"
    group, leaf = ("steer", "phi") if steer else ("wheel", "v")
    own = f"{group}.{c}."
    if by_valve(fault, columns):
        reference = own + "u" if own + "u" in columns else None
        return Pair(
            "Valve position", own + "u_applied", reference, "command", reference is not None, VALVE_UNIT, 1.0, base
        )
    if own + leaf not in columns:
        return None
    choices = [
        (base + "expected", "expected value"),
        (f"replay.{c}.{leaf}_ref", "commanded"),
        (f"{own}{leaf}_ref", "commanded"),
    ]
    if direct:
        choices.insert(0, (f"{own}{leaf}_true", "second measurement"))
    reference, words = next(((name, words) for name, words in choices if name in columns), (None, ""))
    unit, scale = ("°", DEGREES) if steer else ("m/s", 1.0)
    title, apart = "Steering angle" if steer else "Wheel speed", reference == f"{own}{leaf}_true"
    return Pair(title, own + leaf, reference, words, apart, unit, scale, base)


def tier_words(fault: Mapping[str, Any]) -> str:
    """Name of the kind of evidence that a fault rests on."""
    tier = str(fault.get("tier") or "")
    if tier == "model":
        return "steering model" if fault["kind"] == "steer" else "wheel model"
    return _TIERS.get(tier, tier)


def rests_on(fault: Mapping[str, Any], columns: Iterable[str]) -> str:
    """Kind of evidence of a fault, and the channels that its sentences name in their order."""
    text = " ".join(str(e) for e in fault.get("evidence") or ())
    places = {}
    for name in columns:
        if "." in name and not name.startswith(("evidence.", "replay.")) and (at := _place(name, text)) >= 0:
            places[name] = at
    channels = sorted(places, key=lambda n: places[n])
    kind = tier_words(fault)
    return f"{kind}: {', '.join(channels)}" if kind and channels else kind or ", ".join(channels)


def _place(name: str, text: str) -> int:
    """Where a channel's name stands in a text as a whole word; −1 where it does not."""
    at = text.find(name)
    while at >= 0:
        after = text[at + len(name) : at + len(name) + 2]
        if not (after[:1].isalnum() or after[:1] == "_" or (after[:1] == "." and after[1:].isalnum())):
            return at
        at = text.find(name, at + 1)
    return -1


def shape_sentence(fault: Mapping[str, Any]) -> str:
    """The evidence sentence that tells what the onset's shape says; empty where none does."""
    signs = ("at once", "jump", "bends", "with its lag", "within one sample")
    return next((str(e) for e in fault.get("evidence") or () if any(s in str(e) for s in signs)), "")
