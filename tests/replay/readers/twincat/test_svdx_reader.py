from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from replay.errors import LogError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import open_log, read_log, summarise_log

START = 133_000_000_000_000_000  # FILETIME
START_NS = (START - 116_444_736_000_000_000) * 100
LEVELS = 3


def segment(ticks: list[int], values: list[float], code: str, start: int = START) -> bytes:
    rows = b"".join(struct.pack("<I" + code, t, v) for t, v in zip(ticks, values, strict=True))
    return struct.pack("<QI", start, len(ticks)) + rows


def block(segments: list[bytes], period: int = 10_000, start: int = START) -> bytes:
    """Head, a pyramid of LEVELS levels that is skipped, and the segments."""
    head = b"01.00.00.40" + struct.pack("<QQQQ", start, 5_000_000, start, start + 5_000_000)
    head += struct.pack("<QQQ", 2, 16, period) + bytes(16) + struct.pack("<I", LEVELS) + bytes(56 * LEVELS)
    pyramid = b"min max min max"
    samples = len(head) + 8 + 4 + len(pyramid)
    assert len(head) == 83 + 4 + 56 * LEVELS
    return head + struct.pack("<Q", samples) + b"more" + pyramid + b"".join(segments)


def acquisition(handle: int, symbol: str, kind: str, more: str = "") -> str:
    return (
        f"<AdsAcquisition><Name>shown {handle}</Name><SymbolName>{symbol}</SymbolName><DataType>{kind}</DataType>"
        f"<AmsNetId>5.24.36.48.1.1</AmsNetId><TargetPort>851</TargetPort><FileHandle>{handle}</FileHandle>"
        f"<BaseSampleTime>10000</BaseSampleTime><ScaleFactor>2</ScaleFactor><Offset>1</Offset>{more}</AdsAcquisition>"
    )


def recording(blocks: list[tuple[int, bytes]], channels: list[str], before: str = "") -> bytes:
    at = 20 + 20 * len(blocks)
    index, body = b"", b""
    for handle, data in blocks:
        index += struct.pack("<QQI", at + len(body), len(data), handle)
        body += data
    xml = b"\xef\xbb\xbf" + f"{before}<ScopeProject><DataPool>{''.join(channels)}</DataPool></ScopeProject>".encode()
    return struct.pack("<QQI", at + len(body), len(xml), len(blocks)) + index + body + xml


FAST = block([segment([0, 10_000], [1.5, -2.5], "d"), segment([5, 10_005], [3.5, 4.5], "d", START + 20_000)])
SLOW = block([segment([0, 50_000, 100_000], [7, -8, 9], "h")], period=50_000)
CHANNELS = [acquisition(1, "MAIN.fbWheel[1].fVelocity", "REAL64"), acquisition(2, "GVL.nPressure", "INT16")]
WHOLE = recording([(1, FAST), (2, SLOW)], CHANNELS)


@pytest.fixture
def target(tmp_path: Path) -> Path:
    return tmp_path / "scope.svdx"


def read(target: Path, raw: bytes, **options: object) -> RawLog:
    target.write_bytes(raw)
    return read_log(target, SourceOptions(**options))  # type: ignore[arg-type]


def test_channels_stamps_and_values(target: Path) -> None:
    log = read(target, WHOLE)
    assert open_log(target).format == "svdx"
    fast, slow = log.channels["MAIN.fbWheel[1].fVelocity"], log.channels["GVL.nPressure"]
    assert fast.values.tolist() == [1.5, -2.5, 3.5, 4.5]
    assert (fast.stamps - START_NS).tolist() == [0, 1_000_000, 2_000_500, 3_000_500]
    assert slow.values.tolist() == [7, -8, 9]
    assert slow.values.dtype == np.int16
    assert (slow.field, slow.type_name) == ("shown 2", "INT16")
    assert any("experimental" in n for n in log.summary.notes)
    assert log.summary.damage == ()


def test_the_summary_counts_the_same_without_decoding(target: Path) -> None:
    log = read(target, WHOLE)
    index = summarise_log(target, SourceOptions())
    assert (index.topics, index.start_ns, index.stop_ns) == (
        log.summary.topics,
        log.summary.start_ns,
        log.summary.stop_ns,
    )
    assert [(t.count, t.fields) for t in index.topics] == [(4, ("MAIN.fbWheel[1].fVelocity",)), (3, ("GVL.nPressure",))]
    assert any("experimental" in n for n in index.notes)


def test_a_window_and_scaling_on_demand(target: Path) -> None:
    target.write_bytes(WHOLE)
    log = read_log(target, SourceOptions(), window=(START_NS + 1_000_000, START_NS + 3_000_500))
    assert log.channels["MAIN.fbWheel[1].fVelocity"].values.tolist() == [-2.5, 3.5]
    assert read(target, WHOLE, scale=True).channels["GVL.nPressure"].values.tolist() == [15, -15, 19]


@pytest.mark.parametrize(
    ("kind", "code", "values"),
    [("BIT", "B", [0, 1]), ("UINT64", "Q", [2**64 - 1, 5]), ("INT32", "i", [-5, 7]), ("REAL32", "f", [0.5, -1.25])],
)
def test_number_types(target: Path, kind: str, code: str, values: list[float]) -> None:
    raw = recording([(9, block([segment([0, 1], values, code)]))], [acquisition(9, "a", kind)])
    assert read(target, raw).channels["a"].values.tolist() == values


def test_symbols_twice_types_without_numbers_and_blocks_without_a_name(target: Path) -> None:
    raw = recording(
        [(1, SLOW), (2, SLOW), (3, SLOW), (4, SLOW)],
        [acquisition(1, "a", "INT16"), acquisition(2, "a", "INT16"), acquisition(3, "s", "STRING(80)")],
    )
    log = read(target, raw)
    assert [*log.channels] == ["a", "a (1)"]
    assert any("names no acquisition of handle 4" in d for d in log.summary.damage)
    assert any("s is of type 'STRING(80)'" in d for d in log.summary.damage)


def at(raw: bytes, place: int, new: bytes) -> bytes:
    return raw[:place] + new + raw[place + len(new) :]


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]>'
OUTSIDE = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/hostname">]>'
FIRST = 60  # byte of the first block
ENDS = FIRST + len(FAST) + len(SLOW)


@pytest.mark.parametrize(
    ("raw", "reason"),
    [
        (at(WHOLE, 8, struct.pack("<Q", 7)), "bytes of XML at byte"),
        (at(WHOLE, 16, struct.pack("<I", 2**31)), "blocks do not fit"),
        (at(WHOLE, 20, struct.pack("<Q", 2**40)), "is not between the index and the XML"),
        (at(WHOLE, FIRST, b"02"), "only version 01.00.00.40 is known"),
        (at(WHOLE, FIRST + 51, struct.pack("<Q", 17)), "byte 51 of its head holds 17, 16 was expected"),
        (at(WHOLE, FIRST + 83, struct.pack("<I", 2**20)), "its pyramid of 1048576 levels does not fit"),
        (at(WHOLE, FIRST + 83 + 56 * LEVELS + 4, struct.pack("<Q", 10**6)), "its samples should begin at its byte 1000000"),
        (at(WHOLE, FIRST + len(FAST) - 28, struct.pack("<I", 3)), "handle 1 that begins here does not fit the block"),
        (at(WHOLE, FIRST + len(FAST) - 28, struct.pack("<I", 1)), "does not fit the block"),
        (at(WHOLE, FIRST + 11, bytes(8)), "0 is not a time"),
        (at(WHOLE, ENDS + 3, b"<<"), "its XML is damaged"),
        (at(WHOLE, ENDS, b"???"), "does not begin with a byte-order mark"),
        (recording([(1, FAST)], CHANNELS, BOMB), "declares a document type or entities"),
        (recording([(1, FAST)], CHANNELS, OUTSIDE), "declares a document type or entities"),
        (recording([(1, FAST)], [*CHANNELS, "<a>" * 300 + "</a>" * 300]), "nested deeper"),
        (recording([(5, FAST)], CHANNELS), "none of its 1 blocks holds a channel"),
    ],
)  # fmt: skip
def test_what_does_not_fit_to_the_byte_is_refused(target: Path, raw: bytes, reason: str) -> None:
    from replay.readers.twincat.svdx_reader import SvdxReader

    target.write_bytes(raw)
    with pytest.raises(LogError, match=reason):
        SvdxReader().read(target, SourceOptions())
