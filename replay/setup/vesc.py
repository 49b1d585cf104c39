"""A car with one motor whose controller is a VESC: its speed in electrical rotations a minute, and its current."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource
from replay.setup.draft_notes import Draft
from replay.setup.structure import MOTOR, Structure, motor_state
from replay.signals.candidate import source_of

_USUAL_ERPM = 4614.0  # electrical rotations a minute at 1 m/s, of the cars that most such logs are of
_MOVES = 0.3  # of the fastest command
_LEAST = 50  # samples


def motor_signals(structure: Structure, channels: Mapping[str, Channel]) -> dict[str, SignalSource]:
    """Speed and current of the only motor, by canonical name; empty of another machine."""
    speed = motor_state(channels)
    if structure.wheels != MOTOR or speed is None:
        return {}
    name = f"wheel.{MOTOR[0]}"
    out = {f"{name}.v": replace(source_of(speed, "m/s"), gain=_gain(speed, channels))}
    for c in channels.values():
        if c.topic == speed.topic and c.field.rpartition(".")[2] == "current_motor":
            out[f"{name}.effort"] = source_of(c, "A")
    return out


def ask_about_motor(structure: Structure, given: Mapping[str, SignalSource], draft: Draft) -> None:
    """Ask for what the log of such a car cannot tell. `given`: its signals."""
    source = given.get(f"wheel.{MOTOR[0]}.v")
    if structure.wheels != MOTOR or source is None:
        return
    draft.ask(
        "signals",
        f"does the motor make {1.0 / abs(source.gain):.4g} electrical rotations a minute at 1 m/s? By its commanded speed, which a wrong gain would hide; it is "
        "speed_to_erpm_gain of the VESC's settings.",
    )


def _gain(speed: Channel, channels: Mapping[str, Channel]) -> float:
    """Speed of the car over that of the motor by what it is told [m/s per rotation a minute], or as it usually is."""
    asked = [
        c
        for c in channels.values()
        if c.type_name.rpartition("/")[2].startswith("AckermannDrive") and c.field.rpartition(".")[2] == "speed"
    ]
    if len(asked) != 1:
        return 1.0 / _USUAL_ERPM
    order = np.argsort(asked[0].stamps)
    values = np.asarray(asked[0].values, dtype=np.float64)[order]
    told = np.interp(speed.stamps, asked[0].stamps[order], values)
    made = np.asarray(speed.values, dtype=np.float64)
    use = np.abs(told) > _MOVES * float(np.max(np.abs(told), initial=0.0))
    ratio = made[use] / told[use]
    if ratio.size < _LEAST or not abs(float(np.median(ratio))) > 1.0:
        return 1.0 / _USUAL_ERPM
    return float(f"{1.0 / float(np.median(ratio)):.4g}")
