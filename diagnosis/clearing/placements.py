"""Faults of some length at many places of a mission, and how large each must be to be beyond the limit of a check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Frame
from diagnosis.clearing.measure import Compared

_MOST = 160  # places that are tried
_MOVED = 0.6  # of a fault's time, in which its part is driven, or as many cells as are asked
_TOUCHED, _USUAL = 0.25, 0.4  # of a window, and of the windows: more of them shift what is usual
_ROUNDS = 12  # of a fixed point
_FILLED, _BECOMES = 0.9, 0.6  # of a window, and of the windows: so many of them are what is usual


class Overlap(NamedTuple):
    """Windows that places touch.

    Attributes
    ----------
    windows : NDArray[np.intp], shape (places, n)
        Windows.
    first, last : NDArray[np.intp], shape (places, n)
        Cells of each window that lie in the fault; last excluded. None do where `last` is not behind `first`.
    """

    windows: NDArray[np.intp]
    first: NDArray[np.intp]
    last: NDArray[np.intp]

    def sums(self, x: Array) -> Array:
        """Sum of x (cells,) over the cells of each window that lie in the fault; NaN counts as 0. Shape (places, n)."""
        total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(x))])
        return np.asarray(np.where(self.last > self.first, total[self.last] - total[self.first], 0.0))


@dataclass(frozen=True)
class Placements:
    """Faults from cell `first` to cell `last` (excluded), each of shape (places,)."""

    first: NDArray[np.intp]
    last: NDArray[np.intp]

    def overlap(self, frame: Frame, *, within: bool = False) -> Overlap:
        """The windows of `frame` that each fault touches; `within`: only those that lie in it."""
        count, long = frame.starts.size, int(np.max(self.last - self.first, initial=1))
        lowest = (self.first - frame.length) // frame.hop + 1
        windows = lowest[:, np.newaxis] + np.arange((long + frame.length) // frame.hop + 1)
        valid = (windows >= 0) & (windows < count)
        if within:
            at = windows * frame.hop
            valid &= (at > self.first[:, np.newaxis]) & (at + frame.length < self.last[:, np.newaxis])
        windows = np.clip(windows, 0, count - 1)
        start = frame.starts[windows]
        first = np.maximum(start, self.first[:, np.newaxis])
        last = np.minimum(np.minimum(start + frame.length, frame.cells), self.last[:, np.newaxis])
        return Overlap(windows, first, np.where(valid, last, first))


def placements(moving: NDArray[np.bool_], cells: int | None, enough: int) -> Placements:
    """Faults of so many cells that begin anywhere while their part is driven; None: one over the whole mission.

    Parameters
    ----------
    moving : NDArray[np.bool_], shape (cells,)
        Whether the part is driven.
    cells : int or None
        Length; 0, of a fault shorter than a cell, has no place.
    enough : int
        Cells of a fault, in which its part is driven, that are enough.
    """
    if cells is None:
        return Placements(np.zeros(1, dtype=np.intp), np.full(1, moving.size, dtype=np.intp))
    total = np.concatenate([[0], np.cumsum(moving)])
    starts = np.arange(max(0, moving.size - cells + 1) if cells else 0)
    starts = starts[total[starts + cells] - total[starts] >= min(_MOVED * cells, enough)]
    if starts.size > _MOST:
        starts = starts[np.linspace(0, starts.size - 1, _MOST).astype(np.intp)]
    return Placements(starts, starts + cells)


def least(sizes: Array) -> Array:
    """Smallest size that any window shows, shape (places,); infinite where none does."""
    if not sizes.shape[1]:
        return np.full(sizes.shape[0], np.inf)
    return np.asarray(np.maximum(np.min(np.where(np.isnan(sizes), np.inf, sizes), axis=1), 0.0))


def countered(less: Array) -> Array:
    """Excess of which a loop that keeps the motion as commanded leaves an opening, or a true motion, less by this share.

    Both of one shape (places, windows), shares [1].
    """
    return np.asarray(np.where(less < 1.0, np.maximum(less, 0.0) / np.maximum(1.0 - less, 1e-9), np.inf))


@dataclass(frozen=True)
class Ratio:
    """A check of motion per opening.

    Attributes
    ----------
    frame : Frame
        Its windows.
    off : Array, shape (windows,)
        ln of motion per opening against the usual one.
    weight : Array, shape (cells,)
        Motion that counts.
    below, above : float
        Limits.
    kinds : NDArray[np.intp], shape (windows,)
        Windows of different kinds have usual ones of their own.
    lasting : tuple[tuple[float, float], ...]
        Of each kind, how far what is usual is from its limits below and above [ln]; infinite where it is not asked.
    """

    frame: Frame
    off: Array
    weight: Array
    below: float
    above: float
    kinds: NDArray[np.intp]
    lasting: tuple[tuple[float, float], ...]

    def room(self, over: Overlap, share: Array) -> Array:
        """`off` of the windows; NaN for those whose usual one the fault becomes; by `share` of them. Shape (places, n)."""
        unusual = np.zeros(over.windows.shape, dtype=np.bool_)
        for kind in range(len(self.lasting)):
            few = self.filled(over, share, kind, _TOUCHED) < _USUAL
            unusual |= few[:, np.newaxis] & (self.kinds[over.windows] == kind)
        return np.asarray(np.where(unusual, self.off[over.windows], np.nan))

    def filled(self, over: Overlap, share: Array, kind: int, least_share: float) -> Array:
        """Share of the windows of a kind of which each fault fills so large a share, shape (places,)."""
        known = (self.kinds == kind) & np.isfinite(self.off)
        full = known[over.windows] & (np.nan_to_num(share) > least_share)
        return np.asarray(full.sum(axis=1) / max(1, np.count_nonzero(known)))

    def share(self, over: Overlap) -> Array:
        """Part of each window's motion that lies in the fault; NaN for none. Shape (places, windows) [1]."""
        inside = over.sums(self.weight)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            return np.asarray(np.where(inside > 0.0, inside / self.frame.sums(self.weight)[over.windows], np.nan))

    def loss(self, over: Overlap) -> Array:
        """Smallest loss [1] that the windows show, or that what is usual does, shape (places,)."""
        share = self.share(over)
        out = least(-np.expm1(-(self.below + self.room(over, share))) / share)
        for kind, (below, _) in enumerate(self.lasting):
            out = np.where(self.filled(over, share, kind, _FILLED) > _BECOMES, np.minimum(out, -np.expm1(-below)), out)
        return np.maximum(out, 0.0)

    def excess(self, over: Overlap) -> Array:
        """Smallest excess [1], likewise; the loop closes the valve until the motion is as commanded again.

        Shape (places,).
        """
        share = self.share(over)
        out = least(countered(-np.expm1(self.room(over, share) - self.above) / share))
        for kind, (_, above) in enumerate(self.lasting):
            out = np.where(self.filled(over, share, kind, _FILLED) > _BECOMES, np.minimum(out, np.expm1(above)), out)
        return np.maximum(out, 0.0)

    def offset(self, over: Overlap) -> Array:
        """Smallest offset of either sign, in the motion's unit, likewise. Shape (places,)."""
        inside, window = over.sums((self.weight > 0.0).astype(np.float64)), self.frame.sums(self.weight)[over.windows]
        with_it = np.where(inside > 0.0, window / inside, np.nan)
        off = self.room(over, self.share(over))
        return np.maximum(least(np.expm1(self.above - off) * with_it), least(-np.expm1(-(self.below + off)) * with_it))

    def shows_hold(self, over: Overlap, y: Array, first: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether it shows that y (cells,) rests at its value of the fault's first cell, shape (places,)."""
        counted = (self.weight > 0.0).astype(np.float64)
        window = self.frame.sums(self.weight)[over.windows]
        held = window - over.sums(self.weight) + np.abs(y[first])[:, np.newaxis] * over.sums(counted)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            off = self.room(over, self.share(over)) + np.log(np.maximum(held / window, 1e-3))
        touched = over.sums(counted) > 0.0
        return np.asarray((touched & ((off > self.above) | (off < -self.below))).any(axis=1))


@dataclass(frozen=True)
class Reference:
    """A check of a channel against its second measurement, or an opening against its command."""

    compared: Compared
    limit: float

    def _window(self, over: Overlap, x: Array) -> Array:
        return np.asarray(self.compared.frame.sums(x)[over.windows])

    def loss(self, over: Overlap) -> Array:
        """Smallest loss [1] of the channel that its windows show, shape (places,)."""
        c, limit = self.compared, self.limit
        power = self._power(over)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            off = 1.0 - self._window(over, c.a * c.b) / power
            slope = over.sums(c.a * c.b) / power
            gain = np.where(c.driven[over.windows] & (slope > 0.0), (limit - off) / slope, np.nan)
            mean = over.sums(c.a) / self._window(over, np.isfinite(c.a).astype(np.float64))
            much, at = limit * c.size[over.windows], c.mean[over.windows]
            shifted = np.where(mean > 0.0, (much + at) / mean, (much - at) / -mean)
        shown = c.moves[over.windows] & (over.last > over.first)
        shifted = np.where(shown & (mean != 0.0), shifted, np.nan)
        return np.minimum(least(np.where(shown, gain, np.nan)), least(shifted))

    def excess(self, over: Overlap) -> Array:
        """Smallest excess [1], likewise; the loop takes the reference back until the motion is as commanded again.

        Shape (places,).
        """
        c = self.compared
        power = self._power(over)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            share = over.sums(np.where(np.isfinite(c.a), c.b * c.b, 0.0)) / power
            much = self.limit + 1.0 - self._window(over, c.a * c.b) / power
            # by gain: share·s = much·((1 − share)·(1 + s)² + share)
            square, line = much * (1.0 - share), share - 2.0 * much * (1.0 - share)
            root = line**2 - 4.0 * square * much
            gain = np.where((root >= 0.0) & (line > 0.0), 2.0 * much / (line + np.sqrt(np.maximum(root, 0.0))), np.nan)
            mean = over.sums(c.a) / self._window(over, np.isfinite(c.a).astype(np.float64))
            at = c.mean[over.windows] * np.sign(mean)
            shifted = before = np.zeros(mean.shape)
            for _ in range(_ROUNDS):  # what is left of the reference is what a deviation is a share of
                before, left = shifted, np.sqrt(1.0 - share + share / (1.0 + shifted) ** 2)
                size = np.maximum(left * c.size[over.windows], c.floor)
                shifted = countered((self.limit * size - at) / np.abs(mean))
            shifted = np.maximum(before, shifted)
        shown = c.moves[over.windows] & (over.last > over.first)
        shifted = np.where(shown & (mean != 0.0), shifted, np.nan)
        return np.minimum(least(np.where(shown & c.driven[over.windows], gain, np.nan)), least(shifted))

    def _power(self, over: Overlap) -> Array:
        """Sum of the reference's squares in each window, shape (places, n)."""
        c = self.compared
        return self._window(over, np.where(np.isfinite(c.a), c.b * c.b, 0.0))

    def offset(self, over: Overlap) -> Array:
        """Smallest offset of either sign, in the channel's unit, likewise. Shape (places,)."""
        c = self.compared
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            share = over.sums(np.isfinite(c.a).astype(np.float64)) / self._window(over, np.isfinite(c.a).astype(float))
            size = (self.limit * c.size[over.windows] + np.abs(c.mean[over.windows])) / share
        return least(np.where(c.moves[over.windows] & (share > 0.0), size, np.nan))

    def shows_hold(self, over: Overlap, first: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether it shows that the channel rests at its value of the fault's first cell, shape (places,)."""
        c = self.compared
        known = np.isfinite(c.a).astype(np.float64)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            moved = np.nan_to_num(c.a[first])[:, np.newaxis] * over.sums(known) - over.sums(c.a)
            mean = c.mean[over.windows] + moved / self._window(over, known)
        shown = c.moves[over.windows] & (over.last > over.first)
        return np.asarray((shown & (np.abs(mean) > self.limit * c.size[over.windows])).any(axis=1))
