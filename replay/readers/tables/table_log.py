"""From the columns of a plain table to a log."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.log.raw_log import Channel, Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.tables.columns import compressed, pick, unit_of
from replay.readers.tables.time_cells import TimeBase, epoch_ns, spread_seconds
from replay.readers.tables.time_column import TimeColumn


class Finished(Protocol):
    """A column that has all its blocks."""

    def finish(self) -> NDArray[Any]:
        """Return the whole column, shape (n,)."""
        ...


class RowTimes:
    """Stamps of the rows of one table, and which rows are kept.

    Parameters
    ----------
    path : Path
        File, for messages.
    column : TimeColumn
        Time column.
    dated : bool
        Whether its cells are moments [ns since 1970] already.
    options : SourceOptions
        Its epoch.
    window : tuple[int, int] or None
        Time to keep [ns].
    report : Report
        Takes notes and losses.
    """

    def __init__(
        self,
        path: Path,
        column: TimeColumn,
        dated: bool,
        options: SourceOptions,
        window: Window | None,
        report: Report,
    ) -> None:
        self.path, self.column, self.report = path, column, report
        self.name = name = column.name
        self.unit = unit = column.unit
        self.base = TimeBase(
            "iso" if dated else unit, epoch_ns(options, str(path), unit, column.day_ns), f"{path.name}, column {name!r}", report,
            column.part, column.zone,
        )  # fmt: skip
        self._early = None if unit == "dt" else window
        self._late = window if unit == "dt" else None
        self._stamps = report.store.column(np.int64)
        self.seen = 0

    def keep(self, cells: NDArray[Any], parts: NDArray[Any] | None = None) -> NDArray[np.bool_]:
        """Take the time cells of a block, and parts of its seconds, each of shape (m,); return which of its rows are kept."""
        stamps = self.base.stamps(cells, parts)
        keep = pick(stamps, self._early)
        self.seen += len(stamps)
        self._stamps.append(stamps[keep])
        return keep

    def finish(self) -> tuple[NDArray[np.int64], NDArray[np.bool_] | None]:
        """Stamps of all kept rows, and which of them remain (None: all).

        Stamps [ns] of shape (kept,), flags of shape (rows,).

        Raises
        ------
        LogError
            Where no row has a time.
        """
        if self.seen and self.base.missing == self.seen:
            raise LogError(
                f"{self.path}: column {self.name!r} holds no readable time in {self.unit}; give [sources] time and "
                "time_unit"
            )
        self.base.finish()
        stamps = self._stamps.finish()
        if self.unit != "dt" or not len(stamps):
            return stamps, None
        stamps = spread_seconds(stamps, self.base.label, self.report)
        if self._late is None:
            return stamps, None
        remain = pick(stamps, self._late)
        return compressed(stamps, remain, self.report.store), remain


#: What a note on columns of text says.
TEXT_LEFT_OUT = "columns of text were left out"


def table_log(
    path: Path, form: str, clock: Clock, times: RowTimes, columns: Mapping[str, Finished], texts: Collection[str],
    metadata: Mapping[str, str],
) -> RawLog:  # fmt: skip
    """Put the columns of a table together.

    Parameters
    ----------
    path : Path
        File.
    form : str
        Format.
    clock : str
        Clock asked for.
    times : RowTimes
        Stamps.
    columns : Mapping[str, Finished]
        Columns of numbers.
    texts : Collection[str]
        Columns left out, for a note.
    metadata : Mapping[str, str]
        What else the file says.

    Raises
    ------
    LogError
        Where no row has a time.
    """
    at, remain = times.finish()
    report = times.report
    channels: dict[str, Channel] = {}
    for label, column in columns.items():
        values = column.finish() if remain is None else compressed(column.finish(), remain, report.store)
        channels[label] = Channel(
            label, "", label, at, values, unit_of(label), "text" if values.dtype == object else str(values.dtype)
        )
    if texts:
        report.note(f"{path.name}: {TEXT_LEFT_OUT}: {', '.join([*texts][:6])}")
    back = int(sum(np.count_nonzero(np.diff(at[i : i + 1_048_577]) < 0) for i in range(0, len(at), 1_048_576)))
    if back > 0.01 * len(at):
        report.note(f"{path.name}: {back} of {len(at)} stamps are earlier than the one before")
    topic = TopicInfo(path.name, "table", len(at), "table", tuple(channels))
    start, stop = (int(at.min()), int(at.max())) if len(at) else (0, 0)
    said = tuple(report.notes), tuple(report.damage)
    summary = LogSummary(str(path), form, start, stop, (topic,), *said, metadata)
    return RawLog(str(path), form, clock, channels, summary, report.store)
