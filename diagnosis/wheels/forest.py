"""Gradient-boosted trees that say how probable each row of the tables is in a frame; their training is described in docs/.

The trees are data, made by ``tests/benchmarks/train_wheels.py`` from simulated machines of many structures. They add nothing to
the evidence: they weigh it as it turned out on machines whose faults were known.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from io import BytesIO
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.arrays.numeric import uncounted

Array = NDArray[np.float64]

_AT_ONCE = 32  # frames whose features stay in the processor's cache while all trees look at them


class Forest(NamedTuple):
    """Trees of one side.

    Attributes
    ----------
    feature : NDArray[np.int16], shape (nodes,)
        What a node looks at.
    threshold : NDArray[np.float32], shape (nodes,)
        At most this goes left.
    left, right : NDArray[np.int32], shape (nodes,)
        The next node; below 0: leaf −1 − k.
    value : NDArray[np.float32], shape (leaves,)
        What a leaf adds to the score of its tree's class.
    root : NDArray[np.int32], shape (trees,)
        First node of each tree; below 0: a leaf. Trees take turns through the classes.
    prior : Array, shape (classes,)
        Share of each class in training.
    low, high : NDArray[np.float32], shape (features,)
        Range of each feature in training.
    """

    feature: NDArray[np.int16]
    threshold: NDArray[np.float32]
    left: NDArray[np.int32]
    right: NDArray[np.int32]
    value: NDArray[np.float32]
    root: NDArray[np.int32]
    prior: Array
    low: NDArray[np.float32]
    high: NDArray[np.float32]


class Look(NamedTuple):
    """Trees of both sides that look at the same features."""

    sensor: Forest
    actuator: Forest


@njit(cache=True, error_model="numpy", inline="always")
def _next(k: int, x: NDArray[np.float32], forest: Forest, after: NDArray[np.int32]) -> int:
    """Node or leaf behind node k for one frame, x (features,)."""
    return int(after[k, int(x[forest.feature[k]] <= forest.threshold[k])])


@njit(cache=True, error_model="numpy", nogil=True)
def _scores(x: NDArray[np.float32], forest: Forest, after: NDArray[np.int32], out: Array) -> None:
    """Add the leaves of every frame of x (frames, features) to its classes' scores, `out` (frames, classes).

    `after` (nodes, 2) holds the nodes to the right and to the left. Four frames go down a tree at once: each step of one waits
    for its memory, and the others' do not wait for it.
    """
    x, forest, after = uncounted(x), uncounted(forest), uncounted(after)
    frames, classes = out.shape
    for first in range(0, frames, _AT_ONCE):
        last = min(first + _AT_ONCE, frames)
        for t in range(forest.root.size):
            for n in range(first, last, 4):
                a = b = c = d = np.int64(forest.root[t])
                # those beyond the last frame follow it, and add nothing
                at_b, at_c, at_d = min(n + 1, last - 1), min(n + 2, last - 1), min(n + 3, last - 1)
                while a >= 0 and b >= 0 and c >= 0 and d >= 0:
                    a, b = _next(a, x[n], forest, after), _next(b, x[at_b], forest, after)
                    c, d = _next(c, x[at_c], forest, after), _next(d, x[at_d], forest, after)
                while a >= 0:
                    a = _next(a, x[n], forest, after)
                while b >= 0:
                    b = _next(b, x[at_b], forest, after)
                while c >= 0:
                    c = _next(c, x[at_c], forest, after)
                while d >= 0:
                    d = _next(d, x[at_d], forest, after)
                out[n, t % classes] += forest.value[-1 - a]
                if n + 1 < last:
                    out[n + 1, t % classes] += forest.value[-1 - b]
                if n + 2 < last:
                    out[n + 2, t % classes] += forest.value[-1 - c]
                if n + 3 < last:
                    out[n + 3, t % classes] += forest.value[-1 - d]


def log_probabilities(x: NDArray[np.float32], forest: Forest) -> Array:
    """Log-probability of each class in each frame, shape (frames, classes).

    Parameters
    ----------
    x : NDArray[np.float32], shape (frames, features)
        From `diagnosis.wheels.frames`.
    forest : Forest
        Of one side.
    """
    out = np.zeros((len(x), forest.prior.size))
    _scores(np.ascontiguousarray(x, np.float32), forest, np.column_stack([forest.right, forest.left]), out)
    out -= out.max(axis=1, keepdims=True)
    out -= np.log(np.exp(out).sum(axis=1, keepdims=True))
    return np.asarray(out)


def known_share(x: NDArray[np.float32], forest: Forest) -> Array:
    """Share of each frame's features that lie within what training saw, shape (frames,)."""
    return np.asarray(((x >= forest.low) & (x <= forest.high)).mean(axis=1))


@cache
def looks() -> tuple[Look, Look]:
    """Trees of the first look and of the second."""
    data = files("diagnosis.wheels").joinpath("forests.npz").read_bytes()
    with np.load(BytesIO(data)) as kept:
        first, second = (
            Look(*(Forest(*(kept[f"{look}_{side}_{n}"] for n in Forest._fields)) for side in Look._fields))
            for look in ("first", "second")
        )
    return first, second
