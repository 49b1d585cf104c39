"""Curves for figures: a column's samples within a span of time, thinned to what a figure can hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.report.plot_data import Axis, axis_of
from diagnosis.report.rows import derived
from diagnosis.results.document import ReportDocument
from diagnosis.results.result import Closeups
from replay.arrays.envelope import envelope

Array = NDArray[np.float64]
Span = tuple[float, float]


@dataclass(frozen=True)
class Curve:
    """Samples to draw.

    Attributes
    ----------
    t : NDArray[np.float64], shape (n,)
        Time from the mission's start [s].
    y : NDArray[np.float64], shape (n,)
        Values; NaN where there is no sample.
    stride : int
        Samples of which two points are the extremes; 1 where every point is a sample.
    """

    t: Array
    y: Array
    stride: int = 1


@dataclass(frozen=True)
class Series:
    """Columns of a result, with what its figures derive from them.

    Attributes
    ----------
    report : ReportDocument
        The document.
    raw : Mapping[str, NDArray], each of shape (n,)
        Columns with ``t`` [s]; of long missions extremes.
    closeups : Closeups or None
        Every sample of some stretches, where the columns are extremes.
    """

    report: ReportDocument
    raw: Mapping[str, NDArray[Any]]
    closeups: Closeups | None = None

    @cached_property
    def axis(self) -> Axis:
        """Time axis of the columns."""
        return axis_of(self.raw, self.report["log"]["rate_hz"])

    @cached_property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """Columns that hold samples, with ε̂ and the bounds of estimates. Each of shape (rows,)."""
        filled = {k: v for k, v in self.raw.items() if np.isfinite(v).any()} if self.axis.rows else {}
        return derived(filled, self.report)

    @cached_property
    def _near(self) -> tuple[NDArray[np.int64], Mapping[str, NDArray[Any]]]:
        """Steps of the stretches that have every sample, and these samples."""
        if self.closeups is None or self.axis.per == 1:
            return np.empty(0, np.int64), {}
        times = self.axis.start + self.closeups.step * self.axis.sample_s, self.axis.sample_s
        return self.closeups.step, derived(self.closeups.columns, self.report, times)

    def curve(self, name: str, span: Span, scale: float, most: int) -> Curve:
        """One column within a span.

        Parameters
        ----------
        name : str
            One of `columns`.
        span : tuple[float, float]
            First and last time [s].
        scale : float
            Factor of the values.
        most : int
            Points to draw at most: beyond it, extremes of several samples stand for them, so that no spike is lost.
        """
        t, y, exact = self._samples(name)
        first, last = np.searchsorted(t, span).tolist()
        inside = slice(first, last + 1)
        t, y = t[inside], np.asarray(y[inside], np.float64) * scale
        stride = 1 if exact[inside].all() else self.axis.per
        bucket = 1
        while 2 * len(t) > most * bucket and len(t) > most:
            bucket *= 2
        if bucket == 1:
            return Curve(t, y, stride)
        low = np.arange(0, len(t), bucket)
        ends = np.minimum(low + bucket // 2, len(t) - 1)
        return Curve(np.column_stack((t[low], t[ends])).ravel(), envelope(y, bucket), bucket * stride)

    def _samples(self, name: str) -> tuple[Array, NDArray[Any], NDArray[np.bool_]]:
        """Time and values of a column, every sample where there is one, else extremes; and which are samples."""
        axis = self.axis
        t = np.asarray(axis.start + axis.step * np.arange(axis.rows), np.float64)
        y = self.columns[name]
        step, samples = self._near
        if name not in samples:
            return t, y, np.full(len(t), axis.per == 1)
        known = np.isfinite(samples[name])
        step, near = step[known], samples[name][known]
        coarse = ~np.isin(np.arange(axis.rows) // 2, step // axis.per)  # two rows for every block of samples
        every = np.concatenate((t[coarse], axis.start + step * axis.sample_s))
        order = np.argsort(every, kind="stable")
        exact = np.concatenate((np.zeros(int(coarse.sum()), np.bool_), np.ones(len(step), np.bool_)))
        return every[order], np.concatenate((y[coarse], near))[order], exact[order]
