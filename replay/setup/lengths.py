"""Lengths, angles and speeds of a machine, as far as a log tells them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.machine.geometry import Geometry, WheelGeometry
from replay.machine.quantities import UNITS
from replay.machine.units import known_unit
from replay.setup.by_the_body import Measured, base_by_angle, base_by_yaw, is_rotation, track_by_yaw
from replay.setup.by_the_steering import Lengths, lengths_by_yaw
from replay.setup.draft_notes import Draft
from replay.setup.motion import WheelMotion
from replay.setup.structure import MOTOR, ONE, Structure
from replay.setup.unit_of_speeds import (
    DIFFERS,
    WHEEL_SIZES,
    agreed,
    by_their_mean,
    turns_commanded,
    unit_of_commanded_turns,
    unit_of_speeds,
)
from replay.signals.name_words import english, tokens
from replay.signals.signal import Signals
from replay.signals.to_si import peak_of

_RADII, _TRACKS = (0.02, 2.5), (0.05, 4.0)  # m
_BASES = 20.0  # m; the longest
_HEADROOM = 1.2
_STANDS_IN_RADIUS = 0.1  # m; where nothing tells it
_LEAST_SPEED = 0.05  # m/s
_ANY_MACHINE, _STANDS_IN = 30.0, 10.0  # m/s; faster than any wheeled machine, and what is written then
_SLOW = 0.2  # m/s; from which top speed on a number too large may be one in mm/s


def wheel_radius(
    draft: Draft, structure: Structure, found: Signals, motions: Mapping[str, WheelMotion],
    origins: dict[str, SignalSource], by_body: Measured | None = None,
) -> float:  # fmt: skip
    """Wheel radius [m], by the measured speed of the body before the commands. Signals without a unit get the one that fits the command."""
    unit_of_commanded_turns(draft, structure.wheels, found, origins)
    turning = [n for w in structure.wheels if (n := f"wheel.{w}.v") in origins and is_rotation(origins[n])]
    bare = [n for w in structure.wheels if (n := f"wheel.{w}.v") in origins and not origins[n].unit]
    asked = [n for w in structure.wheels if (n := f"wheel.{w}.v_ref") in origins and is_rotation(origins[n])]
    told = [
        n for n in turning if "cmd.v" in found.items or f"{n}_ref" not in asked
    ]  # rotations tell no size of each other
    exact = agreed([1 / abs(motions[n].gain) for n in asked if n in motions])
    measured = exact or agreed([1 / abs(motions[n].gain) for n in told if n in motions])
    if measured is None and told and (gain := by_their_mean(found, told, origins)) is not None:
        measured = 1 / abs(gain)
    if bare:
        measured = unit_of_speeds(draft, structure, found, bare, motions, origins) or measured
    if structure.radius is not None:
        draft.say("geometry", f"Wheel radius {structure.radius:g} m from {structure.how}.")
        if measured is not None and abs(measured / structure.radius - 1) > DIFFERS:
            draft.ask(
                "geometry",
                f"is the wheel radius {structure.radius:g} m? By commanded and measured speeds it would be {measured:.3g} m.",
            )
        return structure.radius
    if by_body is not None and turning and _RADII[0] <= by_body.length <= _RADII[1]:
        right = (
            "odometry is as right as the radius that its own software has"
            if by_body.by == "odometry"
            else "it tells nothing if it is made of the wheels"
        )
        draft.ask(
            "geometry",
            f"is the wheel radius {by_body.length:.3g} m? By {by_body.by} beside the turns of the wheels; {right}. Measure the wheel.",
        )
        return float(_round(by_body.length))
    # a ROS joint that is called a wheel turns as the wheel; symbols of a PLC called so often hold its motor's turns
    wheels_own = all(origins[n].topic is not None and "wheel" in english(tokens(origins[n].label)) for n in turning)
    if measured is not None and measured < (_RADII[0] if wheels_own else WHEEL_SIZES[0]):
        draft.ask(
            "geometry",
            f"were the motors measured? Radius over gear ratio is {measured:.3g} m, and rotations are written with at = "
            '"motor": give gear_ratio and wheel_diameter here.',
        )
        for n, origin in origins.items():
            if n.startswith("wheel.") and is_rotation(origin):
                origins[n] = replace(origin, at="motor")
        return max(float(_round(measured)), _RADII[0] / 2)
    if measured is not None and measured <= _RADII[1]:
        draft.ask(
            "geometry",
            f"is the wheel radius {measured:.3g} m? It is what makes commands and speeds agree; a scale that all wheels share "
            "does not show with it. Measure the wheel.",
        )
        return float(_round(measured))
    if measured is not None and (unit := turns_commanded(origins, turning, measured)):
        gain = float(f"{UNITS[unit][1] * _STANDS_IN_RADIUS:.6g}")
        draft.ask(
            "signals",
            f"does {origins['cmd.v'].label} command turns of the wheels ({unit}) rather than a speed? It is as large as these, and is "
            f"written so: gain = {UNITS[unit][1]:.6g} × the radius of the wheels, or of the radius over gear_ratio.",
        )
        origins["cmd.v"] = replace(origins["cmd.v"], unit="m/s", gain=gain)
    if turning:
        draft.ask(
            "geometry",
            "how large are the wheels? Nothing in the log tells it; 0.1 m radius stands in, and with it every speed. If the motors' "
            'turns were logged, add gear_ratio here, and at = "motor" to the speeds below.',
        )
    elif not bare and any(f"wheel.{w}.v" in origins for w in structure.wheels):
        draft.say(
            "geometry",
            f"wheel_diameter = {2 * _STANDS_IN_RADIUS:g} stands in: the log has speeds of the rim, and only rotations need it.",
        )
    return _STANDS_IN_RADIUS


def without_size(origin: SignalSource, radius: float) -> SignalSource:
    """Rotation of a wheel as a speed, for a machine file without geometry that could give the wheel's size [m]."""
    if not is_rotation(origin):
        return origin
    quantity, factor = UNITS[known_unit(origin.unit) or "rad/s"]
    unit = "m" if quantity == "angle" else "m/s"
    return replace(origin, unit=unit, gain=float(f"{origin.gain * factor * radius:.6g}"))


def _round(value: float) -> str:
    return f"{value:.3g}"


def wheel_places(
    draft: Draft,
    structure: Structure,
    motions: Mapping[str, WheelMotion],
    measured: tuple[Signals, float, Mapping[str, SignalSource]] | None = None,
) -> Mapping[str, WheelGeometry] | None:
    """Places with the track that turns show, where no description gives them.

    Measured turns come before commanded ones: `measured` has the signals, the wheel radius [m] and the signals' origins.
    """
    places = structure.places
    if places is None:
        return None if structure.wheels == ONE else _sides(draft, structure.wheels, motions)
    if structure.wheels in (ONE, MOTOR):
        ((name, place),) = places.items()
        turned = None if measured is None or structure.wheels == ONE else base_by_angle(measured[0], place.axle)
        if turned is not None and _TRACKS[0] <= turned.length <= _BASES:
            length = float(_round(turned.length))
            draft.ask("geometry", f"are front and rear wheels {length:g} m apart? By {turned.by}. Measure it.")
            return {name: replace(place, x=math.copysign(length, place.x))}
        where = f"{'before' if place.x > 0 else 'behind'} the unsteered wheels"
        draft.ask(
            "geometry",
            f"how far {where} is the {place.axle} axle, which is steered? Nothing tells it; {abs(place.x):g} m stand in, as x of "
            f"{name}, which stands at that axle.",
        )
        return places
    steered = Lengths(None, None) if measured is None else lengths_by_yaw(measured[0], places, *measured[1:])
    turned = None if measured is None else track_by_yaw(measured[0], places, *measured[1:]) or steered.track
    asked_speeds = {n: m for n, m in motions.items() if n.endswith(".v_ref")}
    told = asked_speeds if len(asked_speeds) == len(places) else motions  # no fault hides what is asked
    tracks = [2 * m.y * (1 if places[n.split(".")[1]].y > 0 else -1) for n, m in told.items() if m.y is not None]
    asked = agreed([t if _TRACKS[0] <= t <= _TRACKS[1] else math.inf for t in tracks])
    fixed = all(p.axle == "fixed" for p in places.values())
    track = max(p.y for p in places.values()) - min(p.y for p in places.values())
    if "track" in structure.measured:
        draft.say("geometry", f"Track {track:.4g} m from {structure.how}.")
    elif turned is not None and _TRACKS[0] <= turned.length <= _TRACKS[1]:
        track = float(_round(turned.length))
        skids = " beside the speeds of the wheels: a machine that skids turns as one with a wider track would"
        how = f"{turned.by}{'' if turned is steered.track else skids}"
        draft.ask("geometry", f"is the track {track:g} m? By {how}. Measure it.")
    elif asked is not None and math.isfinite(asked) and fixed:
        track = float(_round(asked))
        draft.ask(
            "geometry", f"is the track {track:g} m? It is what makes commanded turns and speeds agree. Measure it."
        )
    else:
        draft.ask("geometry", f"how far are left and right wheels apart? Nothing tells it; {track:g} m stand in.")
    base = max(p.x for p in places.values()) - min(p.x for p in places.values())
    if "wheelbase" in structure.measured:
        draft.say("geometry", f"Wheelbase {base:.4g} m from {structure.how}.")
    elif (by_yaw := _base_by_yaw(draft, places, None if measured is None else measured[0], steered.base)) is not None:
        stretch = by_yaw / base
        places = {w: replace(p, x=round(p.x * stretch, 4)) for w, p in places.items()}
    elif base:
        matters = "fixed wheels do not need it" if fixed else "steering angles need it"
        draft.ask(
            "geometry", f"how far are front and rear wheels apart? Nothing tells it ({matters}); {base:g} m stand in."
        )
    scale = track / max(max(p.y for p in places.values()) - min(p.y for p in places.values()), 1e-9)
    return {w: replace(p, y=round(p.y * scale, 4)) for w, p in places.items()}


def _base_by_yaw(
    draft: Draft, places: Mapping[str, WheelGeometry], found: Signals | None, by_wheels: Measured | None
) -> float | None:
    """Wheelbase [m] by how the machine turns beside its measured or commanded angles; None where nothing tells it."""
    base = Geometry(dict(places), 1.0).steering_base
    asked = None if found is None or base is None else base_by_yaw(found, abs(base))
    turned = by_wheels or asked
    if turned is None or not _TRACKS[0] <= abs(turned.length) <= _BASES:
        return None
    length = float(_round(abs(turned.length)))
    draft.ask("geometry", f"are front and rear wheels {length:g} m apart? By {turned.by}. Measure it.")
    if turned.length < 0:
        which, what = ("measured", "steer.*.phi") if turned is by_wheels else ("commanded", "cmd.omega")
        draft.ask(
            "signals",
            f"is the {which} steering angle positive to the right? The machine turns against it; give {what} gain = -1.",
        )
    return length


def _sides(
    draft: Draft, wheels: Sequence[str], motions: Mapping[str, WheelMotion]
) -> Mapping[str, WheelGeometry] | None:
    """Sides of wheels whose names say none, from how their speeds follow turns."""
    sides = {w: m.y for w in wheels if (m := motions.get(f"wheel.{w}.v")) is not None and m.y is not None}
    if set(sides) != set(wheels) or max(map(abs, sides.values())) > _TRACKS[1] / 2:
        draft.ask("geometry", "where are the wheels? Neither names nor turns tell; without places no turn is compared.")
        return None
    draft.ask("geometry", "where are the wheels? Their sides follow from how they answer turns; nothing tells x.")
    return {w: WheelGeometry(0.0, float(_round(y)), 0.0, "fixed") for w, y in sides.items()}


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
    more = abs(value - _HEADROOM * reached) < 0.01 * value
    how = "is a fifth more than" if more else "stands in, and is no measure beside"
    draft.ask(
        "geometry",
        f"how far do the wheels steer? max_steer = {value:g} rad {how} the {reached:.3g} rad that this log shows.",
    )
    return value
