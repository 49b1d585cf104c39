"""Channels that may be what a valve or pump is told, or where it stands: ``pump_cmd``, ``/wheel_FL/swash.position``, ``/steer_FR/spool.position``."""

from __future__ import annotations

import re

import numpy as np

from replay.log.raw_log import Channel
from replay.machine.config import Machine
from replay.machine.quantities import UNITS
from replay.machine.units import known_unit
from replay.signals.name_parts import axle_of, is_place, is_steering, speaks_of_no_wheel, wheel_of
from replay.signals.name_words import ASKING, MEASURED, english, role, tokens
from replay.signals.named_units import bare_name

_OPENED = frozenset(
    ("pump", "pumpe", "pompe", "swash", "swashplate", "schwenk", "spool", "valve", "vlv", "opening", "oeffnung")
)
_SAID = frozenset(
    (
        "position",
        "pos",
        "stell",
        "output",
        "out",
        "value",
        "opening",
        "state",
        "displacement",
        "drive",
        "motor",
        "wheel",
    )
)
_FULL, _ROOM = 1.0, 1.1  # of an opening, and what noise may add
_LEAST = 0.05  # of full opening that such a channel reaches


def unsure_opening(channel: Channel, machine: Machine) -> tuple[str, str] | None:
    """Canonical name and unit of the opening that a channel may be by its words and values; None where it is none.

    Parameters
    ----------
    channel : Channel
        Whose name alone does not say it for sure.
    machine : Machine
        Its wheels and axles.
    """
    name, stated = bare_name(channel.name)
    steering = is_steering(name)
    part = axle_of(name, machine) if steering else wheel_of(name, machine)
    parts = [english(tokens(p)) for p in re.split(r"[./]", re.sub(r"\.(data|value)$", "", name))]
    words = {w for p in parts for w in p}
    named = {w.lower() for w in machine.wheels}
    last = {w for w in parts[-1] if not is_place(w) and not w.isdigit()} - named
    opened = _OPENED | {"u"} if steering else _OPENED  # u_steer_rear
    if part is None or not opened & words or speaks_of_no_wheel(name):
        return None
    if not last <= opened | _SAID | ASKING | MEASURED | frozenset(("steer",)):
        return None
    asked = (
        "ref"
        if "u" in last and not MEASURED & last
        else role([*last, *(w for p in parts if {*p} <= ASKING for w in p)])
    )
    unit = _unit(channel, stated)
    if unit is None or asked == "both":
        return None
    return f"{'steer' if steering else 'wheel'}.{part}.{'u' if asked == 'ref' else 'u_applied'}", unit


def _unit(channel: Channel, stated: str) -> str | None:
    """Fractions or per cent: as stated, else by the largest value; None where it is neither."""
    said = stated or channel.unit or ""
    if said:
        known = known_unit(said)
        return known if known is not None and UNITS[known][0] == "fraction" else None
    values = np.abs(channel.values[np.isfinite(channel.values)]) if channel.values.dtype.kind in "fiu" else np.zeros(0)
    most = float(values.max()) if values.size else 0.0
    for full, unit in ((_FULL, "1"), (100.0 * _FULL, "%")):
        if _LEAST * full <= most <= _ROOM * full:
            return unit
    return None
