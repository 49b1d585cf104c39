"""Sensors of the body in the log: positions of a satellite receiver or of odometry, speed over ground, yaw rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.body.positions import Positions, on_plane
from replay.arrays.blocks import release
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodySensors:
    """What the log holds.

    Attributes
    ----------
    positions : Mapping[str, Positions]
        Fixes by the name of their sensor, ``satellite positions`` and ``odometry``.
    speed : tuple[Array, Array] or None
        Times [s] and values [m/s] of a speed over ground.
    yaw_rate : Array, shape (blocks,), or None
        Mean measured yaw rate of each block [rad/s]; NaN where none is known.
    """

    positions: Mapping[str, Positions]
    speed: tuple[Array, Array] | None
    yaw_rate: Array | None

    @property
    def any(self) -> bool:
        """Whether there is any that says something of the speed."""
        return bool(self.positions) or self.speed is not None


def body_sensors(timeline: Timeline, width: int) -> BodySensors:
    """Sensors of the body, read off the timeline; `width` is the number of samples in a block."""
    positions = {}
    found = _samples(timeline, ("gnss.lat", "gnss.lon"))
    if found is not None:
        positions["satellite positions"] = on_plane(*found)
    found = _samples(timeline, ("odom.x", "odom.y"))
    if found is not None:
        positions["odometry"] = Positions(found[0], found[1] + 1j * found[2])
    speed = _samples(timeline, ("gnss.speed",))
    yaw_rate = None
    rate = timeline.get("imu.yaw_rate")
    if rate is not None and any(np.isfinite(rate[part]).any() for part in timeline.blocks()):
        yaw_rate = _block_means(timeline, rate, width)
    return BodySensors(positions, None if speed is None else (speed[0], speed[1]), yaw_rate)


def _samples(timeline: Timeline, names: Sequence[str]) -> tuple[Array, ...] | None:
    """Times [s] of new samples, and the values of some signals at them; None where one of them has none."""
    if any(name not in timeline.signals for name in names):
        return None
    parts = []
    for cut in timeline.blocks():
        values = [timeline.signals[name][cut] for name in names]
        new = timeline.fresh[names[0]][cut].copy()
        for v in values:
            new &= np.isfinite(v)
        at = np.flatnonzero(new)
        parts.append(((at + cut.start) * timeline.dt, *(v[at] for v in values)))
        release(*values)
    whole = tuple(np.concatenate(column) for column in zip(*parts, strict=True))
    return whole if whole[0].size else None


def _block_means(timeline: Timeline, values: Array, width: int) -> Array:
    """Mean of the known samples of each block."""
    out = []
    for cut in timeline.blocks(width):
        part = values[cut]
        filled = np.pad(part, (0, -part.size % width), mode="edge").reshape(-1, width)
        known = np.isfinite(filled)
        count = known.sum(axis=1)
        mean = np.where(known, filled, 0.0).sum(axis=1) / np.maximum(count, 1)
        out.append(np.where(count > 0, mean, np.nan))
        release(values)
    return np.concatenate(out)
