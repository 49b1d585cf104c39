"""The speed of the body by one sensor: its noise and delay are found in the mission, then it is smoothed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from diagnosis.body.rolling import CELL_S, Rolling
from diagnosis.body.track_kernel import STATES, TrackInput, TrackModel, TrackOutput, filter_track, smooth_track
from replay.arrays.sliding import largest_within

Array = NDArray[np.float64]

_MEMORY_S = 2.0
_MOUNT = 0.5  # how far a sensor is mounted from the middle [m]
_SCALE = 0.02  # by how much all wheels may count the way short together
_WANDER = (0.002, 0.006, 0.02, 0.06)  # [m/√s]
_OFF = (0.02, 0.06, 0.2)  # of the top speed: how far the body may be off wheels that agree
_SPREAD = (0.5, 1.0, 2.0)  # and of their spread where they do not
_USUAL = (1, 1, 1)
_LESS_SURE = 4.0  # log-likelihood that the body must gain by being further off wheels that agree
_DELAYS_S = tuple(0.1 * k for k in range(11))
_LEAST_GAIN = 6.0  # log-likelihood that a delay must gain
_NEAR_S = 3.0
_AROUND = 3  # cells


@dataclass(frozen=True)
class Readings:
    """What one sensor says, per cell.

    Attributes
    ----------
    z, noise : Array, shape (cells,)
        Measured (NaN where nothing is), and the standard deviation of its noise.
    rows : Array, shape (cells, 4)
        How it depends on the state of `diagnosis.body.track_kernel`, with the body's speed beyond the common one [m/s] as the
        second.
    """

    z: Array
    noise: Array
    rows: Array


@dataclass(frozen=True)
class Track:
    """The body by one sensor.

    Attributes
    ----------
    beyond, std : Array, shape (cells,)
        Its speed along the track beyond the wheels' common one, and the standard deviation of that [m/s].
    delay : float
        By how much the sensor is late [s].
    mount, scale : float
        How far to the left it is mounted [m], and the share by which the wheels count the way short [1].
    jumps : int
        Jumps of its position.
    """

    beyond: Array
    std: Array
    delay: float
    mount: float
    scale: float
    jumps: int


def track_of(readings_at: Callable[[float], Readings], rolling: Rolling) -> Track:
    """Identify and smooth.

    Parameters
    ----------
    readings_at : Callable[[float], Readings]
        What the sensor says if it is late by so many seconds.
    rolling : Rolling
        The wheels.
    """
    delay = _delay(readings_at, rolling)
    readings = readings_at(delay)
    best, model, seen, out = -np.inf, None, None, None
    for wander, least, spread in product(range(len(_WANDER)), range(len(_OFF)), range(len(_SPREAD))):
        trial = _run(readings, rolling, wander, least, spread)
        likelihood = trial[0] - _LESS_SURE * least
        if likelihood > best:
            best, (_, model, seen, out) = likelihood, trial
    assert model is not None
    assert seen is not None
    assert out is not None
    mean, cov = smooth_track(seen, model, out)
    beyond = seen.off * mean[:, 1]
    std = seen.off * np.sqrt(np.maximum(cov[:, 1, 1], 0.0)) * _inflation(out.misfit)
    return Track(beyond, std, delay, float(mean[-1, 2]), float(mean[-1, 3]), int(out.jumped.sum()))


def _delay(readings_at: Callable[[float], Readings], rolling: Rolling) -> float:
    """By how much the sensor is late, where that explains its readings better [s]."""
    scores = []
    for delay in _DELAYS_S:
        readings = readings_at(delay)
        scores.append(_run(readings, rolling, *_USUAL)[0] / max(1, np.isfinite(readings.z).sum()))
    number = np.isfinite(readings_at(0.0).z).sum()
    best = int(np.argmax(scores))
    return _DELAYS_S[best] if (scores[best] - scores[0]) * number > _LEAST_GAIN else 0.0


def _run(
    readings: Readings, rolling: Rolling, wander: int, least: int, spread: int
) -> tuple[float, TrackModel, TrackInput, TrackOutput]:
    """Log-likelihood of the readings under one choice of constants, and what the filter leaves."""
    n = rolling.cells.size
    off = np.hypot(_OFF[least] * rolling.top, _SPREAD[spread] * _around(rolling.at_cells(rolling.spread)))
    rows = readings.rows.copy()
    rows[:, 1] *= off
    moved = np.diff(np.interp(rolling.cells, rolling.edges, rolling.way), prepend=0.0)
    seen = TrackInput(readings.z, readings.noise, rows, moved, off, CELL_S)
    one, square = np.zeros((n, STATES)), np.zeros((n, STATES, STATES))
    out = TrackOutput(one, square, one.copy(), square.copy(), np.zeros(n), np.zeros(n, dtype=np.bool_))
    model = TrackModel(_WANDER[wander], _MEMORY_S, _MOUNT, _SCALE)
    return filter_track(seen, model, out), model, seen, out


def _around(values: Array) -> Array:
    """Largest value of the cells around each."""
    return largest_within(values, _AROUND, _AROUND)


def _inflation(misfit: Array) -> Array:
    """Factor of the deviation where the sensor fits its own model worse than it should, over a few seconds; ≥ 1."""
    known = np.isfinite(misfit)
    width = max(1, round(_NEAR_S / CELL_S))
    window = np.ones(width)
    total = np.convolve(np.where(known, misfit, 0.0), window, mode="same")
    count = np.convolve(known.astype(np.float64), window, mode="same")
    return np.sqrt(np.maximum(total / np.maximum(count, 1.0), 1.0))
