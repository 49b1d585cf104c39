"""Which source tells the driven path and the driven distance: not one that stands still while others show the machine moving."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.plain_numbers import plain
from replay.arrays.envelope import shown
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

EARTH_RADIUS_M = 6_371_008.8
_STEP_S = 5.0  # between positions that are compared: receivers may be as slow
_MOVES = 0.5  # of the way at driving speed in a step, from which on a source moves
_LEAST_M = 2.0  # of way by another source, for a source to be dead beside it
_JITTER_M = 2.0  # of a satellite receiver at rest, in a step
_FAR_M = 20.0  # that it must go before it says that a machine moves
_MOSTLY = 0.5  # of the way by another source, in which a dead one does not change at all
_NAMES = {"odometry": "odometry", "GNSS": "GNSS", "wheels": "the wheels' speeds"}


class Way(NamedTuple):
    """Where the path and the distance come from.

    Attributes
    ----------
    positions : str
        Source of the path, ``odometry`` or ``GNSS``; empty where there is none that moves.
    path_note : str
        Why a source of positions that is in the log was left out; empty where none was.
    distance_m : float or None
        Driven distance [m]; None where neither a wheel's speed is logged nor anything else took its place.
    distance_note : str
        Where the distance comes from, and why, where it is not from the wheels' speeds.
    """

    positions: str
    path_note: str
    distance_m: float | None
    distance_note: str


def path_of(timeline: Timeline, machine: Machine) -> dict[str, Array]:
    """The machine's path [m] for pictures, from odometry, else from GNSS on a local plane; empty where neither says anything.

    Each of the rows of its envelope, shape (rows,).
    """
    source = way_of(timeline, machine).positions
    found = _odometry(timeline) if source == "odometry" else _gnss(timeline) if source else None
    return {} if found is None else {"path.x": shown(found[0]), "path.y": shown(found[1])}


def way_of(timeline: Timeline, machine: Machine) -> Way:
    """Choose the sources of path and distance.

    Odometry comes before GNSS, and the wheels' speeds tell the distance, unless they are dead: a source is dead that does not change
    at all in most of the way of another.
    """
    width = max(1, round(_STEP_S / timeline.dt))
    positions = {
        name: xy for name, xy in (("odometry", _odometry(timeline)), ("GNSS", _gnss(timeline))) if xy is not None
    }
    changes = {name: _between(*xy, width) for name, xy in positions.items()}
    rolled, distance = _rolled(timeline, machine, width)
    if rolled is not None:
        changes["wheels"] = rolled
    moved = {name: _moved(name, way, machine) for name, way in changes.items()}
    dead = {name: by for name in changes if (by := _beside(name, changes, moved))}
    alive = [name for name in positions if name not in dead]
    out = [name for name in positions if name in dead and (not alive or name == "odometry")]
    path_note = " ".join(
        f"{_NAMES[name][0].upper()}{_NAMES[name][1:]} stands still where {_NAMES[dead[name][0]]} "
        f"{'show' if dead[name][0] == 'wheels' else 'shows'} {plain(dead[name][1])} m of way, and is not used."
        for name in out
    )
    note = ""
    if distance is not None and "wheels" in dead and alive:
        first = alive[0]
        distance = sum(_anchored(*positions[first], width, _JITTER_M if first == "GNSS" else 0.0))
        note = f"by {_NAMES[first]}, from positions {_STEP_S:g} s apart: the wheels' speeds do not change where it shows way"
    return Way(alive[0] if alive else "", path_note, distance, note)


def _odometry(timeline: Timeline) -> tuple[Array, Array] | None:
    x, y = timeline.get("odom.x"), timeline.get("odom.y")
    return None if x is None or y is None or not np.isfinite(x).any() else (x, y)


def _gnss(timeline: Timeline) -> tuple[Array, Array] | None:
    """Positions to the east and to the north of the first fix [m]."""
    lat, lon = timeline.get("gnss.lat"), timeline.get("gnss.lon")
    if lat is None or lon is None:
        return None
    both = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon))
    if not both.size:
        return None
    k = int(both[0])
    north = np.radians(lat - lat[k]) * EARTH_RADIUS_M
    return np.radians(lon - lon[k]) * EARTH_RADIUS_M * np.cos(np.radians(lat[k])), north


def _held(x: Array, width: int) -> Array:
    """The value at the start and at the end of each step of `width` samples, or the last one known, shape (steps + 1,)."""
    ends = np.r_[x[:1], x[width::width], x[-1:]]
    at = np.maximum.accumulate(np.where(np.isfinite(ends), np.arange(ends.size), -1))
    return np.where(at < 0, np.nan, ends[np.maximum(at, 0)])


def _between(x: Array, y: Array, width: int) -> Array:
    """Way between positions a step apart [m], shape (steps,); NaN where unknown."""
    return np.hypot(np.diff(_held(x, width)), np.diff(_held(y, width)))


def _anchored(x: Array, y: Array, width: int, least: float) -> list[float]:
    """Ways of more than `least` from position to position."""
    points = _held(x, width) + 1j * _held(y, width)
    points = points[np.isfinite(points)]
    out, anchor = [], points[0]
    for p in points[1:]:
        if abs(p - anchor) > least:
            out.append(float(abs(p - anchor)))
            anchor = p
    return out


def _rolled(timeline: Timeline, machine: Machine, width: int) -> tuple[Array | None, float | None]:
    """Way of the middle of the wheels in each step, and the distance by the mean of their speeds [m]; None without a wheel's speed."""
    speeds = [timeline.signals[n] for w in machine.wheels if (n := f"wheel.{w}.v") in timeline.signals]
    if not speeds:
        return None, None
    distance, ways = 0.0, []
    for part in timeline.blocks(width):
        near = np.array([v[part] for v in speeds])
        count = np.maximum(np.isfinite(near).sum(axis=0), 1)
        distance += float((np.nansum(np.abs(near), axis=0) / count).sum()) * timeline.dt
        middle = np.nansum(near, axis=0) / count
        whole = np.pad(middle, (0, -middle.size % width)).reshape(-1, width)
        ways.append(np.abs(whole.sum(axis=1)) * timeline.dt)
    return np.concatenate(ways), distance


def _moved(name: str, way: Array, machine: Machine) -> Array:
    """Way [m] in the steps in which a source shows the machine moving, 0 in all others."""
    least = max(_MOVES * machine.limits.driving_speed * _STEP_S, _JITTER_M if name == "GNSS" else 0.0)
    out = np.where(np.nan_to_num(way) > least, np.nan_to_num(way), 0.0)
    return out if name != "GNSS" or out.sum() > _FAR_M else np.zeros_like(out)


def _beside(name: str, changes: Mapping[str, Array], moved: Mapping[str, Array]) -> tuple[str, float] | None:
    """The source beside which one is dead, and the way [m] that it shows meanwhile; None where it is alive."""
    for other, way in moved.items():
        if other == name:
            continue
        still = float(way[changes[name] == 0.0].sum())
        if still >= _LEAST_M and still > _MOSTLY * way[np.isfinite(changes[name])].sum():
            return other, still
    return None
