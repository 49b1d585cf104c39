"""How far one clock runs ahead of another over a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of
from replay.readers.common.clock_steps import lead_of

_DRIFT_NS = 20_000_000


@dataclass(frozen=True)
class Lead:
    """Header clock against log clock, as a straight line through the medians of the first and last third.

    Attributes
    ----------
    count : int
        Number of stamps.
    at, ahead : tuple[int, int]
        Log time and lead in the middle of both thirds [ns].
    scatter : float
        Median distance from these leads [ns].
    """

    count: int
    at: tuple[int, int]
    ahead: tuple[int, int]
    scatter: float

    @staticmethod
    def of(log: NDArray[np.int64], header: NDArray[np.int64], count: int) -> Lead | None:
        """Return the line of some of `count` stamps, or None where the stamps are too few or do not run with the log.

        Both of shape (n,) [ns].
        """
        n = len(log)
        if n < 12 or not 0.1 < _extent(header) / max(_extent(log), 1.0) < 10:
            return None
        ends = slice(0, n // 3), slice(n - n // 3, n)
        at = tuple(int(median_of(log[e] - log[0])) + int(log[0]) for e in ends)
        lead = lead_of(header, log)
        ahead = tuple(int(median_of(lead[e])) for e in ends)
        scatter = max(float(median_of(np.abs(lead[e] - a))) for e, a in zip(ends, ahead, strict=True))
        return Lead(count, (at[0], at[1]), (ahead[0], ahead[1]), scatter)

    @property
    def rate(self) -> float:
        """Change of the header clock's lead per log time [1]."""
        return (self.ahead[1] - self.ahead[0]) / max(self.at[1] - self.at[0], 1)

    @property
    def drifts(self) -> bool:
        """Whether the lead changes by more than 20 ms, and than it scatters."""
        return abs(self.ahead[1] - self.ahead[0]) > max(_DRIFT_NS, 4 * self.scatter)

    def to_header(self, log: NDArray[np.int64]) -> NDArray[np.int64]:
        """Header stamps that messages with these log stamps would carry. Both of shape (n,) [ns]."""
        drift = np.clip(self.rate * (log.astype(np.float64) - self.at[0]), -(2.0**61), 2.0**61)
        moved: NDArray[np.int64] = log + self.ahead[0] + np.rint(drift).astype(np.int64)
        return moved


def _extent(stamps: NDArray[np.int64]) -> float:
    return float(stamps.max()) - float(stamps.min())
