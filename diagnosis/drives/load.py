"""Extra load of a drive: effort beyond what healthy missions needed for the same speed.

The effort of one speed differs from mission to mission (temperature, wear) and drifts slowly within one; an extra load
comes and goes. A small hidden Markov model over steps of one second keeps the two apart: the mission's own offset moves
as a random walk, the load stays or jumps to another level. Loss of effectiveness and extra load are the same evidence.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.drives.effort_map import STEP_S, step_means
from diagnosis.drives.inputs import DriveRecord
from replay.machine.drive_model import EffortMap

Array = NDArray[np.float64]

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
    covered : Array
        1 where healthy missions drove at the step's speed, 0 where they did not; NaN where nothing is driven.
    length : int
        Samples per step; the last, incomplete step is left out.
    """

    probability: Array
    level: Array
    expected: Array
    covered: Array
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
    track = track_steps(effort.offset + effort.slope * speed, used, effort, length)
    return replace(track, covered=np.where(np.isfinite(speed), effort.covers(speed), np.nan))


def track_steps(needed: Array, used: Array, effort: EffortMap, length: int) -> LoadTrack:
    """The same by steps of one second, all of them at speeds of healthy missions.

    Parameters
    ----------
    needed, used : Array, shape (steps,)
        Effort that the map says for the step's speed, and the one that was used [unit of effort]; NaN where nothing is driven.
    effort : EffortMap
        From healthy missions.
    length : int
        Samples per step.
    """
    steps = np.flatnonzero(np.isfinite(needed))
    nan = np.full(needed.size, np.nan)
    if not steps.size:
        return LoadTrack(nan, nan.copy(), nan.copy(), nan.copy(), length)
    healthy = needed[steps]
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
    return LoadTrack(probability, level, expected, np.where(np.isfinite(needed), 1.0, np.nan), length)


def _walk(offsets: Array, effort: EffortMap, gap: int) -> Array:
    """Transition of the mission's offset over `gap` steps, shape (offsets, offsets): rows sum to 1."""
    spread = max(effort.drift * np.sqrt(STEP_S * gap), 0.3 * float(offsets[1] - offsets[0]))
    out = np.exp(-0.5 * ((offsets[:, None] - offsets) / spread) ** 2)
    return np.asarray(out / out.sum(axis=1, keepdims=True), dtype=np.float64)


def _changed(state: Array, loaded: Array) -> Array:
    """Let the load stay or jump to a level by its prior."""
    return np.asarray((1 - _CHANGE) * state + _CHANGE * state.sum(axis=1, keepdims=True) * loaded, dtype=np.float64)
