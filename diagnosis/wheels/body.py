"""What sensors of the body say of every wheel: the speed at which it rolls, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.body.rolling import Rolling
from diagnosis.body.sources import body_sensors
from diagnosis.body.speed import BodySpeed, body_speed
from diagnosis.wheels.blocks import WheelBlocks, block_width
from diagnosis.wheels.motion import Motion
from replay.arrays.blocks import block_means, release
from replay.control.kinematics import low_pass, rotation
from replay.control.loop import any_finite
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_COMMAND_HZ = 0.5  # how a machine follows its command, about


def measured_body(
    timeline: Timeline, machine: Machine, y: Array, v_ref: Array, angle: Array, motion: Motion
) -> MeasuredBody | None:
    """Speed of the body by its own sensors; None where the log has none, or nothing tells how wheels and body move together.

    Parameters
    ----------
    timeline, machine
        The mission.
    y, v_ref : Array, shape (n, wheels)
        Measured and commanded speeds [m/s].
    angle : Array, shape (n, axles)
        Best estimate of the axles' angles [rad].
    motion : Motion
        From `in_motion` by it.
    """
    if machine.geometry is None or not angle.shape[1] or not any_finite(angle).all():
        return None
    width = min(block_width(timeline.dt), timeline.size)
    sensors = body_sensors(timeline, width)
    if not sensors.any:
        return None
    found = body_speed(sensors, _rolling(timeline, machine, y, v_ref, *motion, angle, width))
    return MeasuredBody(found, np.array([abs(w.y) + abs(w.offset) for w in machine.geometry.wheels.values()]))


def _rolling(
    timeline: Timeline,
    machine: Machine,
    y: Array,
    v_ref: Array,
    ratio: Array,
    turn: Array,
    angle: Array,
    width: int,
) -> Rolling:
    """The body by its wheels, block by block; parameters as in `measured_body`."""
    geometry = machine.geometry
    assert geometry is not None
    parts = []
    for cut in timeline.blocks(width):
        share, less = block_means(ratio[cut], width), block_means(turn[cut], width)
        axles = block_means(angle[cut], width)
        curvature, lateral = rotation(axles, geometry)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            by_wheel = (block_means(y[cut], width) + less) / share
            commanded = np.median((block_means(v_ref[cut], width) + less) / share, axis=1)
        parts.append((by_wheel, commanded, np.nan_to_num(curvature), np.nan_to_num(lateral)))
        release(y, v_ref, ratio, turn, angle)
    by_wheel, command, curvature, lateral = (np.concatenate(column) for column in zip(*parts, strict=True))
    dt = width * timeline.dt
    command = np.where(np.isfinite(command), low_pass(command, dt, _COMMAND_HZ), np.nan)
    return Rolling(
        dt=dt,
        by_wheel=np.where(np.isfinite(by_wheel), by_wheel, np.nan),
        command=command,
        curvature=curvature,
        lateral=lateral,
        top=machine.max_speed,
    )


@dataclass(frozen=True)
class MeasuredBody:
    """The body by its own sensors, and what each wheel makes of it.

    Attributes
    ----------
    body : BodySpeed
        Of n blocks.
    arms : Array, shape (wheels,)
        By how much a wheel's speed changes with the yaw rate [m].
    """

    body: BodySpeed
    arms: Array


def with_body(blocks: WheelBlocks, found: MeasuredBody | None) -> WheelBlocks:
    """The blocks with the speed at which each wheel rolls by sensors of the body, where they say anything."""
    if found is None or not found.body.known:
        return blocks
    speed, std = rolling_speeds(found, blocks.ratio, blocks.turn)
    return replace(blocks, body_speed=speed, body_std=std)


def rolling_speeds(found: MeasuredBody, ratio: Array, turn: Array) -> tuple[Array, Array]:
    """Speed at which each wheel rolls by sensors of the body, and its standard deviation [m/s]; all of shape (n, wheels)."""
    body, n = found.body, min(found.body.speed.size, ratio.shape[0])
    speed, std = np.full(ratio.shape, np.nan), np.full(ratio.shape, np.nan)
    speed[:n] = body.speed[:n, None] * ratio[:n] - turn[:n]
    std[:n] = np.hypot(body.std[:n, None] * np.abs(ratio[:n]), body.yaw_doubt[:n, None] * found.arms)
    std[~np.isfinite(speed)] = np.nan
    return speed, std
