"""Lengths, angles and speeds of a machine, as far as a log tells them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from replay.log.raw_log import RawLog
from replay.log.source_options import SignalSource
from replay.machine.config import Limits, Machine, haulotte
from replay.machine.geometry import WheelGeometry
from replay.machine.units import known_unit
from replay.setup.draft_notes import Draft
from replay.setup.motion import WheelMotion
from replay.setup.structure import ONE, Structure
from replay.signals.mapping import map_signals
from replay.signals.signal import Signal, Signals
from replay.signals.to_si import peak_of

_RADII, _TRACKS = (0.02, 2.5), (0.05, 10.0)  # m
_HEADROOM = 1.2
_DIFFERS = 0.15
_LEAST_SPEED = 0.05  # m/s
_WHEEL_SIZES = (0.04, 1.0)  # m; of a radius that explains a speed without a unit


def wheel_radius(
    draft: Draft, structure: Structure, found: Signals, motions: Mapping[str, WheelMotion],
    origins: dict[str, SignalSource],
) -> float | None:  # fmt: skip
    """Wheel radius [m]; signals without a unit get the one with which they follow the command."""
    turning = []
    for wheel in structure.wheels:
        name = f"wheel.{wheel}.v"
        motion, origin = motions.get(name), origins.get(name)
        if origin is None:
            continue
        unit = known_unit(origin.unit)
        if unit in ("rad/s", "rpm", "rev/s", "deg/s") or (unit == "rad" and origin.derivative):
            turning.append(1 / abs(motion.gain) if motion is not None else math.nan)
        elif not origin.unit and motion is not None and abs(abs(motion.gain) - 1) > _DIFFERS:
            turning += _unit_by_size(draft, structure, name, origin, motion, origins)
    known = [r for r in turning if math.isfinite(r) and _RADII[0] <= r <= _RADII[1]]
    measured = float(np.median(known)) if known else None
    if structure.radius is not None:
        draft.say("geometry", f"Wheel radius {structure.radius:g} m from {structure.how}.")
        if measured is not None and abs(measured / structure.radius - 1) > _DIFFERS:
            draft.ask(
                "geometry",
                f"is the wheel radius {structure.radius:g} m? By commanded and measured speeds it would be {measured:.3g} m.",
            )
        return structure.radius
    if measured is not None:
        draft.say(
            "geometry",
            f"Wheel radius {_round(measured)} m, from commanded speed over measured rotation: a slip or scale that all wheels "
            "share does not show with it; measure the wheel.",
        )
        return float(_round(measured))
    if turning:
        draft.ask(
            "geometry",
            "how large are the wheels? Nothing in the log tells it; 0.1 m radius stands in, and with it every speed.",
        )
        return 0.1
    return 0.1 if structure.places is not None else None


def _unit_by_size(
    draft: Draft, structure: Structure, name: str, origin: SignalSource, motion: WheelMotion,
    origins: dict[str, SignalSource],
) -> list[float]:  # fmt: skip
    """Give a speed without a unit the one that makes its wheel a usual size; return the radius, if one fits."""
    for unit, turn in (("rad/s", 1.0), ("rpm", 2 * math.pi / 60)):
        radius = 1 / (abs(motion.gain) * turn)
        if structure.places is not None and _WHEEL_SIZES[0] <= radius <= _WHEEL_SIZES[1]:
            origins[name] = replace(origin, unit=unit)
            draft.ask(
                "signals",
                f"is {origin.label} in {unit}? No unit is stated; with it the wheel's radius is {radius:.3g} m.",
            )
            return [radius]
    scale = float(f"{1 / motion.gain:.6g}")
    origins[name] = replace(origin, unit="m/s", gain=scale)
    draft.ask("signals", f"is {scale:g} the scale of {origin.label} to m/s? It is what makes it follow the command.")
    return []


def _round(value: float) -> str:
    return f"{value:.3g}"


def wheel_places(
    draft: Draft, structure: Structure, motions: Mapping[str, WheelMotion]
) -> Mapping[str, WheelGeometry] | None:
    """Places with the track that turns show, where no description gives them."""
    places = structure.places
    if places is None:
        if structure.wheels != ONE:
            draft.ask("geometry", "where are the wheels? Their names do not say; without places no turn is compared.")
        return None
    tracks = [2 * m.y * (1 if places[n.split(".")[1]].y > 0 else -1) for n, m in motions.items() if m.y is not None]
    tracks = [t for t in tracks if _TRACKS[0] <= t <= _TRACKS[1]]
    fixed = all(p.axle == "fixed" for p in places.values())
    track = max(p.y for p in places.values()) - min(p.y for p in places.values())
    if "track" in structure.measured:
        draft.say("geometry", f"Track {track:.4g} m from {structure.how}.")
    elif tracks and fixed:
        track = float(_round(float(np.median(tracks))))
        draft.say("geometry", f"Track {track:g} m, from commanded turns over the wheels' speeds; measure it.")
    else:
        draft.ask("geometry", f"how far are left and right wheels apart? Nothing tells it; {track:g} m stand in.")
    base = max(p.x for p in places.values()) - min(p.x for p in places.values())
    if "wheelbase" in structure.measured:
        draft.say("geometry", f"Wheelbase {base:.4g} m from {structure.how}.")
    elif base:
        matters = "fixed wheels do not need it" if fixed else "steering angles need it"
        draft.ask(
            "geometry", f"how far are front and rear wheels apart? Nothing tells it ({matters}); {base:g} m stand in."
        )
    scale = track / max(max(p.y for p in places.values()) - min(p.y for p in places.values()), 1e-9)
    return {w: replace(p, y=round(p.y * scale, 4)) for w, p in places.items()}


def largest_angle(draft: Draft, structure: Structure, found: Signals) -> float:
    """Largest steering angle [rad]: described, else a fifth more than the log shows."""
    usual = haulotte().max_steer
    angles = [
        s for n, s in found.items.items() if n.startswith("steer.") and n.rpartition(".")[2] in ("phi", "phi_ref")
    ]
    if structure.max_steer is not None:
        return min(structure.max_steer, 3.2)
    if not any(p.axle != "fixed" for p in (structure.places or {}).values()):
        return usual
    reached = max((peak_of(s.values) for s in angles), default=0.0)
    value = float(_round(min(max(_HEADROOM * reached, 0.1), 1.6))) if reached else round(usual, 4)
    draft.ask(
        "geometry", f"how far do the wheels steer? max_steer = {value:g} rad is a fifth more than this log shows."
    )
    return value


def with_speeds(draft: Draft, machine: Machine, logs: Sequence[RawLog]) -> Machine:
    """The machine with the top speed that the log shows, and the limits that go with it."""
    found = map_signals(logs, machine).items
    wheels = [s for n, s in found.items() if n.startswith("wheel.") and n.rpartition(".")[2] in ("v", "v_ref")]
    asked = _asked(found, machine)
    reached = max([_top(s) for s in wheels] + [asked], default=0.0)
    top = float(_round(max(_HEADROOM * reached, _LEAST_SPEED)))
    draft.ask(
        "geometry",
        f"how fast can it go? max_speed = {top:g} m/s is a fifth more than this log shows; limits grow and shrink with it.",
    )
    return replace(machine, max_speed=top, limits=limits_for(top), assumed=())


def limits_for(top: float) -> Limits:
    """Limits that grow and shrink with the top speed [m/s], as those of a machine file do that leaves them out."""
    usual, share = Limits(), top / haulotte().max_speed
    return replace(usual, driving_speed=round(usual.driving_speed * share, 9), min_sat=round(usual.min_sat * share, 9))


def _asked(found: Mapping[str, Signal], machine: Machine) -> float:
    v, omega = found.get("cmd.v"), found.get("cmd.omega")
    side = max((abs(p.y) for p in machine.geometry.wheels.values()), default=0.0) if machine.geometry else 0.0
    return (0.0 if v is None else _top(v)) + (0.0 if omega is None else side * _top(omega) / 2)


def _top(signal: Signal) -> float:
    return peak_of(signal.values)
