"""Effort that a healthy drive needs for a speed, identified from healthy missions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.drives.inputs import DriveRecord
from replay.machine.drive_model import EffortMap

Array = NDArray[np.float64]

STEP_S = 1.0
_LEAST_STEPS = 5


def step_means(record: DriveRecord, least_speed: float) -> tuple[Array, Array, int]:
    """Mean |v| and effort along it in steps of one second; NaN where less than 90 % of a step is driven.

    Both of shape (steps,), and the samples in a step; `least_speed` in m/s.
    """
    length = max(1, round(STEP_S / record.dt))
    count = record.y.size // length
    y, u = record.y[: count * length].reshape(count, length), record.u[: count * length].reshape(count, length)
    command = record.command[: count * length].reshape(count, length)
    good = np.isfinite(y) & np.isfinite(u) & np.isfinite(command) & (np.abs(command) > least_speed)
    enough = good.mean(axis=1) >= 0.9
    number = np.maximum(good.sum(axis=1), 1)
    speed = np.where(good, np.abs(y), 0.0).sum(axis=1) / number
    effort = np.where(good, u * np.sign(command), 0.0).sum(axis=1) / number
    return np.where(enough, speed, np.nan), np.where(enough, effort, np.nan), length


def identify_effort(records: Sequence[DriveRecord], least_speed: float) -> EffortMap | None:
    """Effort map of a drive from several healthy missions; None where fewer than three were driven for five seconds.

    Parameters
    ----------
    records : Sequence[DriveRecord]
        Healthy missions.
    least_speed : float
        Commanded speed from which a drive is driven [m/s].
    """
    missions = []
    for record in records:
        speed, effort, _ = step_means(record, least_speed)
        known = np.isfinite(speed)
        if np.count_nonzero(known) >= _LEAST_STEPS:
            missions.append((speed[known], effort[known]))
    if len(missions) < 3:
        return None
    centre = np.array([np.median(s) for s, _ in missions])
    held = np.array([np.median(e) for _, e in missions])
    design = np.column_stack([np.ones(centre.size), centre])
    if float(np.ptp(centre)) < 0.2 * float(np.mean(centre)):
        design[:, 0] = 0.0  # one speed: a line through zero, good for that speed alone
    weight: Array = np.ones(centre.size)
    theta: Array = np.zeros(2)
    for _ in range(10):
        theta = np.asarray(np.linalg.lstsq(design * weight[:, None], held * weight, rcond=None)[0], dtype=np.float64)
        rest = np.abs(held - design @ theta)
        weight = np.sqrt(1 / np.maximum(rest, 0.3 * float(np.median(rest)) + 1e-12))
    between = float(np.sqrt(np.mean((held - design @ theta) ** 2) * centre.size / max(centre.size - 2, 1)))
    # first differences: 2·noise² + drift²; differences over eight steps: 2·noise² + 8·drift²
    one = np.concatenate([np.diff(e - theta[1] * s) for s, e in missions])
    eight = np.concatenate(
        [(e - theta[1] * s)[8:] - (e - theta[1] * s)[:-8] for s, e in missions if s.size > 8] or [one]
    )
    near, far = float(np.median(np.abs(one))) * 1.4826, float(np.median(np.abs(eight))) * 1.4826
    drift = float(np.sqrt(max((far**2 - near**2) / 7, (0.02 * near) ** 2)))
    noise = float(np.sqrt(max((near**2 - drift**2) / 2, (0.1 * near) ** 2)))
    driven = np.concatenate([s for s, _ in missions])
    return EffortMap(
        offset=float(theta[0]),
        slope=float(theta[1]),
        between=between,
        drift=float(drift / np.sqrt(STEP_S)),
        noise=noise,
        slowest=float(np.min(driven)),
        fastest=float(np.max(driven)),
    )
