"""Text exports of TwinCAT Scope, in both of its default dialects and those of older versions."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.raw_log import Channel, Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.tables.columns import compressed
from replay.readers.tables.row_kernel import FILLED, FIRST_LONG, LONG, MISSING, REAL, TEXT, WIDEST
from replay.readers.tables.rows import Rows
from replay.readers.tables.text_file import first_text
from replay.readers.tables.text_table import is_text, row_count
from replay.readers.twincat.text_groups import Group, Repeats, finished_stamps, labels, make_groups, period_cell
from replay.readers.twincat.text_header import HOW, START, Scope, open_scope

_SPARSE = 1024  # right-hand groups may end early
_MISSING_S = 1.0  # at the end, by the header


class TwincatCsvReader:
    """Reader of TwinCAT Scope text exports."""

    format = "twincat"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with Scope's ``Name`` line and its start time follows."""
        if not path.is_file():
            return False
        lines = first_text(path).splitlines()[:12]
        found = [line.strip().lower() for line in lines]
        return bool(found) and found[0].startswith("name") and any(f.startswith(START) for f in found)

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the groups of channels from the head and the tail of the export.

        Raises
        ------
        LogError
            Where the export cannot be understood.
        """
        report = Report()
        scope = open_scope(path, report)
        head, kinds, rows = _sampled(scope, scope.sample)
        tail, tail_kinds, _ = _sampled(scope, scope.file.tail(scope.skip))
        count, exact = row_count(scope.file, scope.skip)
        count -= scope.ends_in_eof
        names, texts = labels(scope), is_text(rows)
        topics: list[TopicInfo] = []
        ends: list[int] = []
        for g, group in enumerate(make_groups(scope, head, kinds, Report())):
            first, last = _stamps(group, head, kinds), _stamps(group, tail, tail_kinds)
            step = float(np.median(np.diff(first))) if len(first) > 1 else 0.0
            rows_of, known = count, exact and (g == 0 or len(last) > 0)
            if len(first):
                zero = int(first[0])
                until = (
                    int(last[-1])
                    if len(last)
                    else zero + int(step * max(count - 1, 0))
                    if g == 0
                    else max(ends, default=zero)
                )
                ends += [int(first.min()), max(until, zero)]
                if g and not len(last) and step > 0:
                    rows_of = int((until - zero) / step) + 1
            note = "" if known else "rows and end are estimated from the first rows; reading the file counts them"
            fields = tuple(names[i] for i in group.columns if not texts[i])
            topics.append(TopicInfo(_group_name(scope, g, group), "table", rows_of, "table", fields, note))
        start, stop = (min(ends), max(ends)) if ends else (0, 0)
        said = tuple(report.notes), tuple(report.damage)
        return LogSummary(str(path), self.format, start, stop, tuple(topics), *said, scope.metadata)

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
        """Read all channels.

        Raises
        ------
        LogError
            Where the export cannot be understood; the message says how to export again.
        """
        report = Report(store=store or ColumnStore())
        scope = open_scope(path, report)
        found = _Pass(scope, window, report.store)
        if not scope.sure and any("," in cell for cell in found.rows.examples.values()):
            scope = scope.commas()
            found = _Pass(scope, window, report.store)
        for text in found.report.damage:
            report.lost(text)
        return _log(scope, found, options, clock, window, report)


class _Pass:
    """One pass over the rows of an export."""

    def __init__(self, scope: Scope, window: Window | None, store: ColumnStore) -> None:
        self.report = Report(store=store)
        head, kinds, _ = _sampled(scope, scope.sample)
        self.groups = make_groups(scope, head, kinds, self.report)
        self.rows = Rows(scope.file.path.name, scope.dialect, scope.width, self.report, _SPARSE)

        def end(text: bytes) -> bytes:
            return _without_eof(scope, text, self.report)

        for cells in self.rows.blocks(scope.file.blocks(scope.skip), scope.skip, end):
            for group in self.groups:
                group.add(cells, self.rows.kinds, window)


def _without_eof(scope: Scope, text: bytes, report: Report) -> bytes:
    """Cut ``EOF`` off; without it the full dialect was cut off, mostly in the middle of a row."""
    body = text.rstrip(b"\0 \r\n\t")
    if body.endswith(b"EOF"):
        return body[:-3]
    if scope.ends_in_eof:
        rest = text.rstrip(b"\0")
        torn = "" if rest.endswith(b"\n") else " and its last row left out"
        report.lost(f"{scope.file.path.name} does not end in EOF; the export was cut off{torn}")
        return rest[: rest.rfind(b"\n") + 1]
    before, _, last = text.rpartition(b"\n")
    mark = scope.dialect.separator.encode()
    if last.strip() and last.count(mark) < before[before.rfind(b"\n") + 1 :].count(mark):
        report.lost(f"{scope.file.path.name} ends in the middle of a row, which was left out")
        return before + b"\n"
    return text


def _sampled(scope: Scope, text: bytes) -> tuple[NDArray[np.int64], NDArray[np.int8], Rows]:
    """Cells of some rows, shape (width, m), their kinds, and the parser with its counters."""
    rows = Rows(scope.file.path.name, scope.dialect, scope.width, Report())
    text = text.rstrip(b"\0 \r\n\t").removesuffix(b"EOF")
    cells = next(rows.blocks([text], 0), np.empty((scope.width, 0), np.int64))
    return cells, rows.kinds, rows


def _stamps(group: Group, cells: NDArray[np.int64], kinds: NDArray[np.int8]) -> NDArray[np.int64]:
    times = cells[group.first]
    stamps = group.base.stamps(times.view(np.float64) if kinds[group.first] == REAL else times)
    given: NDArray[np.int64] = stamps[stamps != MISSING]
    return given


def _group_name(scope: Scope, number: int, group: Group) -> str:
    period = period_cell(scope, group.first + 1)
    return f"group {number + 1}" + (f" ({period} ms)" if period else "")


def _log(
    scope: Scope, found: _Pass, options: SourceOptions, clock: Clock, window: Window | None, report: Report
) -> RawLog:
    path, rows = scope.file.path, found.rows
    if rows.table[LONG]:
        report.lost(
            f"{path.name}: {rows.table[LONG]} rows have more cells than the header names (the first at byte "
            f"{rows.table[FIRST_LONG]}); the cells beyond were left out"
        )
    if rows.table[WIDEST] < scope.width:
        report.note(f"{path.name}: its last {scope.width - rows.table[WIDEST]} columns hold no data")
    texts, names, repeats = is_text(rows), labels(scope), Repeats(scope, report)
    channels: dict[str, Channel] = {}
    topics = []
    for g, group in enumerate(found.groups):
        group.base.report = report
        stamps, remain = finished_stamps(scope, group, window, report)
        bad = int(rows.columns[group.first, TEXT])
        if bad:
            report.lost(f"{group.base.label}: {bad} time cells are not numbers ({rows.example(group.first)})")
        members = []
        for i, column in group.columns.items():
            label = names[i]
            if texts[i]:
                report.note(f"{path.name}: {label} holds text and was left out ({rows.example(i)})")
                continue
            if rows.columns[i, TEXT]:
                report.lost(
                    f"{path.name}: {rows.columns[i, TEXT]} cells of {label} are not numbers; they became empty "
                    f"({rows.example(i)})"
                )
            values = column.finish() if remain is None else compressed(column.finish(), remain, report.store)
            at, values = repeats.drop(group, i, label, stamps, values)
            shown, unit, kind = scope.rows["name"][i], scope.cell("unit", i), scope.cell("data-type", i)
            members.append(label)
            channels[label] = Channel(
                label, "", shown, at, _scaled(scope, values, i, options, label), _unit(unit), kind
            )
        topics.append(TopicInfo(_group_name(scope, g, group), "table", len(stamps), "table", tuple(members)))
    repeats.finish()
    if not channels or not rows.columns[:, FILLED].any():
        raise LogError(f"{path}: none of its columns holds numbers; {HOW}")
    used = [c.stamps for c in channels.values() if len(c.stamps)]
    start, stop = (int(min(s.min() for s in used)), int(max(s.max() for s in used))) if used else (0, 0)
    missing = scope.missing_s(stop)
    if used and window is None and missing is not None and missing >= _MISSING_S:
        report.note(f"{path.name}: its header has the recording end {missing:.1f} s later than its rows do")
    said = tuple(report.notes), tuple(report.damage)
    summary = LogSummary(str(path), "twincat", start, stop, tuple(topics), *said, scope.metadata)
    return RawLog(str(path), "twincat", clock, channels, summary, report.store)


def _scaled(scope: Scope, values: NDArray[Any], index: int, options: SourceOptions, label: str) -> NDArray[Any]:
    """Values as written, or scaled by the header's factors where the machine file asks for it."""
    if not options.scale:
        return values
    if scope.torn("scalefactor") or scope.torn("offset"):
        raise LogError(
            f"{scope.file.path}: the separator splits ScaleFactor or Offset, so scale = true cannot be applied; {HOW}"
        )
    try:
        gain = float((scope.cell("scalefactor", index) or "1").replace(",", "."))
        offset = float((scope.cell("offset", index) or "0").replace(",", "."))
    except ValueError as error:
        raise LogError(
            f"{scope.file.path}: ScaleFactor or Offset of {label} is not a number; drop scale = true"
        ) from error
    return values * gain + offset


def _unit(text: str) -> str | None:
    unit = text.partition("(")[0].strip()
    return unit or None
