"""What signals of a log say against each other: turns against their command, a speed against its own position."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from replay.log.source_options import SignalSource
from replay.machine.units import known_unit
from replay.setup.draft_notes import Draft
from replay.setup.motion import WheelMotion, held
from replay.setup.structure import Structure
from replay.signals.signal import Signal, Signals

_LEAST = 50  # samples
_MOVES = 0.2  # of the largest speed
_SAME = 0.1  # by which a speed and the slope of its position may differ
_UNITS = (("rpm", 60 / (2 * np.pi)), ("deg/s", 180 / np.pi), ("rev/s", 1 / (2 * np.pi)))
_NEAR = 0.06  # of the ratio of two units: slopes of positions are coarse
_TURNS = 0.05  # rad/s; standard deviation of a yaw rate that turns show in
_AGREE = 0.5  # correlation


def in_turn_with_commands(
    draft: Draft, structure: Structure, found: Signals, motions: Mapping[str, WheelMotion], origins: dict[str, SignalSource]
) -> Mapping[str, WheelMotion]:  # fmt: skip
    """Motions with each wheel on its own side, where all of them turn against the commanded yaw rate.

    The sign of the command is turned round unless the measured yaw rate goes with it: then the wheels are not where their names say.

    Parameters
    ----------
    draft : Draft
        Takes the question.
    structure : Structure
        Where its wheels are, by their names.
    found : Signals
        Of the log.
    motions : Mapping[str, WheelMotion]
        How each signal of a wheel follows the command.
    origins : dict[str, SignalSource]
        Of all signals; that of the command is changed.
    """
    places = structure.places
    if places is None:
        return motions
    sides = [m.y * places[n.split(".")[1]].y for n, m in motions.items() if m.y is not None and n.endswith(".v")]
    if not sides or max(sides) >= 0.0 or any(p.axle != "fixed" for p in places.values()):
        return motions
    yaw, turn = found.items.get("imu.yaw_rate"), found.items.get("cmd.omega")
    seen = 0.0 if yaw is None or turn is None else _correlation(yaw, turn)
    if turn is None or seen > _AGREE:
        draft.ask(
            "signals",
            "are left and right exchanged? The wheels turn against the command, and the yaw rate goes with it.",
        )
    else:
        also = ", and so does the measured yaw rate" if seen < -_AGREE else ""
        draft.ask(
            "signals",
            f"is cmd.omega positive to the right? The wheels turn against it{also}; it is written with a negative gain.",
        )
        origins["cmd.omega"] = replace(origins["cmd.omega"], gain=-origins["cmd.omega"].gain)
    return {n: m if m.y is None else replace(m, y=-m.y) for n, m in motions.items()}


def _correlation(yaw: Signal, turn: Signal) -> float:
    asked = held(turn, yaw.stamps)
    known = np.isfinite(asked) & np.isfinite(yaw.values)
    if np.count_nonzero(known) < _LEAST or min(np.std(asked[known]), np.std(yaw.values[known])) < _TURNS:
        return 0.0
    return float(np.corrcoef(asked[known], yaw.values[known])[0, 1])


def units_by_positions(draft: Draft, structure: Structure, found: Signals) -> dict[str, SignalSource]:
    """Sources of the speeds of wheels, by canonical name, with the unit in which they are the slopes of their own joints' positions.

    Parameters
    ----------
    draft : Draft
        Takes the question, also where no unit makes them agree; then nothing is returned.
    structure : Structure
        Its wheels.
    found : Signals
        Of the log, in SI with the units that were taken.
    """
    gains = {n: g for w in structure.wheels if (g := _by_position(found, n := f"wheel.{w}.v")) is not None}
    gain = float(np.median(list(gains.values()))) if gains else 1.0
    if abs(gain - 1.0) <= _SAME or gain == 0.0:
        return {}
    unit = next((u for u, k in _UNITS if all(abs(g / k - 1.0) < _NEAR for g in gains.values())), "")
    if unit and any(known_unit(found.items[n].origin.unit) != "rad/s" for n in gains):
        unit = ""
    fits = f"{unit} is written, with which they agree" if unit else "give the unit or gain of the one that is wrong"
    draft.ask(
        "signals",
        f"in which units are wheel.*.v and wheel.*.v_position? As recorded {', '.join(n.split('.')[1] for n in gains)} read {gain:.3g} × "
        f"the slope of the position of their own joint (median); {fits}.",
    )
    return {n: replace(found.items[n].origin, unit=unit) for n in gains} if unit else {}


def _by_position(found: Signals, name: str) -> float | None:
    """Speed of a wheel by the slope of its position [1]; None where one is not logged, or hardly moves."""
    v, rolled = found.items.get(name), found.items.get(f"{name}_position")
    if v is None or rolled is None or min(len(v.stamps), len(rolled.stamps)) < _LEAST:
        return None
    slope, speed = held(rolled, v.stamps), np.asarray(v.values)
    moving = np.isfinite(slope) & np.isfinite(speed)
    moving &= np.abs(slope) > _MOVES * float(np.max(np.abs(slope[moving]), initial=0.0))
    return abs(float(np.median(speed[moving] / slope[moving]))) if np.count_nonzero(moving) >= _LEAST else None
