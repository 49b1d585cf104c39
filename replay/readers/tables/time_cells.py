"""Cells of a time column as nanoseconds since 1970."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.log.time_zone import from_zone
from replay.readers.tables.row_kernel import MISSING
from replay.readers.tables.split_time import Part, with_part

FILETIME_EPOCH = 116_444_736_000_000_000
DC_EPOCH = 946_684_800_000_000_000
_NANOSECONDS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1, "dc": 1, "dc32": 1, "dt": 1_000_000_000}
_WRAP = 1 << 32
_BACK = 100_000_000
_FAR = 2**62
_EPOCHS = (1900, 2100)  # with cells below 2^62 ns, stamps stay below 2^63
_SECOND = 1_000_000_000
_DAY = 86_400 * _SECOND


def epoch_ns(options: SourceOptions, source: str, unit: str = "", day_ns: int = 0) -> int:
    """Zero of the time column [ns since 1970].

    Parameters
    ----------
    options : SourceOptions
        Its epoch, where one is given.
    source : str
        File, for messages.
    unit : str
        Unit that was found; that of the options where empty.
    day_ns : int
        Midnight of the date beside times of day [ns since 1970], where no epoch is given.

    Raises
    ------
    LogError
        Where the epoch is not an ISO date and time, or so far from 1970 that stamps would not fit.
    """
    if options.epoch is None:
        return DC_EPOCH if (unit or options.time_unit) in ("dc", "dc32") else day_ns
    try:
        moment = datetime.fromisoformat(options.epoch)
    except ValueError as error:
        raise LogError(
            f"{source}: epoch = {options.epoch!r} is not an ISO date and time; write it like 2000-01-01T00:00:00Z"
        ) from error
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    if not _EPOCHS[0] <= moment.year <= _EPOCHS[1]:
        raise LogError(
            f"{source}: epoch = {options.epoch!r} is out of range; expected a date of the years {_EPOCHS[0]} to {_EPOCHS[1]} "
            "(FILETIME columns, which count from 1601, need none)"
        )
    since = moment - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * 1_000_000_000 + since.microseconds * 1_000


class TimeBase:
    """Turns the cells of one time column into stamps, block after block.

    Parameters
    ----------
    unit : str
        As in `SourceOptions.time_unit`; ``iso`` cells are nanoseconds already.
    epoch : int
        Zero of the column [ns since 1970].
    label : str
        File and column, for messages.
    report : Report
        Takes notes and losses when all blocks are through.
    part : Part or None
        Column with the parts of whole seconds, where the clock stands in two columns.
    zone : str
        Time zone in which the cells are meant; empty: UTC.
    """

    def __init__(
        self, unit: str, epoch: int, label: str, report: Report, part: Part | None = None, zone: str = ""
    ) -> None:
        self.zone = zone
        self.unit, self.epoch, self.label, self.report, self.part = unit, epoch, label, report, part
        self.rows = self.missing = 0
        self._inexact = self._dated = False
        self._last: int | None = None
        self._turns = 0
        self._longest = 0

    def stamps(self, cells: NDArray[Any], parts: NDArray[Any] | None = None) -> NDArray[np.int64]:
        """Stamps [ns], `row_kernel.MISSING` where a cell holds no time.

        Parameters
        ----------
        cells : NDArray, shape (m,)
            Integers (`MISSING` where empty) or doubles (NaN where empty).
        parts : NDArray or None, shape (m,)
            Cells of the second column, where the clock stands in two.
        """
        self.rows += len(cells)
        ns = self._of_reals(cells) if cells.dtype.kind == "f" else self._of_integers(cells)
        if parts is not None and self.part is not None:
            ns = with_part(ns, parts, self.part.unit_ns)
        if self.zone:
            ns = np.where(ns == MISSING, MISSING, from_zone(np.where(ns == MISSING, 0, ns), self.zone))
        self.missing += int(np.count_nonzero(ns == MISSING))
        return ns

    def _of_integers(self, cells: NDArray[Any]) -> NDArray[np.int64]:
        ticks = cells.astype(np.int64, copy=False)
        if cells.dtype == np.uint64:
            ticks = np.where(cells > np.uint64(_FAR), MISSING, ticks)
        if self.unit == "dc32":
            ticks = self._unwrapped(ticks, _WRAP, _BACK)
        elif self.unit == "iso" and self._of_day(ticks):
            ticks = self._unwrapped(ticks, _DAY, _DAY // 2)
        if self.unit == "filetime":
            factor, zero = 100, -FILETIME_EPOCH * 100
            near = np.abs(ticks - FILETIME_EPOCH) < _FAR // 100
            return np.where(near & (ticks != MISSING), (ticks - FILETIME_EPOCH) * 100, MISSING)
        factor, zero = _NANOSECONDS.get(self.unit, 1), self.epoch
        limit = _FAR // factor
        good = (ticks > -limit) & (ticks < limit)
        return np.where(good, ticks * factor + zero, MISSING)

    def _of_reals(self, cells: NDArray[Any]) -> NDArray[np.int64]:
        reals = cells.astype(np.float64, copy=False)
        if self.unit in ("filetime", "ns", "dc", "dc32"):
            good = np.abs(reals) < _FAR
            whole = np.where(good, reals, 0.0)
            self._inexact |= bool((np.abs(whole) > 2.0**53).any())
            return self._of_integers(np.where(good, np.rint(whole).astype(np.int64), MISSING))
        factor = _NANOSECONDS.get(self.unit, 1)
        good = np.abs(reals) < _FAR / factor
        reals = np.where(good, reals, 0.0)
        base = np.floor(reals)
        ns = base.astype(np.int64) * factor + self.epoch
        ns += np.rint((reals - base) * factor).astype(np.int64)
        return np.where(good, ns, MISSING)

    def _of_day(self, ticks: NDArray[np.int64]) -> bool:
        """Whether the cells are times of day without a date, which begin again at midnight."""
        if not self._dated:
            given = ticks[ticks != MISSING]
            self._dated = bool(((given < 0) | (given >= _DAY)).any())
        return not self._dated

    def _unwrapped(self, ticks: NDArray[np.int64], span: int, back: int) -> NDArray[np.int64]:
        """Count the turns of a counter that starts again; a step back of less than `back` is a row out of order, not a turn."""
        given = (ticks >= 0) & (ticks < span)
        values = ticks[given]
        if not len(values):
            return np.full(len(ticks), MISSING)
        before = values[0] if self._last is None else self._last
        steps = np.diff(values, prepend=before) % span
        steps = np.where(steps > span - back, steps - span, steps)
        start = int(values[0]) - int(steps[0]) if self._last is None else self._turns
        total = start + np.cumsum(steps)
        self._last, self._turns = int(values[-1]), int(total[-1])
        self._longest = max(self._longest, int(steps.max()))
        out = np.full(len(ticks), MISSING)
        out[given] = total
        return out

    def finish(self) -> None:
        """Tell what the blocks held."""
        if self.missing:
            self.report.lost(
                f"{self.label}: {self.missing} of {self.rows} rows have no readable time and were left out"
            )
        if self._inexact:
            self.report.note(
                f"{self.label}: its long stamps were written as floating-point numbers, so they are exact only to about a "
                "microsecond; write them as integers"
            )
        if self.unit == "iso" and self._turns and not self._dated and not self.epoch and self.rows > self.missing:
            self.report.note(
                f"{self.label}: times of day without a date, counted on over midnight; [sources] epoch gives the date"
            )
        if self.unit == "dc32" and self.rows > self.missing:
            self.report.note(
                f"{self.label}: a 32-bit distributed clock starts again every 4.29 s; its wraps were counted, its date is "
                "unknown"
            )
            if self._longest > _SECOND:
                self.report.lost(
                    f"{self.label}: its longest step is {self._longest / 1e9:.2f} s; a gap may have lasted longer by any "
                    "multiple of 4.29 s, which 32 bits cannot show; record the 64-bit clock"
                )


def spread_seconds(stamps: NDArray[np.int64], label: str, report: Report) -> NDArray[np.int64]:
    """Spread several samples of one second evenly over it (a PLC's DT has a resolution of 1 s).

    Parameters
    ----------
    stamps : NDArray[np.int64], shape (n,)
        Whole seconds [ns].
    label : str
        File and column, for messages.
    report : Report
        Takes the note.

    Raises
    ------
    LogError
        Where the seconds hold different numbers of samples, so that nothing says when each was taken.
    """
    first = np.flatnonzero(np.diff(stamps, prepend=stamps[:1] - 1) != 0)
    counts = np.diff(first, append=len(stamps))
    usual = int(np.median(counts[1:-1])) if len(counts) > 2 else int(counts.max(initial=1))
    if counts.max(initial=1) == 1:
        return stamps
    inner = counts[1:-1]
    uneven = np.abs(inner - usual) > max(1, usual // 10)
    if len(counts) < 3 or uneven.mean() > 0.1 or (np.diff(stamps[first]) <= 0).any():
        few, most = int(inner.min(initial=usual)), int(inner.max(initial=usual))
        raise LogError(
            f"{label}: its stamps count whole seconds with {few} to {most} samples in each, so the time of a single sample "
            "is not known; record FILETIME or the distributed clock instead of DT"
        )
    within = np.arange(len(stamps)) - np.repeat(first, counts)
    share = np.where(np.abs(counts - usual) > max(1, usual // 10), usual, counts)
    share[0], share[-1] = max(usual, counts[0]), max(usual, counts[-1])
    within[: counts[0]] += share[0] - counts[0]
    spread: NDArray[np.int64] = stamps + within * _SECOND // np.repeat(share, counts)
    report.note(f"{label}: its stamps count whole seconds; the {usual} samples of each were spread evenly over it")
    odd = int(uneven.sum())
    if odd:
        report.lost(f"{label}: {odd} seconds hold more or fewer than {usual} samples; times within them are uncertain")
    return spread
