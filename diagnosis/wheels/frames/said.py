"""What the first look says, as features of the second: of a wheel and of the others, around each frame and over the mission."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.frames.windows import Steps

Array = NDArray[np.float64]

#: Windows around a frame [s]: from, to.
_WINDOWS: tuple[tuple[float, float], ...] = (
    (-0.2, 0.2),
    (-1.0, 0.0),
    (0.0, 1.0),
    (-1.5, 1.5),
    (-4.0, 4.0),
    (-12.0, 0.0),
    (0.0, 12.0),
)
_LEAST = 1e-4  # probability below which differences say nothing


def said_features(said: Mapping[int, Array], frame_s: float) -> dict[int, Array]:
    """Features of every wheel, shape (frames, 108) each.

    Parameters
    ----------
    said : Mapping[int, Array], shape (frames, 10) each
        Probabilities of the classes of sensor and valve, by wheel.
    frame_s : float
        From frame to frame [s].
    """
    if not said:
        return {}
    frames = len(next(iter(said.values())))
    around = [_bounds(frames, low, high, frame_s) for low, high in _WINDOWS]
    means = {i: [_means(p, *bounds) for bounds in around] for i, p in said.items()}
    out = {}
    for i, p in said.items():
        parts = []
        for k, own in enumerate(means[i]):
            healthy = np.array([means[j][k][:, [0, p.shape[1] // 2]] for j in said if j != i])
            parts.append(own if k else _means(np.log(np.maximum(p, _LEAST)), *around[0]))
            parts += [healthy.mean(axis=0), healthy.min(axis=0)] if healthy.size else [np.ones((frames, 4))]
        parts.append(np.tile(p.mean(axis=0), (frames, 1)))
        out[i] = np.concatenate(parts, axis=1)
    return out


def _bounds(frames: int, low: float, high: float, frame_s: float) -> tuple[Steps, Steps]:
    """First frame of each frame's window, and the one behind its last."""
    at = np.arange(frames)
    first = np.clip(at + round(low / frame_s), 0, frames - 1)
    return first, np.clip(at + round(high / frame_s) + 1, first + 1, frames)


def _means(x: Array, first: Steps, last: Steps) -> Array:
    sums = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(x, axis=0)])
    return np.asarray((sums[last] - sums[first]) / (last - first)[:, None])
