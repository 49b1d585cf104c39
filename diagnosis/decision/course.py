"""What one size is of another in the windows of a mission, and where it is another share of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.results.said import Said, Stated
from replay.arrays.quantiles import median_known, median_of, quantile_of
from replay.arrays.runs import runs_of

Flags = NDArray[np.bool_]

FEW = 10  # windows, of which a usual share is known
_CUTS = 60  # moments at which a change is looked for first
FLOOR = 0.03  # of a share, for its logarithm
_NEARLY_ALL = 0.15, 0.85  # quantiles
_INSIDE, _OUTSIDE = 0.5, 12  # of a spell that is known; windows known elsewhere
_FAR = 3.0  # times what the rest is off the median, root mean square


class Course(NamedTuple):
    """What one size is of another in windows, and where in the mission it is something else.

    Attributes
    ----------
    share : Array, shape (windows,)
        The share [1]; NaN where nothing is known.
    cells : Cells
        The mission.
    """

    share: Array
    cells: Cells

    @property
    def log(self) -> Array:
        """ln of the share, shape (windows,), of which hardly anything is as little as `FLOOR`."""
        return np.log(np.maximum(self.share, FLOOR))

    @property
    def usual(self) -> float:
        """Median of the share [1]; NaN where few windows are known."""
        known = self.share[np.isfinite(self.share)]
        return float(median_of(known)) if known.size >= FEW else np.nan

    def mostly(self, middle: float, counts: float) -> bool:
        """Whether the share is not 1, by `middle` in its median and by `counts` nearly always the same way [ln]."""
        known = self.share[np.isfinite(self.share)]
        if known.size < FEW:
            return False
        low, median, high = np.log(np.maximum(quantile_of(known, (*_NEARLY_ALL, 0.5)), FLOOR))[[0, 2, 1]]
        return bool(abs(median) >= middle and (high <= -counts or low >= counts))

    def changes(self, what: str, counts: float, least: int) -> Said | None:
        """From when on its median is another one by `counts` [ln], as "0.98 times `what` up to 40 s, and 0.6 times from 43 s on".

        None where it is not, or where fewer than `least` windows are known before and after.
        """
        at = np.flatnonzero(np.isfinite(self.share))
        if at.size < 2 * least:
            return None
        x, n = self.log[at], at.size

        def left(k: int) -> float:
            """What medians before and after a window leave."""
            return float(sum(np.abs(part - median_of(part)).sum() for part in (x[:k], x[k:])))

        step = max(1, n // _CUTS)
        k = min(range(least, n - least + 1, step), key=left)
        k = min(range(max(least, k - step + 1), min(n - least, k + step - 1) + 1), key=left)
        one, other = float(median_of(x[:k])), float(median_of(x[k:]))
        if abs(one - other) < counts:
            return None
        last, first = self.span(int(at[k - 1]), int(at[k - 1]) + 1)[1], self.span(int(at[k]), n)[0]
        middle = (last + first) / 2
        last, first = min(last, middle), max(first, middle)
        since = Stated.of(first, digits=0)
        text = (
            f"{np.exp(one):.2f} times {what} up to {last:.0f} s, and {np.exp(other):.2f} times from {since.start} s on"
        )
        return Said(text, (since.span,))

    def span(self, first: int, last: int) -> tuple[float, float]:
        """Time of windows [first, last) [s]."""
        frame, dt = self.cells.frame, self.cells.dt
        return first * frame.hop * dt, ((last - 1) * frame.hop + frame.length) * dt

    def longest(self, flags: Flags, least_s: float) -> tuple[int, int] | None:
        """First window of the longest run of `flags`, shape (windows,), and the one behind it; None where none is as long as `least_s` [s]."""
        first, last = max(runs_of(flags), key=lambda r: r[1] - r[0], default=(0, 0))
        return (first, last) if (last - first) * self.cells.frame.hop * self.cells.dt >= least_s else None

    def spell(self, counts: float, length_s: float) -> tuple[int, int] | None:
        """First window of the spell that is furthest off the median, and the one behind it; None where none is by `counts` [ln].

        Nor by three times what the rest is off it, root mean square: what varies anyway has no spells. `length_s` in s.
        """
        frame = self.cells.frame
        hop_s = frame.hop * self.cells.dt
        long = max(1, round(length_s / hop_s))
        beside = frame.length // frame.hop  # windows that share time with a spell
        known = np.isfinite(self.share)
        if self.share.size < long or np.count_nonzero(known) < _OUTSIDE:
            return None
        off = self.log - float(median_of(self.log[known]))
        number, squares = (np.concatenate([[0.0], np.cumsum(x)]) for x in (known, np.where(known, off, 0.0) ** 2))
        first = np.arange(self.share.size - long + 1)
        before, after = np.maximum(first - beside, 0), np.minimum(first + long + beside, self.share.size)
        outside = number[-1] - number[after] + number[before]
        asked = first[(number[first + long] - number[first] >= _INSIDE * long) & (outside >= _OUTSIDE)]
        if not asked.size:
            return None
        middle = median_known(sliding_window_view(off, long)[asked], axis=1)
        rest = np.sqrt((squares[-1] - squares[after] + squares[before])[asked] / outside[asked])
        k = int(np.argmax(np.where(np.abs(middle) >= _FAR * rest, np.abs(middle), 0.0)))
        return (int(asked[k]), int(asked[k]) + long) if abs(middle[k]) >= max(counts, _FAR * rest[k]) else None
