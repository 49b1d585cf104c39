"""Checks of a part by itself: its quick changes, a command that moves nothing, and where it points while the machine goes straight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Frame
from diagnosis.clearing.placements import Overlap, least


@dataclass(frozen=True)
class Rough:
    """The check of quick changes.

    Attributes
    ----------
    frame : Frame
        Its windows.
    quick, size, limit : Array, shape (windows,)
        Quick changes by their root mean square, what they are a share of, and the limit of that share.
    width : int
        Samples in a cell.
    """

    frame: Frame
    quick: Array
    size: Array
    limit: Array
    width: int

    def noise(self, over: Overlap) -> Array:
        """Smallest standard deviation of white noise of the samples that the windows show, shape (places,)."""
        k, inside = over.windows, (over.last - over.first) / self.frame.length
        lacks = np.maximum((self.limit * self.size)[k] ** 2 - self.quick[k] ** 2, 0.0)
        return least(np.where(inside > 0.0, np.sqrt(lacks / inside * 1.5 * self.width), np.nan))


@dataclass(frozen=True)
class Still:
    """The check of a command while its axle rests: `asked`, shape (windows,), is where the command is large enough."""

    frame: Frame
    asked: NDArray[np.bool_]

    def shows(self, over: Overlap) -> NDArray[np.bool_]:
        """Whether an axle that rests is found, shape (places,)."""
        whole = over.last - over.first >= self.frame.length
        return np.asarray((whole & self.asked[over.windows]).any(axis=1))


@dataclass(frozen=True)
class Straight:
    """The check of the yaw rate while the angles point straight.

    Attributes
    ----------
    frame : Frame
        Its windows.
    off : Array, shape (cells,)
        How far the machine's path is off its angles [rad]; NaN where they do not point straight.
    limit : float
        Of its mean [rad].
    """

    frame: Frame
    off: Array
    limit: float

    def offset(self, over: Overlap) -> Array:
        """Smallest offset of an angle [rad], of either sign, that the windows show, shape (places,)."""
        known, mean = np.isfinite(self.off).astype(np.float64), np.abs(self.frame.mean(self.off))[over.windows]
        inside, window = over.sums(known), self.frame.sums(known)[over.windows]
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            return least(np.where(inside > 0.0, (self.limit + mean) * window / inside, np.nan))
