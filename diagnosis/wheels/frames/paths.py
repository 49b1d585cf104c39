"""Features of the Kalman models: their evidence in the run in which a frame lies, and the path around it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.frames.windows import Steps, windowed
from diagnosis.wheels.models import A_GAIN, HEALTHY, ODD, S_STUCK
from diagnosis.wheels.runs import Runs
from replay.arrays.blocks import block_means

Array = NDArray[np.float64]
Path = NDArray[np.uint8]

_WINDOWS = (0, -2, -1)


def run_features(described: Array, runs: Runs, at: Steps, dt: float) -> Array:
    """Features of the runs of a path in which the blocks `at` lie, shape (frames, q).

    Parameters
    ----------
    described : Array, shape (runs, p)
        Features of each run.
    runs : Runs
        In blocks.
    at : NDArray[np.int64], shape (frames,)
        Blocks.
    dt : float
        Block [s].
    """
    r = np.clip(np.searchsorted(runs.start, at, side="right") - 1, 0, runs.start.size - 1)
    since, left = np.log1p((at - runs.start[r]) * dt), np.log1p(np.maximum(runs.stop[r] - at, 0) * dt)
    return np.column_stack([described[r], since, left])


def path_features(path: Path, others: Sequence[Path], fault: Array, width: int, at: Steps, dt: float) -> Array:
    """Shares of sound, oddly loaded, sensor's and valve's models of a wheel's path, and of the others', shape (frames, 24).

    Parameters
    ----------
    path : NDArray[np.uint8], shape (n,)
        Models of the wheel, by block.
    others : Sequence of NDArray[np.uint8], shape (n,) each
        Those of the others.
    fault : Array, shape (n,)
        Probability by what came before that the wheel is faulty.
    width : int
        Blocks in a step.
    at : NDArray[np.int64], shape (frames,)
        Steps.
    dt : float
        Step [s].
    """
    table = [*_groups(path), fault]
    table += [np.sum([_groups(p)[k] for p in others], axis=0) if others else np.zeros(path.size) for k in (1, 2, 3)]
    columns = block_means(np.stack([np.asarray(c, np.float32) for c in table], axis=1), width)
    windows = windowed(columns, at, dt)
    return np.concatenate([windows[k] for k in _WINDOWS], axis=1)


def _groups(path: Path) -> list[NDArray[np.bool_]]:
    return [path == HEALTHY, path == ODD, (path >= S_STUCK) & (path < A_GAIN), path >= A_GAIN]
