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
    """

    y: Array
    x: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]

    def part(self, start: int, stop: int) -> Samples:
        """Samples [start, stop)."""
        return self.at(slice(start, stop))

    def at(self, steps: slice) -> Samples:
        """Samples of a slice."""
        return Samples(self.y[steps], self.x[steps], self.status[steps], self.quiet[steps])

    def reversed(self) -> Samples:
        """The same samples backwards."""
        return Samples(self.y[::-1].copy(), self.x[::-1].copy(), self.status[::-1].copy(), self.quiet[::-1].copy())
