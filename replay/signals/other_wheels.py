"""Wheels that the names in a log speak of and a machine of four, whose file lists no signals, does not have."""

from __future__ import annotations

from collections.abc import Mapping

from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.geometry import Geometry, WheelGeometry
from replay.signals.like_wheels import like_wheels
from replay.signals.name_parts import position, wheel_said
from replay.signals.rules import candidates

_PLACES = {
    "FR": (1.0, -0.5),
    "FL": (1.0, 0.5),
    "MR": (0.0, -0.5),
    "ML": (0.0, 0.5),
    "RR": (-1.0, -0.5),
    "RL": (-1.0, 0.5),
}


def other_wheels(
    channels: Mapping[str, Channel], machine: Machine, taken: Mapping[str, SignalSource] | None = None
) -> tuple[str, ...]:
    """Names of the wheels in the middle of a log's machine that has speeds of six, else of channels that are called like wheels' speeds.

    Empty where the machine file lists signals: `mfhca config init` asks about such channels in the file.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        Of all files, by the names that say what they hold.
    machine : Machine
        The machine that the log is judged by.
    taken : Mapping[str, SignalSource] or None
        What each signal is taken from, by canonical name.
    """
    if machine.signals or len(machine.wheels) < 2:
        return ()
    return _in_the_middle(channels, machine) or like_wheels(channels, taken or {})


def _in_the_middle(channels: Mapping[str, Channel], machine: Machine) -> tuple[str, ...]:
    """Wheels in the middle of a log's machine that has speeds of six, beside a machine of fewer."""
    if len(machine.wheels) >= len(_PLACES):
        return ()
    geometry = Geometry({w: WheelGeometry(x, y, 0.0, "fixed") for w, (x, y) in _PLACES.items()}, 0.2)
    six = Machine("six wheels", "", tuple(_PLACES), geometry, max_speed=1e6)
    found = set()
    for c in candidates(channels, six):
        group, part, leaf = (*c.signal.split("."), "", "")[:3]
        if group == "wheel" and leaf in ("v", "v_true") and wheel_said(c.origin.label, six) == part:
            found.add(part)
    own = {position(w) for w in machine.wheels}
    return tuple(w for w in _PLACES if position(w) not in own) if found == set(_PLACES) else ()
