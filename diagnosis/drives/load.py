"""Extra load of a drive: effort beyond what healthy missions needed for the same speed.

The effort of one speed differs from mission to mission (temperature, wear) and drifts slowly within one; an extra load
comes and goes. A small hidden Markov model over steps of one second keeps the two apart: the mission's own offset moves
as a random walk, the load stays or jumps to another level. Loss of effectiveness and extra load are the same evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.drives.echo import DriveRecord
from replay.machine.drive_model import EffortMap

Array = NDArray[np.float64]

STEP_S = 1.0
_LEAST_STEPS = 5
_OFFSETS = 61  # grid of the mission's offset, ±3 standard deviations
_LEVELS = np.r_[0.0, np.geomspace(0.02, 0.6, 14)]  # extra load [share of the healthy effort]
_LOADED = 0.15  # prior share of loaded steps
_CHANGE = 0.04  # probability that the load changes in a step


@dataclass(frozen=True)
class LoadTrack:
    """Extra load step by step; shapes (steps,).

    Attributes
    ----------
    probability : Array
        Of any extra load; NaN where nothing is driven.
    level : Array
        Expected extra effort [unit of effort].
    expected : Array
        Healthy effort of the step's speed, with the mission's own offset [unit of effort].
    length : int
        Samples per step; the last, incomplete step is left out.
    """

    probability: Array
    level: Array
    expected: Array
    length: int

    def sampled(self, values: Array, size: int) -> Array:
        """Values of the steps for every sample, shape (size,).

        A step without value takes that of a neighbour, and so does the incomplete last one.
        """
        if not values.size:
            return np.full(size, np.nan)
        earlier, later = np.r_[np.nan, values[:-1]], np.r_[values[1:], np.nan]
        filled = np.where(np.isfinite(values), values, np.where(np.isfinite(earlier), earlier, later))
        return filled[np.minimum(np.arange(size) // self.length, values.size - 1)]


def step_means(record: DriveRecord, least_speed: float) -> tuple[Array, Array, int]:
    """Mean |v| and effort along it in steps of one second; NaN where less than 90 % of a step is driven."""
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
    return EffortMap(float(theta[0]), float(theta[1]), between, float(drift / np.sqrt(STEP_S)), noise)


def track_load(record: DriveRecord, effort: EffortMap, least_speed: float) -> LoadTrack:
    """Probability and size of an extra load over a mission, by everything before and after each step.

    Parameters
    ----------
    record : DriveRecord
        The mission.
    effort : EffortMap
        From healthy missions.
    least_speed : float
        Commanded speed from which the drive is driven [m/s].
    """
    speed, used, length = step_means(record, least_speed)
    steps = np.flatnonzero(np.isfinite(speed))
    nan = np.full(speed.size, np.nan)
    if not steps.size:
        return LoadTrack(nan, nan.copy(), nan.copy(), length)
    healthy = effort.offset + effort.slope * speed[steps]
    reference = float(np.median(np.abs(healthy)))
    offsets = np.linspace(-3.0, 3.0, _OFFSETS) * max(effort.between, effort.noise)
    levels = _LEVELS * reference
    excess = used[steps] - healthy
    width = np.hypot(effort.noise, np.r_[0.0, np.diff(levels)] / 4)
    z = (excess[:, None, None] - offsets[:, None] - levels) / width
    like = 0.9 * np.exp(-0.5 * z**2) / width + 0.1 * np.exp(-0.5 * (z / 5) ** 2) / (5 * width)
    start = np.exp(-0.5 * (offsets / max(effort.between, effort.noise)) ** 2)
    loaded = np.r_[1 - _LOADED, np.full(levels.size - 1, _LOADED / (levels.size - 1))]
    first = start[:, None] * loaded
    first /= first.sum()
    walk = [_walk(offsets, effort, gap) for gap in np.diff(steps)]
    forward, backward = np.empty_like(like), np.empty_like(like)
    forward[0] = first * like[0]
    for k in range(steps.size - 1):
        forward[k] /= forward[k].sum()
        forward[k + 1] = _changed(walk[k].T @ forward[k], loaded) * like[k + 1]
    forward[-1] /= forward[-1].sum()
    backward[-1] = 1.0
    for k in range(steps.size - 1, 0, -1):
        ahead = backward[k] * like[k]
        back = (1 - _CHANGE) * ahead + _CHANGE * (ahead @ loaded)[:, None]
        backward[k - 1] = walk[k - 1] @ back
        backward[k - 1] /= backward[k - 1].max()
    posterior = forward * backward
    posterior /= posterior.sum(axis=(1, 2), keepdims=True)
    by_level, by_offset = posterior.sum(axis=1), posterior.sum(axis=2)
    probability, level, expected = nan.copy(), nan.copy(), nan.copy()
    probability[steps] = 1 - by_level[:, 0]
    level[steps] = by_level @ levels
    expected[steps] = healthy + by_offset @ offsets
    return LoadTrack(probability, level, expected, length)


def _walk(offsets: Array, effort: EffortMap, gap: int) -> Array:
    """Transition of the mission's offset over `gap` steps, shape (offsets, offsets): rows sum to 1."""
    spread = max(effort.drift * np.sqrt(STEP_S * gap), 0.3 * float(offsets[1] - offsets[0]))
    out = np.exp(-0.5 * ((offsets[:, None] - offsets) / spread) ** 2)
    return np.asarray(out / out.sum(axis=1, keepdims=True), dtype=np.float64)


def _changed(state: Array, loaded: Array) -> Array:
    """Let the load stay or jump to a level by its prior."""
    return np.asarray((1 - _CHANGE) * state + _CHANGE * state.sum(axis=1, keepdims=True) * loaded, dtype=np.float64)
