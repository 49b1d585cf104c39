"""Tables as text: CSV, alone and packed, and TwinCAT Scope exports; cells, rows, marks and headers damaged."""

from __future__ import annotations

import gzip
import io
import random
from pathlib import Path

import numpy as np
import pandas as pd
import zstandard

from tests.benchmarks.fuzzing import logs
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.damage import FAR, blindly
from tests.benchmarks.fuzzing.text_made import made_up

COUNT, START = 60, 133_000_000_000_000_000
NUMBERS = (*map(str, FAR), "-0", "1e308", "1e309", "-1e-400", "4.9e-324", "0.1", "1.7976931348623157e308", "123456789.123456789", "5e", "e5",
           "0x1f", "1_000", "+7", ".5", "5.", "1.5.5", "NaN", "nan", "inf", "-Infinity", "1e+16", "1E5", "9007199254740993", "9" * 400,
           "0." + "0" * 350 + "1", "١٢")  # fmt: skip
CELLS = ("", " ", '"', '""', '"a,b"', "text", "#ERR", "\0", "é", "\udcff", "true", "2024-05-01T10:00:00Z", "2024-02-30", "10:00:00.5", "'", "\ufeff",
         "=1+1", "\x1b[31m", "x" * 3000, "1,5", "12/31/24 11:59 PM", "-" * 300)  # fmt: skip


def _plain(i: int) -> list[str]:
    return [f"{i / 10:.1f}", str(i), f'"{i}, x"', f"2024-05-01T10:00:{i % 60:02d}Z", f"{i / 7!r}"]


def _table(rows: list[list[str]], mark: str, end: str = "\n") -> bytes:
    return (end.join(mark.join(row) for row in rows) + end).encode("utf-8", "surrogateescape")


HEADER = ["t", "v [rpm]", "text", "when", "w"]
SIMPLE = [["t", "a", "b"], *([f"{i / 100!r}", str(i * i - 100), repr(i / 7)] for i in range(COUNT))]


def _scope(variant: int) -> bytes:
    head = [
        ["Name", "Scope"], ["File", "x"], ["Starttime of export", str(START), "a", "b"], ["Endtime of export", str(START + 10**7), "a", "b"],
        [""], [""], ["Name", "a", "b", "Name", "c"], ["SymbolComment", "", "", "SymbolComment", ""],
        ["SampleTime[ms]", "1", "1", "SampleTime[ms]", "5"], ["IndexGroup", "1", "1", "IndexGroup", "1"],
        ["SymbolName", "M.a", "M.b", "SymbolName", "M.c"], ["Unit", "rpm", "V (Volt)", "Unit", "(None)"], [""],
    ]  # fmt: skip
    rows = [[str(i), f"{i / 7:.6f}", str(i), str(5 * i), str(i % 3)] for i in range(40)]
    rows += [["40", "1.5", "2"], ["EOF"]]
    mark = ("\t", ";", ",")[variant]
    if variant < 2:
        rows = [[cell.replace(".", ",") for cell in row] for row in rows]
    return _table(head + rows, mark, "\r\n")


class _Text:
    """What text tables share: damage of cells, rows and marks."""

    name = ""

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Blind damage, or other cells, rows and marks."""
        pack = sample.facts.get("pack", "")
        raw = _unpacked(sample.raw, pack)
        if source.random() < 0.15:
            return made_up(pack, source)
        if source.random() < 0.2:
            return Case(*blindly(sample.raw, source))
        if source.random() < 0.2:
            content, what = blindly(raw, source)
            return Case(_packed(content, pack), what)
        mark, end = sample.facts["mark"], "\r\n" if b"\r\n" in raw else "\n"
        rows = [line.split(mark) for line in raw.decode("utf-8", "surrogateescape").split(end)]
        done = [_edited(rows, source) for _ in range(source.choice((1, 1, 1, 2, 4)))]
        if source.random() < 0.1:
            mark = source.choice(",;\t| ")
        if source.random() < 0.1:
            end = source.choice(("\r", "\n\n", "\n\r", "\r\n", "\0\n"))
        content = _table(rows, mark, end)
        if source.random() < 0.05:
            content = content.decode(errors="replace").encode(
                source.choice(("utf-16", "utf-16-be", "utf-8-sig", "utf-32"))
            )
        return Case(_packed(content, pack), "; ".join(done)[:200], {"edits": len(done)})

    def read(self, path: Path, source: random.Random) -> Reading:
        """As every log."""
        return logs.read(path, source)


class Csv(_Text):
    """Tables of comma-separated values."""

    name = "csv"

    def corpus(self, folder: Path) -> list[Sample]:
        """Text and numbers, numbers alone, other marks, and packed ones."""
        mixed = _table([HEADER, *map(_plain, range(COUNT))], ",")
        simple = _table(SIMPLE, ",")
        german = _table([[c.replace(".", ",") for c in row] for row in SIMPLE], ";")
        files = [
            ("mixed", mixed, ",", ""),
            ("simple", simple, ",", ""),
            ("simple 2", simple, ",", ""),
            ("german", german, ";", ""),
        ]
        files += [
            ("gzip", gzip.compress(mixed, mtime=0), ",", "gz"),
            ("zstd", zstandard.ZstdCompressor(write_checksum=True).compress(mixed), ",", "zst"),
        ]
        return [
            Sample(name, {(log := f"log.csv{'.' + pack if pack else ''}"): raw}, log, log, {"mark": mark, "pack": pack})
            for name, raw, mark, pack in files
        ]

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """What a checksum covers is whole; numbers are those that pandas reads."""
        if reading.outcome != "whole":
            return
        if sample.facts["pack"] and not reading.said:
            _unpacks(case.content, sample.facts["pack"])
        if sample.name.startswith("simple"):
            _as_pandas(case.content, reading)


def _unpacks(content: bytes, pack: str) -> None:
    try:
        if pack == "gz":
            gzip.decompress(content)
        else:
            zstandard.ZstdDecompressor().decompressobj().decompress(content)
    except (OSError, EOFError, zstandard.ZstdError, Exception) as error:
        raise Finding(
            "silent", f"the packed table is damaged ({type(error).__name__}: {error}), and nothing says so"
        ) from error


def _as_pandas(content: bytes, reading: Reading) -> None:
    """Columns a and b hold what pandas reads, where it reads numbers and as many rows."""
    try:
        text = content.decode("ascii")
        lines = text.split("\n")
        if (
            any(c in text for c in "\"'\r\0\t ;#")
            or lines[0] != "t,a,b"
            or any(line.count(",") != 2 for line in lines[:-1])
            or lines[-1]
        ):
            return  # a table of another kind: what it means is not pandas' to say
        frame = pd.read_csv(io.BytesIO(content), float_precision="round_trip", dtype=np.float64)
    except Exception:  # what it makes of damage is its own
        return
    stamps = frame["t"].to_numpy()
    if not (np.isfinite(stamps).all() and (np.diff(stamps) > 0).all() and (np.abs(stamps) < 1e6).all()):
        return
    for name in ("a", "b"):
        channel = reading.content.channels.get(name)
        theirs = frame[name].to_numpy()
        if channel is None:
            if reading.said or not np.isfinite(theirs).any():
                continue
            raise Finding("silent", f"column {name} is missing; pandas reads {len(theirs)} numbers")
        ours = np.asarray(channel.values, np.float64)
        if len(ours) != len(theirs) and not reading.said:
            raise Finding("silent", f"column {name} has {len(ours)} rows; pandas reads {len(theirs)}")
        if len(ours) == len(theirs) and not np.array_equal(ours, theirs, equal_nan=True):
            at = int(np.flatnonzero(~((ours == theirs) | (np.isnan(ours) & np.isnan(theirs))))[0])
            if not (reading.said and np.isnan(ours[at])):
                raise Finding("silent", f"column {name}, row {at}: {ours[at]!r}; pandas reads {theirs[at]!r}")


class Scope(_Text):
    """Exports of TwinCAT Scope."""

    name = "twincat"

    def corpus(self, folder: Path) -> list[Sample]:
        """Three dialects."""
        return [
            Sample(f"scope {k}", {"log.csv": _scope(k)}, "log.csv", "log.csv", {"mark": "\t;,"[k]}) for k in range(3)
        ]

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """Nothing in an export counts or proves its rows but its last line; with a head that is damaged too, it need not have one."""
        ended = b"EOF" in case.content.replace(b"\0", b"")
        sure = case.facts.get("edits") == 1 and not reading.said
        if reading.outcome == "whole" and sure and not ended and reading.content.format == "twincat":
            raise Finding("silent", "the export has no end, and nothing says so")


def _unpacked(raw: bytes, pack: str) -> bytes:
    if pack == "gz":
        return gzip.decompress(raw)
    return zstandard.ZstdDecompressor().decompress(raw) if pack == "zst" else raw


def _packed(raw: bytes, pack: str) -> bytes:
    if pack == "gz":
        return gzip.compress(raw, 1, mtime=0)
    return zstandard.ZstdCompressor(write_checksum=True).compress(raw) if pack == "zst" else raw


def _edited(rows: list[list[str]], source: random.Random) -> str:
    """Change one cell, row or column."""
    k = source.randrange(len(rows) if source.random() < 0.7 else min(len(rows), 14))
    row = rows[k]
    way = source.random()
    if way < 0.5:
        row[source.randrange(len(row))] = new = source.choice(NUMBERS)
        return f"row {k}: {new[:20]}"
    if way < 0.68:
        row[source.randrange(len(row))] = new = source.choice(CELLS)
        return f"row {k}: {new[:20]!r}"
    if way < 0.74:
        row.insert(source.randrange(len(row) + 1), source.choice(CELLS + NUMBERS))
        return f"row {k}: a cell more"
    if way < 0.8:
        row.pop(source.randrange(len(row)))
        if not row:
            row.append("")
        return f"row {k}: a cell less"
    if way < 0.86 and len(rows) > 1:
        rows.pop(k)
        return f"row {k} gone"
    if way < 0.92:
        rows[k:k] = [list(row) for _ in range(source.choice((1, 3, 300)))]
        return f"row {k} again"
    if way < 0.96:
        rows.insert(k, [source.choice(CELLS + NUMBERS) for _ in range(source.choice((1, 5, 2000)))])
        return f"row {k} made up"
    column = source.randrange(max(map(len, rows)))
    value = source.choice(CELLS + NUMBERS)
    for other in rows:
        if column < len(other):
            other[column] = value
    return f"column {column}: {value[:20]!r}"
