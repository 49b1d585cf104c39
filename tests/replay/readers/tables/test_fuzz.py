"""Mutated tables end in columns or in a LogError, never in anything else, and within bounded memory."""

from __future__ import annotations

import gzip
import random
import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import zstandard

from replay.errors import LogError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import open_log

COUNT = 150
START = 133_000_000_000_000_000


def scope(path: Path) -> None:
    head = [
        *("Name\tScope", "File\tx", f"Starttime of export\t{START}\ta\tb", f"Endtime of export\t{START}\ta\tb", "", ""),
        *("Name\ta\tb\tName\tc", "SymbolComment\t\t\tSymbolComment\t", "SampleTime[ms]\t1\t1\tSampleTime[ms]\t5"),
        *(
            "IndexGroup\t1\t1\tIndexGroup\t1",
            "SymbolName\tM.a\tM.b\tSymbolName\tM.c",
            "Unit\trpm\tV (Volt)\tUnit\t(None)",
        ),
        "",
    ]
    rows = [f"{i}\t{i / 7:.6f}\t{i}\t{5 * i}\t{i % 3}".replace(".", ",") for i in range(40)] + ["40\t1,5\t2", "EOF"]
    path.write_text("\r\n".join([*head, *rows, ""]))


def plain(path: Path) -> None:
    rows = [f'{i / 10},{i},"{i}, x",2024-05-01T10:00:{i:02d}Z' for i in range(50)]
    path.write_text("\n".join(["t,v [rpm],text,when", *rows, ""]))


def packed(path: Path) -> None:
    plain(path)
    path.write_bytes(gzip.compress(path.read_bytes(), mtime=0))


def parquet(path: Path) -> None:
    columns = {"t": np.arange(50.0), "v": np.arange(50), "s": [f"x{i}" for i in range(50)]}
    pq.write_table(pa.table(columns), path, row_group_size=20)


def svdx(path: Path) -> None:
    xml = b"\xef\xbb\xbf<P><AdsAcquisition><SymbolName>M.a</SymbolName><DataType>INT16</DataType><FileHandle>1</FileHandle>"
    xml += b"</AdsAcquisition></P>"
    head = b"01.00.00.40" + struct.pack("<QQQQQQQ", START, 5, START, START, 1, 16, 10_000) + bytes(16) + bytes(4)
    block = head + struct.pack("<Q", len(head) + 8)
    for s in range(5):
        block += struct.pack("<QI", START + s * 100, 3) + b"".join(struct.pack("<Ih", k, k) for k in range(3))
    path.write_bytes(
        struct.pack("<QQI", 40 + len(block), len(xml), 1) + struct.pack("<QQI", 40, len(block), 1) + block + xml
    )


def tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS is an extra")
    wave = {"wf_start_time": np.datetime64("2022-06-15T10:00:00", "us"), "wf_increment": 0.001, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("G", "a", np.arange(50.0), wave)])


def mutated(raw: bytes, source: random.Random) -> bytes:
    data = bytearray(raw)
    at = source.randrange(len(data))
    match source.randrange(7):
        case 0:
            return bytes(data[:at])
        case 1:
            for _ in range(source.randint(1, 8)):
                data[source.randrange(len(data))] ^= 1 << source.randrange(8)
        case 2:
            data[at : at + source.randint(1, 64)] = bytes(source.randint(1, 64))
        case 3:
            data[at:at] = source.randbytes(source.randint(1, 32))
        case 4:
            data[at:at] = source.choice([b"\0", b"9", b'"', b",", b"\t", b"\n", b"\r", b"[", b"-"]) * source.randint(
                1, 5000
            )
        case 5:
            del data[at : at + source.randint(1, 200)]
        case _:
            part = bytes(data[at : at + 100])
            data[at:at] = part * source.randint(1, 20)
    return bytes(data)


def outcome(path: Path) -> RawLog | str:
    """What reading ends in; anything but a log or a LogError is a failure of the test."""
    try:
        reader = open_log(path)
        reader.summarise(path, SourceOptions())
        return reader.read(path, SourceOptions())
    except LogError as error:
        return str(error)


@pytest.mark.parametrize("write", [scope, plain, packed, parquet, svdx, tdms], ids=lambda w: w.__name__)
def test_mutations(write: Callable[[Path], None], tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    write(path)
    assert isinstance(outcome(path), RawLog)
    raw, source = path.read_bytes(), random.Random(11)
    for _ in range(COUNT):
        path.write_bytes(mutated(raw, source))
        found = outcome(path)
        if isinstance(found, RawLog):
            assert found.channels
            for channel in found.channels.values():
                assert len(channel.stamps) == len(channel.values)
        else:
            assert "log.csv" in found


HEAD = "t,v\n0,1\n1,2\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (lambda: ",".join(f"c{i}" for i in range(1_000_000)) + "\n" + "1," * 999_999 + "1\n", "is not a log|line is longer|columns"),
        (lambda: "t,v" + ",x" * 30_000 + "\n" + ("0" + ",1" * 30_001 + "\n") * 3, "30002 columns; at most 20000"),
        (lambda: "t,v" + ",x" * 5_000 + "\n" + ("0" + ",1" * 5_001 + "\n") * 40 + "1\n" * 300_000,
         "rows are almost empty"),
        (lambda: HEAD + '2,"' * 50_000, ""),
        (lambda: '"' * 200_000 + ",v\n" + "0,1\n" * 50, ""),
        (lambda: HEAD + "2," + "9x" * 10_000_000 + "\n3,4\n", ""),
        (lambda: HEAD + "\0" * 20_000_000, ""),
        (lambda: HEAD + "," * 20_000_000, ""),
        (lambda: HEAD + "1\n" * 1_000_000, ""),
        (lambda: HEAD + '"' + "x\n" * 1_000_000, ""),
    ],
    ids=["million", "wide", "short", "quotes", "header", "digits", "zeros", "commas", "rows", "open"],
)  # fmt: skip
def test_hostile_text_takes_bounded_memory(tmp_path: Path, text: Callable[[], str], reason: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text())
    tracemalloc.start()
    found = outcome(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 200 << 20
    if reason:
        assert isinstance(found, str)
        assert any(part in found for part in reason.split("|")), found
    elif isinstance(found, RawLog):
        assert found.channels["v"].values[:2].tolist() == [1, 2]
        assert found.summary.damage


@pytest.mark.parametrize("filler", [b"1\t1\n", bytes(4), b"1,1\n"], ids=["tabs", "zeros", "commas"])
def test_a_packed_table_that_expands_beyond_measure_takes_bounded_memory(tmp_path: Path, filler: bytes) -> None:
    path = tmp_path / "log.csv.zst"
    path.write_bytes(zstandard.compress(b"a\tb\n5\t1\n5\t2\n" + filler * (32 << 18)))
    assert path.stat().st_size < 4096
    tracemalloc.start()
    found = outcome(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 140 << 20
    if isinstance(found, RawLog):  # zeros behind three rows
        assert any("bytes are zero" in d for d in found.summary.damage)
    else:
        assert "no time column" in found or "almost empty" in found
