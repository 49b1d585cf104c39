"""How wheels and body move together: the geometry in motion, the speed of the body by the wheels, wheels that slip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.parity import slipping
from replay.arrays.quantiles import median_of, quantile_of
from replay.control.kinematics import low_pass, speed_ratios, wheel_angles
from replay.control.loop import Replay, any_finite
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

#: Share of the driving time against the commands beyond which these say nothing of the wheels.
MOST_AGAINST = 0.12
_STEER_HZ = 3.0
_MOVES = 0.1  # of the usual speed, from which a wheel's direction is clear
_MOST_ROWS = 20_000


class Motion(NamedTuple):
    """How the wheels move with the body, each of shape (n, wheels).

    Attributes
    ----------
    ratio : Array
        Wheel speed per speed of the body [1].
    turn : Array
        What each wheel rolls less because it steers [m/s].
    """

    ratio: Array
    turn: Array


def body_speeds(y: Array, ratio: Array, turn: Array) -> Array:
    """Speed at which each wheel would roll by the median of the other wheels [m/s], shape (n, wheels)."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        speed = (y + turn) / ratio
    out = np.full(y.shape, np.nan)
    for i in range(y.shape[1]):
        others = np.delete(speed, i, axis=1)
        known = np.isfinite(others).all(axis=1)
        if others.shape[1] and known.any():
            out[known, i] = median_of(others[known], axis=1) * ratio[known, i] - turn[known, i]
    return out


def against_command(y: Array, reference: Array) -> float:
    """Share of its driving time in which a wheel turns against its command: the median of the wheels [1].

    A controller that follows its commands is there for moments after they change sign, and a sensor that is wrong is one of
    several. A law that is unstable in reverse, as the printed one, drives all wheels away from their commands.

    Parameters
    ----------
    y, reference : Array, shape (n, wheels)
        Measured and commanded speed [m/s]; NaN where unknown.
    """
    step = max(1, len(y) // _MOST_ROWS)
    v, r = np.nan_to_num(y[::step]), np.nan_to_num(reference[::step])
    commanded = np.abs(r[r != 0.0])
    if not commanded.size:
        return 0.0
    least = _MOVES * float(quantile_of(commanded, 0.9))
    driving = (np.abs(v) > least) & (np.abs(r) > least)
    against = (driving & (v * r < 0.0)).sum(axis=0)
    seen = driving.sum(axis=0)
    return float(median_of(against[seen > 0] / seen[seen > 0])) if seen.any() else 0.0


def slip_of(
    timeline: Timeline,
    replay: Replay,
    machine: Machine,
    v: Array,
    angle: Array,
    motion: Motion,
    doubtful: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Where a wheel breaks the parity of the body; nowhere without geometry, or where an axle's angle is in doubt.

    Shape (n, wheels); `v` likewise in m/s, `angle` of shape (n, axles) in rad, from which `motion` is; `doubtful` of shape (n, axles).
    """
    geometry = machine.geometry
    if geometry is None or v.shape[1] < 4 or not any_finite(v).all() or not any_finite(angle).all():
        return np.zeros(v.shape, dtype=np.bool_)
    least = 2.5 * machine.limits.min_sat
    turned = timeline.map(lambda a: wheel_angles(a, geometry), angle)
    slip = slipping(v, angle, replay.phi_ref, motion.ratio, turned, geometry, timeline.dt, least, timeline.store)
    return timeline.map(lambda s, d: s & ~d.any(axis=1)[:, None], slip, doubtful)


def in_motion(angle: Array, machine: Machine, timeline: Timeline) -> Motion:
    """How the wheels move with the body; NaN and 0 where no geometry tells. `angle` of shape (n, axles) in rad."""
    wheels = len(machine.wheels)
    geometry = machine.geometry
    if geometry is None or not any_finite(angle).all():
        return Motion(*(np.broadcast_to(x, (timeline.size, wheels)) for x in (np.nan, 0.0)))
    offset, dt = np.array([w.offset for w in geometry.wheels.values()]), timeline.dt

    def turning(state: tuple[Array, list[float]], angle: Array) -> tuple[tuple[Array], tuple[Array, list[float]]]:
        """The state is the wheels' last angles [rad] and their low-passed rates [rad/s]."""
        before, rates = state
        turned = wheel_angles(angle, geometry)
        rate = np.diff(turned, axis=0, prepend=before) / dt
        smooth = np.stack([low_pass(rate[:, i], dt, _STEER_HZ, rates[i]) for i in range(wheels)], axis=1)
        return (smooth * offset,), (turned[-1:], [float(x) for x in smooth[-1]])

    (turn,), _ = timeline.scan(turning, (wheel_angles(angle[:1], geometry), [np.nan] * wheels), angle)
    return Motion(timeline.map(lambda a: speed_ratios(a, geometry), angle), turn)
