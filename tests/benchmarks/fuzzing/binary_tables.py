"""Binary tables: Parquet, TDMS and TwinCAT's .svdx; their numbers, texts and footers damaged in their places."""

from __future__ import annotations

import io
import random
import struct
from pathlib import Path
from typing import Any

import nptdms
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tests.benchmarks.fuzzing import logs, tdms_made
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.damage import Spot, blindly, reworded, with_number
from tests.benchmarks.fuzzing.parquet_footer import with_lies

COUNT, START = 60, 133_000_000_000_000_000


class _Binary:
    """What binary tables share."""

    name = ""

    def read(self, path: Path, source: random.Random) -> Reading:
        """As every log."""
        return logs.read(path, source)

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """Nothing to compare with."""


class Parquet(_Binary):
    """Parquet files: plain, packed, nested, of odd types; the footer is damaged more often than its share."""

    name = "parquet"

    def corpus(self, folder: Path) -> list[Sample]:
        """Types that recorders and notebooks write."""
        t, n = np.arange(COUNT) / 100, np.arange(COUNT)
        plain = {"t": t, "v": n, "s": [f"x{i}" for i in range(COUNT)]}
        odd = {
            "t": pa.array(n * 10**7 + 10**18, pa.timestamp("ns")), "d": pa.array(n.tolist(), pa.decimal128(9, 2)),
            "list": [[1.0, 2.0]] * COUNT, "b": n % 2 == 0, "h": pa.array((n / 8).astype(np.float16)), "u": n.astype(np.uint64),
            "inner": [{"x": 1.0, "y": "a"}] * COUNT, "none": pa.nulls(COUNT), "gaps": [None if i % 3 else float(i) for i in n],
            "dictionary": pa.array(["a", "b"] * (COUNT // 2)).dictionary_encode(), "date": pa.array(n.tolist(), pa.date32()),
        }  # fmt: skip
        frames = [("plain", plain, {"compression": "none", "use_dictionary": False}), ("snappy", plain, {"compression": "snappy"}),
                  ("zstd", plain, {"compression": "zstd", "write_page_checksum": True}), ("odd", odd, {"version": "2.6"})]  # fmt: skip
        samples = []
        for name, columns, options in frames:
            out, more = io.BytesIO(), dict[str, Any](options)
            pq.write_table(pa.table(columns), out, row_group_size=25, **more)
            samples.append(Sample(name, {"log.parquet": out.getvalue()}, "log.parquet", "log.parquet"))
        return samples

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Damage in the footer, in the pages, or anywhere; or another table."""
        raw = sample.raw
        if source.random() < 0.1:
            return Case(_made_up(source), "made up")
        if source.random() < 0.35:
            part, what = with_lies(raw[-8 - int.from_bytes(raw[-8:-4], "little") : -8], source)
            return Case(
                raw[: -8 - int.from_bytes(raw[-8:-4], "little")] + part + struct.pack("<I", len(part)) + b"PAR1", what
            )
        size = int.from_bytes(raw[-8:-4], "little")
        start = len(raw) - 8 - size
        if source.random() < 0.7:
            part = raw[start:-8]
            if source.random() < 0.8:
                at = source.randrange(len(part))
                part, what = with_number(part, Spot(at, 1, "int"), source), f"byte {at} of the footer"
            else:
                part, what = blindly(part, source)
            size = len(part) if source.random() < 0.9 else source.choice((0, 1, size + 9, 2**31, 2**32 - 1))
            return Case(raw[:start] + part + struct.pack("<I", size % 2**32) + b"PAR1", what)
        return Case(*blindly(raw, source))

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """As many rows as the footer counts."""
        if reading.outcome != "whole" or reading.said:
            return
        try:
            file = pq.ParquetFile(io.BytesIO(case.content))
            checked = sample.name == "zstd" and case.what != "made up"
            numbers = [name for name in file.schema_arrow.names if name != "s"] if checked else None  # text is not read
            rows = pq.read_table(io.BytesIO(case.content), columns=numbers, page_checksum_verification=True).num_rows
        except Exception:  # what it makes of damage is its own
            rows = None
        counted = [t.count for t in reading.content.summary.topics]
        if rows is not None and counted != [rows]:
            raise Finding("silent", f"{counted} rows; pyarrow reads {rows}")
        if rows is None and sample.name == "zstd" and case.what != "made up":
            raise Finding("silent", "pages have checksums, pyarrow refuses them, and nothing says so")


def _made_up(source: random.Random) -> bytes:
    """A sound table that nobody expects."""
    types = [pa.int8(), pa.float64(), pa.string(), pa.binary(), pa.timestamp("s"), pa.timestamp("us", "Europe/Berlin"), pa.duration("ms"), pa.time64("ns"),
             pa.decimal128(38, 10), pa.bool_(), pa.null(), pa.list_(pa.float32()), pa.float16(), pa.date64(), pa.large_string()]  # fmt: skip
    rows = source.choice((0, 1, 2, 30))
    columns, names = [], []
    for k in range(source.choice((0, 1, 2, 6))):
        kind, values = source.choice(types), [source.choice((0, 1, 2**62, None)) for _ in range(rows)]
        try:
            columns.append(pa.array(values, pa.int64()).cast(kind))
        except pa.ArrowException:
            columns.append(pa.array([source.choice((float("nan"), 1e300, k)) for _ in range(rows)], pa.float64()))
        names.append(source.choice(("t", "time", "", "a.b", "x" * 5000, "\n", f"c{k}")))
    out = io.BytesIO()
    try:
        pq.write_table(pa.Table.from_arrays(columns, names=names), out)
    except pa.ArrowException:  # a value that this type cannot have in a file
        return source.randbytes(12)
    return out.getvalue()


class Tdms(_Binary):
    """TDMS files of several segments, types and properties."""

    name = "tdms"

    def corpus(self, folder: Path) -> list[Sample]:
        """Waveforms, a time channel, text, and an index beside."""
        wave = {
            "wf_start_time": np.datetime64("2022-06-15T10:00:00", "us"),
            "wf_increment": 0.001,
            "wf_start_offset": 0.0,
        }
        n = np.arange(float(COUNT))
        stamps = np.datetime64("2022-06-15T10:00:00", "us") + (n * 1000).astype("timedelta64[us]")
        tables = {
            "wave": [nptdms.ChannelObject("G", "a", n, {**wave, "unit_string": "rpm"}), nptdms.ChannelObject("G", "i", n.astype(np.int16), wave)],
            "times": [nptdms.ChannelObject("G", "time", stamps), nptdms.ChannelObject("G", "v", n.astype(np.float32)),
                      nptdms.ChannelObject("H", "s", [f"x{i}" for i in range(COUNT)])],
        }  # fmt: skip
        samples = []
        for name, channels in tables.items():
            path = folder / f"{name}.tdms"
            with nptdms.TdmsWriter(path) as writer:
                writer.write_segment([nptdms.RootObject({"author": "x", "n": 3}), *channels])
                writer.write_segment(channels)
            samples.append(Sample(name, {"log.tdms": path.read_bytes()}, "log.tdms", "log.tdms"))
        return samples

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Numbers of the segments' lead-ins and metadata, or blind damage."""
        raw = sample.raw
        if source.random() < 0.3:
            return tdms_made.made_up(source)
        if source.random() < 0.3:
            return Case(*blindly(raw, source))
        starts = [k for k in range(len(raw)) if raw.startswith(b"TDSm", k)]
        start = source.choice(starts)
        data = int.from_bytes(raw[start + 20 : start + 28], "little")
        at, size = source.choice(((4, 4), (8, 4), (12, 8), (20, 8), (28, 4)))
        if source.random() < 0.75:
            at, size = 28 + source.randrange(max(data, 1)), source.choice((1, 4, 4, 8))
        return Case(
            with_number(raw, Spot(start + at, size, "int"), source), f"number at {at} of the segment at {start}"
        )


class Svdx(_Binary):
    """TwinCAT Scope recordings."""

    name = "svdx"

    def corpus(self, folder: Path) -> list[Sample]:
        """Two channels in one block."""
        samples = []
        for name, kinds in (("one", ("INT16",)), ("two", ("INT16", "REAL64"))):
            xml = b"\xef\xbb\xbf<P>"
            for k, kind in enumerate(kinds, 1):
                xml += f"<AdsAcquisition><SymbolName>M.{k}</SymbolName><DataType>{kind}</DataType><FileHandle>{k}</FileHandle></AdsAcquisition>".encode()
            xml, blocks = xml + b"</P>", b""
            for k, kind in enumerate(kinds, 1):
                blocks += _block(k, kind)
            starts = [
                40 + len(b"".join(_block(j, kinds[j - 1]) for j in range(1, k))) for k in range(1, len(kinds) + 1)
            ]
            table = b"".join(struct.pack("<QQI", s, len(_block(k, kinds[k - 1])), k) for k, s in enumerate(starts, 1))
            shift = len(table) - 20
            table = b"".join(
                struct.pack("<QQI", s + shift, len(_block(k, kinds[k - 1])), k) for k, s in enumerate(starts, 1)
            )
            raw = struct.pack("<QQI", 20 + len(table) + len(blocks), len(xml), len(kinds)) + table + blocks + xml
            samples.append(Sample(name, {"log.svdx": raw}, "log.svdx", "log.svdx"))
        return samples

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Numbers anywhere, XML, or blind damage."""
        raw = sample.raw
        at = raw.index(b"\xef\xbb\xbf")
        way = source.random()
        if way < 0.3:
            part, what = source.choice((blindly, reworded))(raw[at:], source)
            return Case(raw[:8] + struct.pack("<Q", len(part)) + raw[16:at] + part, f"{what} in the XML")
        if way < 0.4:
            entity = b'<!DOCTYPE P [<!ENTITY a "' + b"x" * 1000 + b'"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
            part = (
                raw[at : at + 3]
                + source.choice((entity, b"<a>" * 5000, b"<!-- " * 100))
                + raw[at + 3 :].replace(b"M.1", b"&b;")
            )
            return Case(raw[:8] + struct.pack("<Q", len(part)) + raw[16:at] + part, "other XML")
        if way < 0.75:
            size = source.choice((2, 4, 8))
            place = source.randrange(0, at - size, 4) if source.random() < 0.6 else source.randrange(at - size)
            return Case(with_number(raw, Spot(place, size, "int"), source), f"number at {place}")
        return Case(*blindly(raw, source))


def _block(number: int, kind: str) -> bytes:
    letter = {"INT16": "h", "REAL64": "d"}[kind]
    head = b"01.00.00.40" + struct.pack("<QQQQQQQ", START, 5, START, START, number, 16, 10_000) + bytes(16) + bytes(4)
    block = head + struct.pack("<Q", len(head) + 8)
    for s in range(5):
        block += struct.pack("<QI", START + s * 100, 3) + b"".join(struct.pack(f"<I{letter}", k, k) for k in range(3))
    return block
