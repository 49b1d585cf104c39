"""Scores of many frames by many small trees: each node is asked once for all frames, and no step waits for the one before.

A tree's leaves are the bits of a word, in the order from left to right. A node that sends a frame to the right leaves out all
leaves to its left; the lowest bit that is left behind all nodes is the frame's leaf, whatever their order (QuickScorer; Lucchese
et al., SIGIR 2015). Numbers are compared and leaves added as on a walk down the trees, so that the scores are the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.arrays.numeric import uncounted

MOST_LEAVES = 32
_AT_ONCE = 128  # frames whose features stay in the processor's cache while all trees look at them
_ALL = np.uint32(0xFFFFFFFF)
_DE_BRUIJN = np.uint64(
    0x077CB531
)  # its product with a power of two has another number in the topmost five bits for each


class Bitwise(NamedTuple):
    """Trees by their nodes.

    Attributes
    ----------
    first : NDArray[np.int64], shape (trees + 1,)
        Where each tree's nodes begin.
    feature : NDArray[np.int64], shape (nodes,)
        What a node looks at.
    threshold : NDArray[np.float32], shape (nodes,)
        At most this goes left.
    kept : NDArray[np.uint32], shape (nodes,)
        Leaves that are left where it goes right.
    value : NDArray[np.float32], shape (trees, MOST_LEAVES)
        What a leaf adds, at the place of its bit's product.
    """

    first: NDArray[np.int64]
    feature: NDArray[np.int64]
    threshold: NDArray[np.float32]
    kept: NDArray[np.uint32]
    value: NDArray[np.float32]


@njit(cache=True, forceinline=True, no_cpython_wrapper=True)
def _place(lowest):  # type: ignore[no-untyped-def]
    """Place of a leaf among a tree's values, by its bit."""
    return np.int64(((np.uint64(lowest) * _DE_BRUIJN) & np.uint64(0xFFFFFFFF)) >> np.uint64(27))


@njit(cache=True, error_model="numpy", nogil=True)
def arrange(  # type: ignore[no-untyped-def]
    feature, threshold, left, right, value, root, out
):
    """Fill `out` (`Bitwise`) with trees; False where one has more than `MOST_LEAVES` leaves. Arrays as `Forest` has them."""
    order, leaves = np.zeros(feature.size + 1, np.int64), np.zeros(feature.size, np.int64)
    before, stack = np.zeros(feature.size, np.int64), np.zeros(feature.size + 2, np.int64)
    at = 0
    for t in range(root.size):
        out.first[t] = at
        if root[t] < 0:
            out.value[t, _place(1)] = value[-1 - root[t]]
            continue
        stack[0], waiting, count = root[t], 1, 0
        while waiting > 0:
            waiting -= 1
            k = stack[waiting]
            order[count], count = k, count + 1
            for child in (left[k], right[k]):
                if child >= 0:
                    stack[waiting], waiting = child, waiting + 1
        if count >= MOST_LEAVES:
            return False
        for i in range(count - 1, -1, -1):  # children stand behind their parents
            k = order[i]
            leaves[k] = (leaves[left[k]] if left[k] >= 0 else 1) + (leaves[right[k]] if right[k] >= 0 else 1)
        before[root[t]] = 0
        for i in range(count):
            k = order[i]
            inside = leaves[left[k]] if left[k] >= 0 else 1
            for child, start in ((left[k], before[k]), (right[k], before[k] + inside)):
                if child >= 0:
                    before[child] = start
                else:
                    out.value[t, _place(np.uint64(1) << np.uint64(start))] = value[-1 - child]
            gone = ((np.uint64(1) << np.uint64(inside)) - np.uint64(1)) << np.uint64(before[k])
            out.feature[at], out.threshold[at], out.kept[at] = feature[k], threshold[k], _ALL ^ np.uint32(gone)
            at += 1
    out.first[root.size] = at
    return True


@njit(cache=True, error_model="numpy", nogil=True)
def add_scores(x: NDArray[np.float32], trees: Bitwise, out: NDArray[np.float64]) -> None:
    """Add the leaves of every frame of x (frames, features) to its classes' scores, `out` (frames, classes)."""
    x, trees, out = uncounted(x), uncounted(trees), uncounted(out)
    frames, classes = out.shape
    seen, left = np.zeros((x.shape[1], _AT_ONCE), np.float32), np.empty(_AT_ONCE, np.uint32)
    for start in range(0, frames, _AT_ONCE):
        count = min(_AT_ONCE, frames - start)
        for n in range(count):
            for k in range(x.shape[1]):
                seen[k, n] = x[start + n, k]
        for t in range(trees.value.shape[0]):
            left[:] = _ALL
            for k in range(trees.first[t], trees.first[t + 1]):
                values, limit, kept = seen[trees.feature[k]], trees.threshold[k], trees.kept[k]
                for n in range(left.size):  # those behind the last frame add nothing
                    left[n] &= _ALL if values[n] <= limit else kept
            for n in range(count):
                bits = np.uint64(left[n])
                lowest = bits & (~bits + np.uint64(1))
                out[start + n, t % classes] += trees.value[t, _place(lowest)]
