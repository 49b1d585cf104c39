"""Yaw rate that a car's commanded steering angle asks for: ω_c = v_c·tan δ / L of the single-track model."""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import replace

import numpy as np

from replay.machine.config import Machine
from replay.machine.units import is_angle
from replay.signals.signal import Signal

_LARGEST = 1.5  # rad; at a right angle a car does not turn, it stands


def is_steering_command(signal: Signal) -> bool:
    """Whether a commanded yaw rate was recorded as an angle: that of the steered wheels' middle."""
    return signal.name == "cmd.omega" and not signal.origin.derivative and is_angle(signal.origin.unit)


def turn_by_steering(items: MutableMapping[str, Signal], missing: MutableMapping[str, str], machine: Machine) -> None:
    """Replace a command that is a steering angle by the yaw rate [rad/s] that it asks for, or say why it is missing.

    Parameters
    ----------
    items : MutableMapping[str, Signal]
        By canonical name; an angle [rad] is positive to the left where the steered wheels are in front, and turns what the
        body's commanded speed [m/s] moves.
    missing : MutableMapping[str, str]
        Takes the reason.
    machine : Machine
        For the distance between steered and unsteered wheels.
    """
    angle, speed = items.get("cmd.omega"), items.get("cmd.v")
    if angle is None or not is_steering_command(angle):
        return
    base = None if machine.geometry is None else machine.geometry.steering_base
    if base is None or speed is None:
        lacks = (
            "no commanded speed was found"
            if base is not None
            else "[geometry] has no unsteered wheels behind or before steered ones"
        )
        missing["cmd.omega"] = f"{angle.origin.label} is a steering angle, and {lacks}"
        del items["cmd.omega"]
        return
    at = np.searchsorted(speed.stamps, angle.stamps, side="right") - 1
    v = np.where(at >= 0, speed.values[np.maximum(at, 0)], np.nan)
    delta = np.where(np.abs(angle.values) < _LARGEST, angle.values, np.nan)
    items["cmd.omega"] = replace(angle, values=v * np.tan(delta) / base)
