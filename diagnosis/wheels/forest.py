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

from diagnosis.wheels.forest_kernel import MOST_LEAVES, Bitwise, add_scores, arrange

Array = NDArray[np.float64]


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


def _bitwise(forest: Forest) -> Bitwise:
    """The trees by their nodes."""
    nodes, trees = forest.feature.size, forest.root.size
    out = Bitwise(
        first=np.zeros(trees + 1, np.int64),
        feature=np.zeros(nodes, np.int64),
        threshold=np.zeros(nodes, np.float32),
        kept=np.zeros(nodes, np.uint32),
        value=np.zeros((trees, MOST_LEAVES), np.float32),
    )
    if not arrange(*forest[:6], out):
        raise ValueError(f"a tree has more than {MOST_LEAVES} leaves")
    return out


def log_probabilities(x: NDArray[np.float32], forest: Forest) -> Array:
    """Log-probability of each class in each frame, shape (frames, classes).

    Parameters
    ----------
    x : NDArray[np.float32], shape (frames, features)
        From `diagnosis.wheels.frames`.
    forest : Forest
        Of one side.

    Raises
    ------
    ValueError
        Where a tree has more than `MOST_LEAVES` leaves.
    """
    out = np.zeros((len(x), forest.prior.size))
    add_scores(np.ascontiguousarray(x, np.float32), _bitwise(forest), out)
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
