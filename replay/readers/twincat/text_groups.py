"""Groups of channels of a TwinCAT Scope text export: their stamps, names, and repeated samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import Column
from replay.errors import LogError
from replay.log.raw_log import Window
from replay.log.reading_notes import Report
from replay.readers.tables.columns import CellColumn, compressed, pick
from replay.readers.tables.row_kernel import MISSING, REAL
from replay.readers.tables.time_cells import TimeBase
from replay.readers.twincat.text_header import HOW, Scope

_LONGEST_NS = 1e15  # no channel is sampled more seldom than every eleven days
_FULL_TIME = 10**15
_NAN = np.array([np.nan]).view(np.int64)[0]
_NEAR = 0.02


@dataclass
class Group:
    """One group while it is being read: its columns are `first` (times) to `stop` − 1."""

    first: int
    stop: int
    base: TimeBase
    stamps: Column
    columns: dict[int, CellColumn]

    def add(self, cells: NDArray[np.int64], kinds: NDArray[np.int8], window: Window | None) -> None:
        """Take the rows of a block in which this group holds a time or a value.

        Parameters
        ----------
        cells : NDArray[np.int64], shape (width, m)
            As from `rows.Rows.blocks`.
        kinds : NDArray[np.int8], shape (width,)
            Kinds of the columns.
        window : tuple[int, int] or None
            Time to keep [ns]; rows without a time are kept until it is known whether they can get one.
        """
        times = cells[self.first]
        stamps = self.base.stamps(times.view(np.float64) if kinds[self.first] == REAL else times)
        bare = stamps == MISSING
        keep = pick(stamps, window)
        if bare.any():
            own = cells[self.first + 1 : self.stop, bare]
            empty = (own == MISSING) | ((own == _NAN) & (kinds[self.first + 1 : self.stop, None] == REAL))
            keep[np.flatnonzero(bare)[~empty.all(0)]] = True
        whole = bool(keep.all())
        if not keep.any():
            for i, column in self.columns.items():
                column.append(cells[i, :0], kinds[i])
            return
        self.stamps.append(stamps if whole else stamps[keep])
        for i, column in self.columns.items():
            column.append(cells[i] if whole else cells[i, keep], kinds[i])


def make_groups(scope: Scope, sample: NDArray[np.int64], kinds: NDArray[np.int8], report: Report) -> list[Group]:
    """Groups of an export.

    Parameters
    ----------
    scope : Scope
        The export's head.
    sample : NDArray[np.int64], shape (width, m)
        First rows of data.
    kinds : NDArray[np.int8], shape (width,)
        Kinds of its columns.
    report : Report
        Takes what the stamps lack.
    """
    full = any(kinds[i] != REAL and (sample[i] > _FULL_TIME).any() for i in scope.times)
    unit, epoch = ("filetime", 0) if full else ("ms", scope.start_ns or 0)
    groups = []
    for g, first in enumerate(scope.times):
        stop = scope.times[g + 1] if g + 1 < len(scope.times) else scope.width
        base = TimeBase(unit, epoch, f"{scope.file.path.name}, group {g + 1}", report)
        columns = {i: CellColumn(report.store) for i in range(first + 1, stop)}
        groups.append(Group(first, stop, base, report.store.column(np.int64), columns))
    return groups


def finished_stamps(
    scope: Scope, group: Group, window: Window | None, report: Report
) -> tuple[NDArray[np.int64], NDArray[np.bool_] | None]:
    """Stamps of a group, and which of its rows remain (None: all).

    Both of shape (rows,), stamps in ns.

    Raises
    ------
    LogError
        Where the column runs backwards, so that it cannot hold times.
    """
    stamps = group.stamps.finish()
    blank = stamps == MISSING
    remain: NDArray[np.bool_] | None = None
    if blank.any():
        filled = _interpolated(stamps, blank)
        found, left = int(blank.sum() - (filled == MISSING).sum()), int((filled == MISSING).sum())
        if found:
            report.note(
                f"{group.base.label}: {found} blank time cells got the time half-way between their neighbours', on the grid "
                "of the sample time"
            )
        if left:
            report.lost(f"{group.base.label}: {left} rows hold values without a time and were left out")
        remain = pick(filled, window)
        stamps = compressed(filled, remain, report.store)
    if len(stamps) > 1 and (np.diff(stamps) < 0).mean() > 0.5:
        raise LogError(f"{scope.file.path}: column {group.first + 1} should hold times but runs backwards; {HOW}")
    return stamps, remain


def _interpolated(stamps: NDArray[np.int64], blank: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Fill blank stamps between two that are as far apart as the grid says."""
    given = np.flatnonzero(~blank)
    if len(given) < 3:
        return stamps
    near = np.diff(stamps[given])[np.diff(given) == 1]
    period = float(np.median(near)) if len(near) else 0.0
    rows = np.flatnonzero(blank)
    after = np.searchsorted(given, rows)
    inside = (after > 0) & (after < len(given))
    rows, after = rows[inside], after[inside]
    left, right = given[after - 1], given[after]
    span, steps = stamps[right] - stamps[left], right - left
    fits = np.abs(span - steps * period) <= _NEAR * period
    out = stamps.copy()
    rows, left, span, steps = rows[fits], left[fits], span[fits], steps[fits]
    out[rows] = stamps[left] + span * (rows - left) // steps
    return out


def labels(scope: Scope) -> list[str]:
    """Unique channel names: the symbol, else the shown name.

    The key of a channel is (NetID, Port, SymbolName, SampleTime): a second channel of the same symbol gets what its key
    has of its own; one of the same key gets a number.
    """
    out: list[str] = []
    keys: dict[str, tuple[str, str, str]] = {}
    taken: set[str] = set()
    for i in range(scope.width):
        label = scope.cell("symbolname", i) or scope.rows["name"][i] or f"column {i + 1}"
        if i in scope.times:
            out.append(label)
            continue
        key = scope.cell("netid", i), scope.cell("port", i), period_cell(scope, i)
        if label in taken:
            own = [x for x, y in zip(_key_words(key), keys[label], strict=True) if x[0] != y and x[0]]
            label = f"{label} ({', '.join(word for _, word in own)})" if own else label
        base, number = label, 1
        while label in taken:
            label, number = f"{base} ({number})", number + 1
        taken.add(label)
        keys.setdefault(label, key)
        out.append(label)
    return out


def _key_words(key: tuple[str, str, str]) -> Iterator[tuple[str, str]]:
    yield key[0], key[0]
    yield key[1], f"port {key[1]}"
    yield key[2], f"{key[2]} ms"


def period_cell(scope: Scope, column: int) -> str:
    """Sample time of a channel as written, or an empty text."""
    return scope.cell("sampletime[ms]", column) or scope.cell("sampletime", column)


class Repeats:
    """Finds slow samples that "fill with previous value" repeated, and the rows that hold new ones."""

    def __init__(self, scope: Scope, report: Report) -> None:
        self.scope, self.report = scope, report
        self.thinned: list[str] = []
        self.suspected: list[str] = []
        self._rows: dict[tuple[int, int, int], tuple[NDArray[np.int64], NDArray[np.bool_]]] = {}

    def drop(
        self, group: Group, column: int, label: str, stamps: NDArray[np.int64], values: NDArray[Any]
    ) -> tuple[NDArray[np.int64], NDArray[Any]]:
        """Stamps and values without repetitions where the sample time of the header proves them.

        From shape (n,) to (kept,), stamps in ns.
        """
        if len(stamps) < 3:
            return stamps, values
        step = float(np.median(np.diff(stamps[:10_000])))
        try:
            own = float(period_cell(self.scope, column).replace(",", ".")) * 1e6
        except ValueError:
            own = 0.0
        if not 0.0 <= own <= _LONGEST_NS:
            self.report.note(
                f"{self.scope.file.path.name}: the sample time {period_cell(self.scope, column)[:20]!r} of {label} is none; it "
                "was not used"
            )
            own = 0.0
        ratio = round(own / step) if step > 0 else 0
        if own and ratio < 2:
            return stamps, values
        changes = np.flatnonzero(values[1:] != values[:-1]) + 1 if own else _changes(values[:65_536])
        changes = changes[~(np.isnan(values[changes]) & np.isnan(values[changes - 1]))]
        if not own:
            if len(changes) > 20 and np.gcd.reduce(np.diff(changes)) > 1:
                self.suspected.append(label)
            return stamps, values
        period = round(own)
        zero = int(stamps[changes[0]] if len(changes) else stamps[0])
        phase = (stamps[changes] - zero) % period
        if len(changes) and (np.minimum(phase, period - phase) > step / 2).any():
            if len(changes) * ratio < 1.5 * len(stamps):
                self.suspected.append(label)
            return stamps, values
        key = group.first, period, zero % period
        if key not in self._rows:
            phase = (stamps - zero + round(step / 2)) % period
            fresh = phase < step
            self._rows[key] = compressed(stamps, fresh, self.report.store), fresh
        self.thinned.append(label)
        at, fresh = self._rows[key]
        return at, compressed(values, fresh, self.report.store)

    def finish(self) -> None:
        """Tell what was found."""
        name = self.scope.file.path.name
        if self.thinned:
            self.report.note(
                f"{name}: {_some(self.thinned)} repeat slower samples in every row (fill with previous value); the "
                "repetitions were left out"
            )
        if self.suspected:
            self.report.note(
                f"{name}: {_some(self.suspected)} change only every few rows, so they probably repeat slower samples (fill "
                "with previous value)"
            )


def _changes(values: NDArray[Any]) -> NDArray[np.int64]:
    return np.flatnonzero(values[1:] != values[:-1]) + 1


def _some(names: list[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
