"""The samples of one channel beside its reference, as the models of the fault rows see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Samples(NamedTuple):
    """Samples of a channel and its reference; all of shape (n,).

    Attributes
    ----------
    y, x : Array
        Measured value and reference, in the channel's unit.
    status : NDArray[np.int8]
        See `diagnosis.channels.sample_status`.
    quiet : NDArray[np.bool_]
        Where the machine stands, so that a reading of zero is what a healthy channel gives too.
    white, passing, constant : Array
        Variance of the healthy noise, power of the passing mismatch, and variance of a stuck channel, as shares of what
        `ModeModel` has of them [1].
    """

    y: Array
    x: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    white: Array
    passing: Array
    constant: Array

    def part(self, start: int, stop: int) -> Samples:
        """Samples [start, stop)."""
        return self.at(slice(start, stop))

    def at(self, steps: slice) -> Samples:
        """Samples of a slice."""
        return Samples._make(column[steps] for column in self)

    def reversed(self) -> Samples:
        """The same samples backwards."""
        return Samples._make(column[::-1].copy() for column in self)

    @classmethod
    def even(cls, y: Array, x: Array, status: NDArray[np.int8], quiet: NDArray[np.bool_]) -> Samples:
        """Samples whose noise is the same everywhere. All of shape (n,)."""
        return cls(y, x, status, quiet, *(np.broadcast_to(1.0, y.shape).copy() for _ in range(3)))
