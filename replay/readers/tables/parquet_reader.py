"""Parquet tables, row group by row group."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.raw_log import Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.common.compiled import plain
from replay.readers.tables.columns import ArrayColumn, unique_names
from replay.readers.tables.iso_kernel import iso_many
from replay.readers.tables.row_kernel import MISSING
from replay.readers.tables.table_log import Finished, RowTimes, table_log
from replay.readers.tables.text_cells import TextColumn
from replay.readers.tables.time_cells import TimeBase, epoch_ns
from replay.readers.tables.time_column import TimeColumn, find_time, in_zone

_CELLS = 1 << 21
_SAMPLE = 20_000
_SECOND_NS = 1_000_000_000
_ROUNDING = 1000  # statistics of dates may come back in whole microseconds [ns]
MAX_GROUP = 16 << 30
_DAMAGE = (pa.ArrowException, OSError, ValueError, KeyError, TypeError, OverflowError, MemoryError, IndexError)


class ParquetReader:
    """Reader of Parquet files."""

    format = "parquet"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with Parquet's magic bytes."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(4) == b"PAR1"

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the columns from the footer; the time column alone is looked at, at both ends.

        Raises
        ------
        LogError
            Where the file cannot be read.
        """
        report = Report()
        with _opened(path) as file:
            table = _Parquet(path, file, report)
            time = table.time(options)
            unit = "iso" if table.dated(time.name) else time.unit
            base = TimeBase(
                unit, epoch_ns(options, str(path), time.unit, time.day_ns), path.name, Report(), time.part, time.zone
            )
            ends = [base.stamps(*cells) for cells in table.ends(time.names)]
            given = np.concatenate(ends) if ends else np.empty(0, np.int64)
            given = given[given != MISSING]
            start, stop = (int(given.min()), int(given.max())) if len(given) else (0, 0)
            fields = tuple(n for n in table.numeric if n not in time.names)
            topic = TopicInfo(path.name, "table", file.metadata.num_rows, "table", fields)
        return LogSummary(str(path), self.format, start, stop, (topic,), tuple(report.notes), tuple(report.damage))

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
        store: ColumnStore | None = None,
        texts: bool = False,
    ) -> RawLog:
        """Read all columns of numbers, and of texts where asked for; row groups whose statistics lie outside the window are not opened.

        Raises
        ------
        LogError
            Where the file cannot be read or has no time column.
        """
        report = Report(store=store or ColumnStore())
        with _opened(path) as file:
            table = _Parquet(path, file, report)
            time = table.time(options)
            times = RowTimes(path, time, table.dated(time.name), options, window, report)
            columns = {n: ArrayColumn(report.store) for n in table.numeric if n not in time.names}
            words = {n: TextColumn() for n in table.words if n not in time.names} if texts else {}
            groups = table.groups(time, epoch_ns(options, str(path), time.unit, time.day_ns), window)
            for cells in table.blocks([*time.names, *columns, *words], groups):
                keep = times.keep(*(cells[n] for n in time.names))
                for label, column in columns.items():
                    column.append(cells[label][keep])
                for label, word in words.items():
                    word.append(cells[label].tolist(), keep)
            left = [n for n in table.texts if n not in words]
            every: dict[str, Finished] = {**columns, **words}
            return table.named(table_log(path, self.format, clock, times, every, left, table.about))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            yield file
    except _DAMAGE as error:
        said = " ".join(str(error).split())[:200]
        raise LogError(f"{path} is a damaged Parquet file ({said}); copy or write it again") from error


class _Parquet:
    """Columns of an open file under unique names."""

    def __init__(self, path: Path, file: Any, report: Report) -> None:
        self.path, self.file, self.report = path, file, report
        schema = file.schema_arrow
        names = unique_names(list(schema.names))[0]
        # What a conversion of a log has written about it (see `replay.export.raw_log`).
        about = {
            k.decode(): v.decode("utf-8", "replace") for k, v in (schema.metadata or {}).items() if k[:6] == b"mfhca."
        }
        self.about: dict[str, str] = about if "mfhca.time" in about else {}
        twice = len(set(schema.names)) < len(schema.names)
        flat = [i for i, field in enumerate(schema) if not pa.types.is_nested(field.type)]
        self.numeric = {names[i]: schema.field(i) for i in flat if _is_number(schema.field(i).type)}
        self.texts = [names[i] for i in range(len(names)) if names[i] not in self.numeric]
        self.words = {names[i]: schema.field(i) for i in flat if _is_text(schema.field(i).type)}
        if twice:
            raise LogError(f"{path} has two columns of the same name; rename one of them")
        rows = file.metadata.num_rows
        if not rows:
            raise LogError(f"{path} has {len(names)} columns and no row of data; record or export it again")
        held = sum(file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups))
        if held != rows:
            report.lost(f"{path.name}: its footer counts {rows} rows, its row groups {held}")

    def time(self, options: SourceOptions) -> TimeColumn:
        """Find the time column."""
        stated = self.about.get("mfhca.time")
        if stated in self.numeric and options.time is None:
            return TimeColumn(stated, "ns")
        wanted = (options.time or "").strip()
        dated = [n for n in self.texts if n == wanted and options.time_unit in ("iso", "dt")]
        if dated:
            field = self.file.schema_arrow.field(wanted)
            self.numeric[wanted] = field
            self.texts.remove(wanted)
        labels = list(self.numeric)
        first = next(self.blocks(labels, [0], _SAMPLE), None)
        sample = first if first is not None else {n: np.empty(0) for n in labels}
        shown = {n: c.view("M8[ns]") if self.dated(n) and c.dtype == np.int64 else c for n, c in sample.items()}
        found = find_time(self.path, shown, options, self.report)
        kind = self.numeric[found.name].type
        stated = pa.types.is_timestamp(kind) and kind.tz
        return in_zone(self.path, found, options, self.report, ":00Z" if stated else None)

    def named(self, log: RawLog) -> RawLog:
        """Give the channels of a converted log their topics, fields, types and units again."""
        if not self.about:
            return log
        channels = {}
        for name, channel in log.channels.items():
            about = self.numeric[name] if name in self.numeric else self.words[name]
            told = {k: v.decode("utf-8", "replace") for k, v in (about.metadata or {}).items()}
            channels[name] = replace(
                channel, topic=told.get(b"topic", ""), field=told.get(b"field", name), unit=told.get(b"unit"),
                type_name=told.get(b"type", channel.type_name),
            )  # fmt: skip
        return replace(log, channels=channels)

    def dated(self, name: str) -> bool:
        """Whether a column holds moments rather than numbers."""
        kind = self.numeric[name].type
        return bool(pa.types.is_timestamp(kind) or pa.types.is_date(kind) or not _is_number(kind))

    def groups(self, time: TimeColumn, epoch: int, window: Window | None) -> list[int]:
        """Row groups whose stamps may lie in the window, by the statistics of the time column."""
        name, unit, part, _, zone = time
        every = list(range(self.file.metadata.num_row_groups))
        if window is None or unit in ("dc32", "dt"):
            return every
        index = self.file.schema_arrow.names.index(name) if name in self.file.schema_arrow.names else -1
        flat = [i for i in range(len(self.file.schema)) if self.file.schema.column(i).path == name]
        if index < 0 or len(flat) != 1:
            return every
        slack = _ROUNDING if pa.types.is_temporal(self.numeric[name].type) else 0 if part is None else _SECOND_NS
        kept = []
        for group in every:
            statistics = self.file.metadata.row_group(group).column(flat[0]).statistics
            if statistics is None or not statistics.has_min_max:
                kept.append(group)
                continue
            ends = pa.array([statistics.min, statistics.max]).cast(self.numeric[name].type)
            low, high = TimeBase(unit, epoch, "", Report(), None, zone).stamps(_cells(ends)).tolist()
            if MISSING in (low, high) or (low - slack < window[1] and high + slack >= window[0]):
                kept.append(group)
        return kept

    def ends(self, names: Sequence[str]) -> Iterator[list[NDArray[Any]]]:
        """Time cells of the first and the last row group, one array per column of the clock."""
        last = self.file.metadata.num_row_groups - 1
        for group in sorted({0, last}):
            for cells in self.blocks(names, [group]):
                yield [cells[n] for n in names]

    def blocks(self, names: Sequence[str], groups: list[int], size: int = 1 << 17) -> Iterator[dict[str, NDArray[Any]]]:
        """Columns by name, a limited number of rows at a time; integers of the first stay exact."""
        own = [(self.numeric[n] if n in self.numeric else self.words[n]).name for n in names]
        size = max(min(size, _CELLS // max(len(own), 1)), 1)
        for group in groups:
            declared = self.file.metadata.row_group(group).total_byte_size
            if declared > MAX_GROUP:
                raise LogError(
                    f"{self.path}: row group {group} declares {declared} bytes; at most {MAX_GROUP} are read; write it "
                    "with smaller row groups"
                )
            missing = self.file.metadata.row_group(group).num_rows
            for batch in self.file.iter_batches(size, row_groups=[group], columns=own, use_threads=False):
                missing -= batch.num_rows
                yield {
                    n: _cells(batch.column(o), n == names[0]) if n in self.numeric else _texts(batch.column(o))
                    for n, o in zip(names, own, strict=True)
                }
            if missing and own:
                self.report.lost(
                    f"{self.path.name}: row group {group} gives {abs(missing)} rows {'less' if missing > 0 else 'more'} than its footer counts"
                )


def _is_number(kind: Any) -> bool:
    if pa.types.is_dictionary(kind):
        return False
    numeric = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
    dated = pa.types.is_timestamp(kind) or pa.types.is_date(kind) or pa.types.is_duration(kind)
    return bool(numeric or dated or pa.types.is_boolean(kind))


def _is_text(kind: Any) -> bool:
    inner = kind.value_type if pa.types.is_dictionary(kind) else kind
    return bool(pa.types.is_string(inner) or pa.types.is_large_string(inner))


def _texts(array: Any) -> NDArray[Any]:
    """Texts of one column as objects; None where there is none."""
    out = np.empty(len(array), object)
    out[:] = array.to_pylist()
    return out


def _cells(array: Any, exact: bool = False) -> NDArray[Any]:
    """Numbers of one column.

    Parameters
    ----------
    array : pyarrow.Array
        The column.
    exact : bool
        Whether integers stay integers where some are missing (`MISSING`).

    Returns
    -------
    NDArray
        Numbers in their own type where none is missing, else float64 with NaN; dates as ns since 1970, `MISSING` where
        there is none; durations in seconds.
    """
    kind = array.type
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        text = array.fill_null("").cast(pa.large_string())
        starts = np.frombuffer(text.buffers()[1], np.int64, len(text) + 1, 8 * text.offset)
        moments: NDArray[np.int64] = iso_many(plain(np.frombuffer(text.buffers()[2] or b"", np.uint8)), starts)
        return moments
    if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
        whole = array.cast(pa.timestamp("ns", getattr(kind, "tz", None))).cast(pa.int64())
        return np.asarray(whole.fill_null(MISSING).to_numpy(zero_copy_only=False), np.int64)
    if pa.types.is_duration(kind):
        return _cells(array.cast(pa.duration("ns")).cast(pa.int64())) / 1e9
    if pa.types.is_boolean(kind):
        array = array.cast(pa.uint8())
    elif pa.types.is_decimal(kind):
        array = array.cast(pa.float64())
    if exact and array.null_count and pa.types.is_integer(array.type):
        array = array.cast(pa.int64()).fill_null(MISSING)
    return np.asarray(array.to_numpy(zero_copy_only=False))
