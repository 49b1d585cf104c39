"""Wheels that count backwards: by the command, by the axes of their joints, or against those of the other side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from replay.log.source_options import SignalSource
from replay.setup.draft_notes import Draft
from replay.setup.motion import WheelMotion, backwards
from replay.setup.structure import Structure
from replay.signals.signal import Signals

_SUPPOSED = "left and right turn against each other"


def in_one_direction(
    draft: Draft, structure: Structure, found: Signals, motions: Mapping[str, WheelMotion]
) -> dict[str, SignalSource]:
    """Origins of all signals, those of wheels that count backwards with a negative gain.

    Parameters
    ----------
    draft : Draft
        The machine so far: it is told, and asked where the log does not say which side it is.
    structure : Structure
        Wheels, their places and joints.
    found : Signals
        Signals of the log.
    motions : Mapping[str, WheelMotion]
        How each wheel's signals follow the commanded motion, by signal.
    """
    flipped: dict[str, str] = {}
    for wheel in structure.wheels:
        motion = motions.get(f"wheel.{wheel}.v")
        if motion is not None:
            if motion.gain < 0:
                flipped[wheel] = "they turn against the command"
        elif wheel in structure.joints and structure.joints[wheel].mirrored:
            flipped[wheel] = "by the axes of their joints"
    if not motions and not structure.joints:
        flipped |= _by_signs(structure, found)
    if flipped:
        why = "; ".join(dict.fromkeys(flipped.values()))
        draft.say("signals", f"Mirrored, written with a negative gain: {', '.join(flipped)} ({why}).")
    if any(why.startswith(_SUPPOSED) for why in flipped.values()):
        draft.ask(
            "signals", "which side counts backwards? The log shows only that left and right count against each other."
        )
    origins = {}
    for name, signal in found.items.items():
        group, part, leaf = (*name.split("."), "", "")[:3]
        against = part in flipped and leaf in ("v", "v_true", "v_position", "effort")
        if leaf == "v_ref" and name in motions:
            against = motions[name].gain < 0
        origin = signal.origin
        origins[name] = replace(origin, gain=-origin.gain) if group == "wheel" and against else origin
    return origins


def _by_signs(structure: Structure, found: Signals) -> dict[str, str]:
    """Wheels of the right side, where they count against those of the left although the robot hardly turns."""
    speeds = {w: found.items[f"wheel.{w}.v"] for w in structure.wheels if f"wheel.{w}.v" in found.items}
    sides = structure.places or {}
    left = [w for w in speeds if w in sides and sides[w].y > 0]
    right = [w for w in speeds if w in sides and sides[w].y < 0]
    if not left or not right:
        return {}
    side, sure = backwards(speeds[left[0]], speeds[right[0]], found.items.get("imu.yaw_rate"))
    why = "by the measured yaw rate" if sure else f"{_SUPPOSED}; the right side is taken"
    return dict.fromkeys({"left": left, "right": right}.get(side, []), why)
