"""The head of a TwinCAT Scope text export: separator, channel rows, start time, first row of data."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.readers.tables.rows import Dialect
from replay.readers.tables.text_file import TextFile, decoded
from replay.readers.tables.time_cells import FILETIME_EPOCH

HOW = "export again with a tab or semicolon as separator, a point as decimal sign, full header and one time line each"
START = ("starttime of export", "startrecord")
_STOP = ("endtime of export", "endrecord")
_ROWS = frozenset(
    (
        *("name", "symbolcomment", "data-type", "sampletime[ms]", "sampletime", "variablesize", "symbolbased"),
        *("indexgroup", "indexoffset", "symbolname", "netid", "port", "offset", "scalefactor", "bitmask"),
        *("unit", "unit scalefactor", "unit offset"),
    )
)
_HEADS = (256 << 10, 4 << 20, 64 << 20)
_LINES = 5000
_SAMPLE = 256 << 10


@dataclass(frozen=True)
class Scope:
    """A Scope export of which only the head has been read.

    Attributes
    ----------
    file : TextFile
        Its bytes.
    dialect : Dialect
        How its data cells are written.
    sure : bool
        Whether a decimal sign was seen in the data.
    rows : dict[str, list[str]]
        Channel rows by their key in lower case, each cell at its column; rows that the separator tore apart and that
        could not be mended are as long as they came.
    times : tuple[int, ...]
        Time columns: the first of each group.
    skip : int
        Bytes before the first row of data.
    sample : bytes
        First rows of data.
    start_ns : int or None
        Start of the recording.
    metadata : dict[str, str]
        What else the head says.
    """

    file: TextFile
    dialect: Dialect
    sure: bool
    rows: dict[str, list[str]]
    times: tuple[int, ...]
    skip: int
    sample: bytes
    start_ns: int | None
    metadata: dict[str, str]

    def missing_s(self, last_ns: int) -> float | None:
        """By how much the head has the recording end later than a last stamp [s]; None where it does not say when it ends."""
        found = re.match(
            r"\d{17,19}(?!\d)", self.metadata.get("scope.endtime", self.metadata.get("scope.endrecord", ""))
        )
        if found is None or abs(stop := (int(found[0]) - FILETIME_EPOCH) * 100) >= 2**62:
            return None
        return (stop - last_ns) * 1e-9

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.rows["name"])

    @property
    def ends_in_eof(self) -> bool:
        """Whether the export is of the dialect whose last line is ``EOF``."""
        return "sampletime[ms]" in self.rows and "indexgroup" in self.rows

    def commas(self) -> Scope:
        """Return the same export with a decimal comma."""
        return replace(self, dialect=replace(self.dialect, decimal=","), sure=True)

    def cell(self, key: str, column: int) -> str:
        """Cell of a channel row; empty where the row is absent or torn."""
        cells = self.rows.get(key, [])
        return cells[column] if column < len(cells) <= self.width else ""

    def torn(self, key: str) -> bool:
        """Whether a row is there, but the separator tore its cells apart."""
        return len(self.rows.get(key, [])) > self.width


def open_scope(path: Path, report: Report) -> Scope:
    """Read the head of an export.

    Raises
    ------
    LogError
        Where the export cannot be understood; the message says how to export again.
    """
    file = TextFile(path, report)
    for size in _HEADS:
        head = file.head(size)
        text = decoded(head[:4096])
        separator = text[len("Name") : len("Name") + 1]
        if separator in (" ", "\n", "\r", "") or not separator.isascii():
            raise LogError(f"{path}: a blank separates its columns, so names cannot be distinguished; {HOW}")
        lines = head.split(b"\n", _LINES)[:_LINES]
        rows, metadata, last, start = _header(lines, separator)
        first = _data_line(lines, last)
        if first is not None or len(head) < size:
            break
    if "name" not in rows:
        raise LogError(f"{path}: it has no row of channel names; {HOW}")
    if first is None:
        raise LogError(
            f"{path}: no row of data follows its header; the recording is empty or was cut off; record it again"
        )
    if not _is_utf8(b"\n".join(lines[:first])):
        report.note(f"{path.name} is not UTF-8; it was read as Windows-1252, so some letters may be wrong")
    skip = sum(len(line) + 1 for line in lines[:first])
    sample = file.head(skip + _SAMPLE)[skip:]
    if len(sample) >= _SAMPLE:
        sample = sample[: sample.rfind(b"\n") + 1]
    dialect, sure = _dialect(path, sample + file.tail(skip), separator)
    return _checked(path, Scope(file, dialect, sure, rows, (), skip, sample, start, metadata), report)


def _is_utf8(text: bytes) -> bool:
    try:
        text.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def _header(lines: Sequence[bytes], separator: str) -> tuple[dict[str, list[str]], dict[str, str], int, int | None]:
    """Channel rows by lower-case key, facts, line of the last header row, and start of the recording [ns]."""
    rows: dict[str, list[str]] = {}
    metadata: dict[str, str] = {}
    last, start = 0, None
    for i, line in enumerate(lines):
        cells = decoded(line).split(separator)
        key = cells[0].strip().lower()
        if i < 2 and key in ("name", "file"):
            metadata[f"scope.{key}"] = cells[1].strip() if len(cells) > 1 else ""
        elif key in START or key in _STOP:
            last = i
            metadata[f"scope.{key.split()[0]}"] = " ".join(c.strip() for c in cells[1:] if c.strip())
            if key in START and len(cells) > 1 and re.fullmatch(r"\d{17,19}", cells[1].strip()):
                start = (int(cells[1]) - FILETIME_EPOCH) * 100
        elif key in _ROWS and len(cells) > 1 and key not in rows and (key == "name" or "name" in rows):
            rows[key] = _trimmed(cells)
            last = i
    return rows, metadata, last, start if start is not None and abs(start) < 2**62 else None


def _trimmed(cells: list[str]) -> list[str]:
    cells = [c.strip() for c in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _data_line(lines: Sequence[bytes], last: int) -> int | None:
    """First line of data: after the header and a trigger table, its first cell is a number."""
    trigger = False
    for i in range(last + 1, len(lines)):
        line = lines[i]
        if line[:12].lower() == b"triggergroup":
            trigger = True
        elif not line.strip():
            trigger = False
        elif not trigger and re.match(rb"\s*[+-]?[.,]?\d", line) and not lines[i - 1].strip():
            return i
    return None


def _dialect(path: Path, sample: bytes, separator: str) -> tuple[Dialect, bool]:
    """Decimal sign of the data cells alone."""
    comma = separator != "," and re.search(rb"\d,\d", sample) is not None
    point = re.search(rb"\d\.\d", sample) is not None
    if comma and point:
        raise LogError(f"{path}: numbers hold both point and comma (thousands separators?); {HOW}")
    return Dialect(separator, "," if comma else ".", False), comma or point or separator == ","


def _checked(path: Path, scope: Scope, report: Report) -> Scope:
    """Find the time columns and compare the rows of data with the header."""
    mark = scope.dialect.separator.encode()
    counts = [
        len(x.rstrip(b" \r").removesuffix(mark).split(mark)) for x in scope.sample.split(b"\n")[:20_000] if x.strip()
    ]
    width = max((c for c in counts if c), default=0)
    rows = dict(scope.rows)
    if len(rows["name"]) > width and "," in scope.dialect.separator:
        rows = {key: _joined(cells, scope.dialect.separator, width) for key, cells in rows.items()}
    names = rows["name"]
    times = _time_columns(rows)
    rows = {key: _mended(cells, key, times, len(names)) for key, cells in rows.items()}
    if times[:1] != [0] or len(times) == len(names):
        raise LogError(f'{path}: its time columns cannot be found (timelines "None"?); {HOW}')
    if sum(c > len(names) for c in counts) > max(1, len(counts) // 100):
        raise LogError(
            f"{path}: rows of data have {width} cells, its header names {len(names)} columns; "
            f"{scope.dialect.separator!r} is probably both separator and decimal sign; {HOW}"
        )
    if times == [0] and width == len(names) - 1:
        raise LogError(f'{path}: rows of data have one cell less than the header (timelines "None"?); {HOW}')
    if scope.start_ns is None:
        report.note(f"{path.name} states no start time; stamps relative to it count from zero")
    return replace(scope, rows=rows, times=tuple(times))


def _time_columns(rows: dict[str, list[str]]) -> list[int]:
    """Columns in which every row of full width repeats its own key."""
    width = len(rows["name"])
    full = {key: cells for key, cells in rows.items() if len(cells) == width}
    return [i for i in range(width) if all(cells[i].lower() == key for key, cells in full.items())]


def _joined(cells: list[str], separator: str, width: int) -> list[str]:
    """Put together the halves of symbols like ``a[1,2]`` if the row then fits."""
    out: list[str] = []
    for cell in cells:
        if out and out[-1].count("[") > out[-1].count("]"):
            out[-1] += separator + cell
        else:
            out.append(cell)
    return out if len(out) == width else cells


def _mended(cells: list[str], key: str, times: list[int], width: int) -> list[str]:
    """Put together decimal numbers that the separator tore apart in every cell of a group."""
    if len(cells) <= width:
        return cells
    starts = [i for i, cell in enumerate(cells) if cell.lower() == key]
    if len(starts) != len(times):
        return cells
    out: list[str] = []
    for g, start in enumerate(starts):
        own = cells[start + 1 : starts[g + 1] if g + 1 < len(starts) else len(cells)]
        count = (times[g + 1] if g + 1 < len(times) else width) - times[g] - 1
        if len(own) == 2 * count:
            own = [f"{own[i]},{own[i + 1]}" for i in range(0, len(own), 2)]
        elif len(own) != count:
            return cells
        out += [cells[start], *own]
    return out
