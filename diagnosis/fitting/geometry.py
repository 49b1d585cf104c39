"""Wheel offset d from healthy turning: v_i = s·|v_k| − (ω_b + φ̇)·d_i (L1 (1)) with measured speeds and angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum
from diagnosis.fitting.robust import Estimate, equal_weights, jackknife, robust_solve, solve
from replay.control.kinematics import rotation, wheel_angles
from replay.control.loop import stack
from replay.machine.config import Machine
from replay.machine.geometry import Geometry
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_BLOCK_S = 0.25
_EDGE_S = 0.02
_SLIP = 0.04  # share of φ̇·d that slip and a lagging loop take or add
_LEAST = 30
_MOST, _MOST_STD = 1.5, 0.05  # m
_LEAST_LEVER = 0.02
_MOST_APART = 0.12  # what slip in held turns makes of the offset, seen up to 0.1 m, against that from steering [m]
_SURE = 2.0
_FULL = 20


def offset_pattern(machine: Machine) -> Array:
    """Share of the common offset that each wheel has: as in the geometry, else outwards (left positive).

    Shape (wheels,), shares [1].
    """
    assert machine.geometry is not None
    places = list(machine.geometry.wheels.values())
    given = np.array([w.offset for w in places])
    return given / np.abs(given).max() if given.any() else np.array([np.sign(w.y) for w in places])


def fit_offset(timelines: Sequence[Timeline], machine: Machine, bad: set[str]) -> tuple[Estimate, int, tuple[int, ...]]:
    """Fit the common wheel offset |d|.

    Every block of a quarter second gives as many equations as wheels; the body's forward speed is taken out of them.
    In a held turn, slip and tracking errors of inner and outer wheels look like an offset, so the part of ω_b has a
    coefficient of its own and d comes from φ̇.

    Parameters
    ----------
    timelines : Sequence[Timeline]
        Aligned missions.
    machine : Machine
        Its joints' places; the offsets' signs, or outwards where they are 0.
    bad : set[str]
        Signals with a unit error.

    Returns
    -------
    Estimate
        |d| [m].
    int
        Blocks used.
    tuple[int, ...]
        Missions that they come from.
    """
    none = Estimate(float("nan"), float("nan"), "no geometry in the machine file"), 0, ()
    if machine.geometry is None:
        return none
    wheels, axles = machine.wheels, machine.axles
    used = [f"wheel.{w}.v" for w in wheels] + [f"steer.{a}.phi" for a in axles]
    if bad & set(used):
        return _nothing(f"{sorted(bad & set(used))[0]} has a wrong unit")
    if not axles or len(wheels) < 3:
        return _nothing("it takes three wheels and a steered axle")
    stacked = _stacked(timelines, machine, used, machine.geometry)
    if stacked is None:
        return _nothing("speeds of all wheels and all steering angles are not logged together")
    x, y, mission, part = stacked  # (blocks, wheels, 2), (blocks, wheels), (blocks,), (blocks,)
    turning = np.abs(x[..., 1]).max(axis=1, initial=0.0) > _LEAST_LEVER
    if np.count_nonzero(turning) < _LEAST:
        return _nothing("not excited: the missions hold no steering while driving")
    x, y = x[turning].reshape(-1, 2), y[turning].ravel()
    wheels_each = y.size // np.count_nonzero(turning)
    mission, part = (np.repeat(g[turning], wheels_each) for g in (mission, part))
    weight = equal_weights(mission, _FULL)
    d, agree = robust_solve(x, x, y, weight, 0.1 * float(np.median(np.abs(y))) + 1e-9)
    good = agree > 0
    if not np.isfinite(d).all() or np.mean(good) < 2 / 3:
        return _nothing("wheel speeds and angles contradict each other in too many blocks")
    groups = mission[good] if np.unique(mission).size >= 4 else part[good]
    std = jackknife(groups, lambda k: solve(x[good][k], x[good][k], y[good][k], weight[good][k]))
    found = tuple(sorted(set(mission[good].tolist())))
    why = f"from steering movements; turning at held angles would give {d[0]:.3g} m, slip and tracking included"
    if abs(d[1]) > _MOST or not std[1] < _MOST_STD:
        return _nothing(f"too uncertain: {d[1]:.2g} ± {std[1]:.2g} m")
    apart, doubt = abs(float(d[1] - d[0])), _SURE * float(np.hypot(std[0], std[1]))
    if apart > max(_MOST_APART, 0.5 * float(np.abs(d).max()), doubt):
        return _nothing(
            f"steering movements give {d[1]:.3g} ± {std[1]:.2g} m, turning at held angles {d[0]:.3g} ± {std[0]:.2g} m: they "
            "contradict each other"
        )
    spread = float(np.hypot(std[1], _SLIP * d[1]))
    return Estimate(float(d[1]), spread, why), int(np.count_nonzero(turning)), found


def _stacked(
    timelines: Sequence[Timeline], machine: Machine, used: list[str], geometry: Geometry
) -> tuple[Array, Array, NDArray[np.int64], NDArray[np.int64]] | None:
    """Levers and speeds of all missions' blocks, the mission of each and its tenth of that; None without any."""
    count = len(machine.wheels)
    levers: list[Array] = []
    speeds: list[Array] = []
    missions: list[NDArray[np.int64]] = []
    parts: list[NDArray[np.int64]] = []
    for m, timeline in enumerate(timelines):
        v, phi = stack(timeline, used[:count]), stack(timeline, used[count:])
        if not (np.isfinite(v).any(axis=0).all() and np.isfinite(phi).any(axis=0).all()):
            continue
        lever, speed = _equations(v, phi, geometry, offset_pattern(machine), timeline.dt)
        levers.append(lever)
        speeds.append(speed)
        missions.append(np.full(len(lever), m, dtype=np.int64))
        parts.append(len(parts) * 10 + np.arange(len(lever)) * 10 // max(1, len(lever)))
    if not levers:
        return None
    return np.concatenate(levers), np.concatenate(speeds), np.concatenate(missions), np.concatenate(parts)


def _nothing(why: str) -> tuple[Estimate, int, tuple[int, ...]]:
    return Estimate(float("nan"), float("nan"), why), 0, ()


def _equations(v: Array, phi: Array, geometry: Geometry, pattern: Array, dt: float) -> tuple[Array, Array]:
    """Blocks' equations lever·d = speed with the body's speed projected out.

    Shapes (blocks, wheels, 2), with the levers of turning and of steering apart, and (blocks, wheels).
    """
    length = max(1, round(_BLOCK_S / dt))
    count = v.shape[0] // length
    means = [x[: count * length].reshape(count, length, -1).mean(axis=1) for x in (v, phi)]
    speed, angle = means  # NaN where a sample is missing
    width = max(1, round(_EDGE_S / dt))
    smooth = np.column_stack([moving_sum(x, width) / width for x in phi.T])
    edges = smooth[np.minimum(np.arange(count + 1) * length, phi.shape[0] - 1)]
    curvature, lateral = rotation(angle, geometry)
    steered = np.diff(wheel_angles(edges, geometry), axis=0) / (length * dt)  # φ̇ of each wheel, mean over the block
    ratio = np.empty_like(speed)
    for i, w in enumerate(geometry.wheels.values()):
        k_x, k_y = 1.0 - curvature * w.y, lateral + curvature * w.x
        ratio[:, i] = k_x if w.axle == "fixed" else np.sign(k_x) * np.hypot(k_x, k_y)
    lever_turn, lever_steer = -curvature[:, None] * pattern, -steered * pattern
    forward = (speed * ratio).sum(axis=1) / (ratio * ratio).sum(axis=1)
    lever = lever_turn * forward[:, None] + lever_steer
    # the body's speed is free: remove the direction of the ratios
    unit = ratio / np.sqrt((ratio * ratio).sum(axis=1))[:, None]

    def without(q: Array) -> Array:
        return np.asarray(q - unit * (q * unit).sum(axis=1)[:, None])

    lever = np.stack([without(lever_turn * forward[:, None]), without(lever_steer)], axis=2)
    rest = without(speed)
    known = np.isfinite(lever).all(axis=(1, 2)) & np.isfinite(rest).all(axis=1)
    known &= np.abs(forward) > 0.05 * np.nanmax(np.abs(speed), initial=1e-9)
    return lever[known], rest[known]
