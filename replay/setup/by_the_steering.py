"""Track and wheelbase of a machine that steers, by the speeds and angles of its wheels beside the yaw rate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.log.source_options import SignalSource
from replay.machine.geometry import WheelGeometry
from replay.setup.by_the_body import Measured, gain_of, moments, rim
from replay.setup.motion import held
from replay.signals.signal import Signals

Array = NDArray[np.float64]

_LEAST = 0.02  # rad: steered by less, an axle tells nothing of the wheelbase
_BY = "the yaw rate beside the speeds and angles of the wheels"


class Lengths(NamedTuple):
    """Track and wheelbase; None where nothing tells one. A negative wheelbase: the angles run against the turns."""

    track: Measured | None
    base: Measured | None


def lengths_by_yaw(
    found: Signals, places: Mapping[str, WheelGeometry], radius: float, origins: Mapping[str, SignalSource]
) -> Lengths:
    """Lengths by which a rigid body would move as its wheels, which do not slip to the side, say that it turns.

    What the left wheels run slower than the right ones along the machine is the yaw rate × the track; what the front wheels move to the
    left more than the rear ones is the yaw rate × the wheelbase.

    Parameters
    ----------
    found : Signals
        With rotations of the wheels in rad/s, or speeds of their rims in m/s, angles in rad, positive to the left, and a yaw rate in rad/s.
    places : Mapping[str, WheelGeometry]
        Sides, ends and axles of the wheels.
    radius : float
        Of the wheels [m].
    origins : Mapping[str, SignalSource]
        Of all signals, with a negative gain where a wheel counts backwards.
    """
    yaw = found.items.get("imu.yaw_rate")
    wheels = [w for w, p in places.items() if f"wheel.{w}.v" in found.items and _steers(p, found)]
    if yaw is None or len(wheels) < len(places):
        return Lengths(None, None)
    speeds = {w: found.items[f"wheel.{w}.v"] for w in wheels}
    angles = {w: found.items[f"steer.{p.axle}.phi"] for w, p in places.items() if p.axle != "fixed"}
    at = moments([yaw, *speeds.values(), *angles.values()])
    if not angles or at.size == 0:
        return Lengths(None, None)
    along, across = {}, {}
    for w, signal in speeds.items():
        speed = rim(signal, origins, at, radius)
        phi = held(angles[w], at) if w in angles else np.zeros(at.size)
        along[w], across[w] = speed * np.cos(phi), speed * np.sin(phi)
    turned = held(yaw, at)
    track = _difference(along, [w for w in wheels if places[w].y < 0], [w for w in wheels if places[w].y > 0], turned)
    ends = [p.x for p in places.values()]
    front, rear = ([w for w in wheels if places[w].x == end] for end in (max(ends), min(ends)))
    steered = max((float(np.nanquantile(np.abs(held(a, at)), 0.9)) for a in angles.values()), default=0.0) > _LEAST
    base = _difference(across, front, rear, turned) if max(ends) > min(ends) and steered else None
    return Lengths(
        None if track is None or track <= 0.0 else Measured(track, _BY), None if base is None else Measured(base, _BY)
    )


def _steers(place: WheelGeometry, found: Signals) -> bool:
    """Whether the angle of a wheel is known: it is fixed, or the angle of its axle is logged."""
    return place.axle == "fixed" or f"steer.{place.axle}.phi" in found.items


def _difference(parts: Mapping[str, Array], more: list[str], less: list[str], turned: Array) -> float | None:
    """Distance [m] that makes the difference of two groups of wheels the yaw rate; None where none does."""
    if not more or not less:
        return None
    mean = [np.mean([parts[w] for w in group], axis=0) for group in (more, less)]
    return gain_of(turned, mean[0] - mean[1])
