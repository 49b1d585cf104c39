"""Damaged MCAP files: every intact message comes back, every loss is said, nothing wrong comes in silence."""

from __future__ import annotations

import struct
import tracemalloc
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, IndexType, Writer

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.common import inflate
from replay.readers.mcap import chunk, reader
from replay.readers.registry import read_log, summarise_log

OPTIONS = SourceOptions()
T0 = 1_760_000_000_000_000_000
STEP = 10_000_000
COUNT = 300
FAST = "/fast"
SLOW = "/slow"
Row = tuple[str, int, int, bytes]
NONE, LZ4, ZSTD = CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD


def write(path: Path, chunk: int = 2000, noise: int = 0, **options: Any) -> bytes:
    """Float64 messages that count up: /fast every step, /slow every fifth."""
    rng = np.random.default_rng(1)
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk, **options)
        writer.start("ros2", "test")
        text = b"float64 data" if not noise else f"float64 data\nuint8[{noise}] noise".encode()
        channels = [
            writer.register_channel(topic, "cdr", writer.register_schema(f"p/msg/T{i}", "ros2msg", text))
            for i, topic in enumerate((FAST, SLOW))
        ]
        for i in range(COUNT):
            for channel in channels[: 1 if i % 5 else 2]:
                data = b"\0\1\0\0" + struct.pack("<d", i) + rng.bytes(noise)
                writer.add_message(channel, T0 + i * STEP, data, T0 + i * STEP - 7)
        writer.add_attachment(1, 2, "a.txt", "text/plain", b"attached")
        writer.add_metadata("machine", {"id": "H-7"})
        writer.finish()
    return path.read_bytes()


def messages(path: Path) -> tuple[Counter[Row], tuple[str, ...], str]:
    """Messages, damage and integrity of a full read, before decoding."""
    report, rows = Report(), []
    (file,) = reader.open_files([path], path, report, walk=True)
    for blocks in reader.blocks_of(file, None, None):
        for b in blocks:
            assert b.publish_ns is not None
            for at, size, log, publish in zip(b.starts, b.lengths, b.log_ns, b.publish_ns, strict=True):
                rows.append((b.connection.topic, int(log), int(publish), b.data[at : at + size].tobytes()))
    summary = reader.summary_of([file], path, "mcap", report)
    return Counter(rows), summary.damage, summary.metadata["integrity"]


def reseal(raw: bytes) -> bytes:
    """Give a changed summary its right checksum again."""
    (start,) = struct.unpack_from("<Q", raw, len(raw) - 28)
    return raw[:-12] + struct.pack("<I", zlib.crc32(raw[start:-12])) + raw[-8:]


def places(raw: bytes, op: int) -> list[tuple[int, int]]:
    """Start and end of the records of one type."""
    found, at = [], 8
    while at + 9 <= len(raw) - 8:
        end = at + 9 + int.from_bytes(raw[at + 1 : at + 9], "little")
        found += [(at, end)] if raw[at] == op else []
        at = end
    return found


def fast(path: Path) -> Any:
    return read_log(path, OPTIONS).channels[f"{FAST}.data"].values


@pytest.mark.parametrize("op", [0, 7, 0x46, 0x86])
@pytest.mark.parametrize("compression", [NONE, ZSTD])
def test_a_flipped_opcode_of_a_chunk_costs_nothing_and_is_said(
    tmp_path: Path, op: int, compression: CompressionType
) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path, compression=compression))
    start, _ = places(raw, 6)[2]
    raw[start] = op
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.arange(COUNT))
    assert any(f"chunk at byte {start} was damaged; it was recovered from the content" in d for d in log.summary.damage)
    assert summarise_log(path, OPTIONS).topics[0].count == COUNT


def test_a_chunk_whose_head_is_overwritten_is_found_by_the_index(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path))
    start, _ = places(raw, 6)[2]
    raw[start : start + 9] = b"\xa5" * 9
    raw[start + 37] = 99  # length of the compression's name
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.arange(COUNT))
    assert any(f"chunk at byte {start} is damaged; it was found by the index" in d for d in log.summary.damage)


def test_a_lost_chunk_is_counted_by_the_index_that_follows_it(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path, use_statistics=False, use_summary_offsets=False))
    start, end = places(raw, 6)[2]
    raw[start:end] = np.random.default_rng(4).bytes(end - start)
    path.write_bytes(raw[:-37])
    for summary in (read_log(path, OPTIONS).summary, summarise_log(path, OPTIONS)):
        left = summary.topics[0].count
        assert 200 < left < COUNT
        assert any(
            f"{FAST}: {left} of {COUNT} messages that the log's message indexes count" in d for d in summary.damage
        )


def test_a_chunk_missing_from_the_index_is_read_and_said(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = write(path, use_summary_offsets=False)
    start, end = places(raw, 8)[1]
    (chunk,) = struct.unpack_from("<Q", raw, start + 25)
    path.write_bytes(reseal(raw[:start] + raw[end:]))
    for summary in (read_log(path, OPTIONS).summary, summarise_log(path, OPTIONS)):
        assert [t.count for t in summary.topics] == [COUNT, COUNT // 5]
        assert any(f"does not list the chunk at byte {chunk}" in d for d in summary.damage)
    inside = read_log(path, OPTIONS, [FAST], "log", (T0, T0 + COUNT * STEP))
    np.testing.assert_array_equal(inside.channels[f"{FAST}.data"].values, np.arange(COUNT))


def test_a_chunk_listed_twice_is_read_once(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = write(path, use_summary_offsets=False)
    start, end = places(raw, 8)[1]
    path.write_bytes(reseal(raw[:end] + raw[start:end] + raw[end:]))
    for window in (None, (T0, T0 + COUNT * STEP)):
        log = read_log(path, OPTIONS, window=window)
        np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.arange(COUNT))
        assert any("overlap" in d for d in log.summary.damage)


def test_an_index_that_points_elsewhere_is_said(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path))
    start, _ = places(raw, 8)[1]
    struct.pack_into("<Q", raw, start + 25, 1234)
    path.write_bytes(reseal(bytes(raw)))
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.arange(COUNT))
    assert any("index lists a chunk at byte 1234" in d for d in log.summary.damage)


def test_missing_messages_are_counted_per_channel(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path))
    start, end = places(raw, 6)[1]
    raw[end - 20] ^= 0x11
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    left = len(log.channels[f"{FAST}.data"].values)
    assert 200 < left < COUNT
    assert any(f"chunk at byte {start} was left out" in d and "it held" in d for d in log.summary.damage)
    assert f"log.mcap: {FAST}: {left} of {COUNT} messages that the log's statistics count were found" in (
        log.summary.damage
    )
    assert log.summary.topics[0].count == left


def test_other_statistics_are_said(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path))
    start, _ = places(raw, 11)[0]
    struct.pack_into("<Q", raw, start + 9 + 46 + 2, COUNT + 5)
    struct.pack_into("<I", raw, start + 9 + 14, 9)
    path.write_bytes(reseal(bytes(raw)))
    damage = read_log(path, OPTIONS).summary.damage
    assert any(f"{FAST}: {COUNT} of {COUNT + 5} messages" in d for d in damage)
    assert any("1 of 9 attachments" in d for d in damage)


@pytest.mark.parametrize("compression", [NONE, LZ4, ZSTD])
def test_the_beginning_of_a_chunk_that_is_cut_off_is_taken(tmp_path: Path, compression: CompressionType) -> None:
    path = tmp_path / "log.mcap"
    raw = write(path, chunk=1 << 22, noise=3000, compression=compression)
    (start, end), *_ = places(raw, 6)
    path.write_bytes(raw[: start + (end - start) * 3 // 4])
    values = fast(path)
    assert len(values) > COUNT // 2
    np.testing.assert_array_equal(values, np.arange(len(values)))
    summary = read_log(path, OPTIONS).summary
    assert summary.metadata["integrity"] == "unverifiable"
    assert compression == NONE or any("is cut off by the end of the file" in d for d in summary.damage)
    assert summarise_log(path, OPTIONS).topics[0].count == len(values)


def test_a_chunk_that_ends_in_zeros_gives_its_beginning(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = write(path, chunk=1 << 22, noise=3000, compression=ZSTD)
    (start, end), *_ = places(raw, 6)
    cut = start + (end - start) * 3 // 4
    path.write_bytes(raw[:cut] + bytes(end - cut) + raw[end:])
    values = fast(path)
    assert len(values) > COUNT // 2
    np.testing.assert_array_equal(values, np.arange(len(values)))
    assert any("zeros" in d and "unverified" in d for d in read_log(path, OPTIONS).summary.damage)


@pytest.mark.parametrize("options", [{"use_chunking": False}, {"compression": NONE}, {"compression": ZSTD}])
def test_garbage_between_records_costs_no_message(tmp_path: Path, options: dict[str, Any]) -> None:
    path = tmp_path / "log.mcap"
    raw = write(path, **options)
    _, end = places(raw, 5 if "use_chunking" in options else 7)[9]
    path.write_bytes(raw[:end] + np.random.default_rng(3).bytes(5000) + raw[end:])
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.arange(COUNT))
    assert any(f"bytes {end} to {end + 5000} hold no complete record" in d for d in log.summary.damage)


def test_a_wrong_length_of_a_message_costs_that_message(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path, use_chunking=False))
    start, _ = places(raw, 5)[100]
    for change in (4, 1 << 12, 1 << 40):
        changed = bytearray(raw)
        struct.pack_into("<Q", changed, start + 1, struct.unpack_from("<Q", raw, start + 1)[0] + change)
        path.write_bytes(changed)
        found, damage, integrity = messages(path)
        assert sum(found.values()) == COUNT + COUNT // 5 - 1
        assert integrity == "unverifiable"
        assert any("of 300 messages" in d or "of 60 messages" in d for d in damage)


def test_trailing_bytes_and_a_missing_footer_are_said(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = write(path)
    for content, sentence in ((raw + b"tail", "4 bytes follow its end"), (raw[:-37], "without a footer"),
                              (raw[:-3], "closing bytes"), (b"X" + raw[1:], "not as an MCAP file does")):  # fmt: skip
        path.write_bytes(content)
        log = read_log(path, OPTIONS)
        np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.arange(COUNT))
        assert any(sentence in d for d in log.summary.damage)


def test_nothing_but_a_beginning_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = write(path)
    for size in (8, 8 + 9 + 16):
        path.write_bytes(raw[:size])
        for run in (read_log, summarise_log):
            with pytest.raises(LogError, match="without a channel or message"):
                run(path, OPTIONS)


def test_a_damaged_schema_is_taken_from_its_copy(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path, use_chunking=False))
    (start, _), *_ = places(raw, 3)
    raw[start + 11] ^= 0x40  # length of its name
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.arange(COUNT))
    assert any(f"schema record at byte {start} is damaged" in d for d in log.summary.damage)


def test_a_channel_without_schema_is_said_and_costs_no_other(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path, use_chunking=False, repeat_schemas=False, repeat_channels=False))
    (start, _), *_ = places(raw, 3)
    raw[start + 11] ^= 0x40
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    assert len(log.channels[f"{SLOW}.data"].values) == COUNT // 5
    assert any(f"{FAST}: its schema is missing or damaged" in d for d in log.summary.damage)


def test_a_changed_message_is_noticed_by_the_checksum_of_the_data(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path, use_chunking=False, enable_data_crcs=True))
    path.write_bytes(raw)
    assert messages(path)[1:] == ((), "checksums")
    raw[places(raw, 5)[50][1] - 1] ^= 1
    path.write_bytes(raw)
    _, damage, integrity = messages(path)
    assert any("checksum of its data section" in d for d in damage)
    assert integrity == "unverifiable"


def test_a_changed_attachment_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path))
    raw[raw.index(b"attached")] ^= 1
    path.write_bytes(raw)
    summary = read_log(path, OPTIONS).summary
    assert [a.checksum for a in summary.attachments] == ["wrong"]
    assert any("checksum of the attachment 'a.txt'" in d for d in summary.damage)


def test_a_checksum_with_one_wrong_bit_costs_nothing(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path))
    start, _ = places(raw, 6)[1]
    raw[start + 9 + 24] ^= 4
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.arange(COUNT))
    assert any("one bit of the checksum" in d for d in log.summary.damage)


def bomb(size: int, packed: bytes) -> bytes:
    body = (
        struct.pack("<QQQI", 0, 0, size, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    )
    return b"\x89MCAP0\r\n" + b"\x06" + struct.pack("<Q", len(body)) + body


def test_sizes_beyond_reason_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.mcap"
    endless = b"\x28\xb5\x2f\xfd\x00\x58" + b"\x02\x00\x10\x00" * 5000  # run-length blocks of 128 KiB each
    for size in (1 << 40, 1 << 62, 1000):
        path.write_bytes(bomb(size, endless))
        assert read_log(path, OPTIONS).summary.damage
    records = b"\x05" + struct.pack("<Q", 1 << 63), b"\x03" + struct.pack("<Q", 40) + b"\xff" * 40
    for record in records:
        path.write_bytes(b"\x89MCAP0\r\n" + record * 3)
        with pytest.raises(LogError, match="without a channel or message"):
            read_log(path, OPTIONS)


@pytest.mark.parametrize("record", [b"\x80" + bytes(8), b"\x05" + bytes([30, *bytes(7)]) + bytes(30), bytes(9)])
def test_a_flood_of_small_records_stays_small(tmp_path: Path, record: bytes) -> None:
    path = tmp_path / "flood.mcap"
    size = 16_000_000 // len(record) * len(record)
    path.write_bytes(bomb(size, zstandard.compress(record * (size // len(record)))))
    read_log(path, OPTIONS)  # loads compiled code
    tracemalloc.start()
    assert read_log(path, OPTIONS).summary.damage
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3 * size


def test_chunks_that_expand_without_end_are_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.mcap"
    write(path)
    monkeypatch.setattr(inflate, "_FREE_BYTES", 10_000)
    monkeypatch.setattr(inflate, "_MOST_TIMES", 0)
    log = read_log(path, OPTIONS)
    assert 0 < len(log.channels[f"{FAST}.data"].values) < COUNT
    assert any("expand to more than" in d for d in log.summary.damage)


def mutations(raw: bytes, seed: int) -> Iterator[bytes]:
    """Cuts over the whole length, single bits, and stretches of noise."""
    rng = np.random.default_rng(seed)
    for place in np.linspace(0, len(raw) - 1, 25).astype(int).tolist():
        yield raw[:place]
    for _ in range(75):
        changed = bytearray(raw)
        changed[int(rng.integers(0, len(raw)))] ^= 1 << int(rng.integers(0, 8))
        yield bytes(changed)
    for _ in range(15):
        place, size = int(rng.integers(0, len(raw))), int(rng.integers(1, 400))
        yield raw[:place] + rng.bytes(size) + raw[place + size :]


@pytest.mark.parametrize(
    ("options", "checked"),
    [
        ({"compression": ZSTD}, True),
        ({"compression": LZ4}, True),
        ({"compression": NONE}, True),
        ({"compression": ZSTD, "index_types": IndexType.NONE, "use_statistics": False}, True),
        ({"compression": NONE, "enable_crcs": False}, False),
        ({"use_chunking": False, "enable_data_crcs": True}, True),
        ({"use_chunking": False, "enable_crcs": False, "use_statistics": False}, False),
    ],
)
def test_nothing_is_lost_or_changed_in_silence(tmp_path: Path, options: dict[str, Any], checked: bool) -> None:
    path = tmp_path / "log.mcap"
    raw = write(path, **options)
    truth, damage, integrity = messages(path)
    assert (sum(truth.values()), damage, integrity == "checksums") == (COUNT + COUNT // 5, (), checked)
    for content in mutations(raw, 11):
        path.write_bytes(content)
        try:
            found, damage, integrity = messages(path)
        except LogError:
            continue
        assert found == truth or damage or (integrity == "unverifiable" and sum(found.values()) == sum(truth.values()))
        if options.get("use_chunking", True) and checked:
            assert found <= truth


WINDOWS: list[Callable[[int], tuple[int, int]]] = [
    lambda n: (T0, T0 + n * STEP), lambda n: (T0 + 77 * STEP + 1, T0 + 201 * STEP), lambda n: (T0 + 50 * STEP, T0 + 50 * STEP + 1),
]  # fmt: skip


@pytest.mark.parametrize("options", [{}, {"use_chunking": False}, {"index_types": IndexType.NONE},
                                     {"repeat_channels": False, "repeat_schemas": False}])  # fmt: skip
def test_a_window_keeps_the_stamps_inside_it(tmp_path: Path, options: dict[str, Any]) -> None:
    path = tmp_path / "log.mcap"
    write(path, **options)
    stamps = T0 + np.arange(COUNT) * STEP
    for window in (w(COUNT) for w in WINDOWS):
        log = read_log(path, OPTIONS, clock="log", window=window)
        inside = (stamps >= window[0]) & (stamps < window[1])
        np.testing.assert_array_equal(log.channels[f"{FAST}.data"].stamps, stamps[inside])
        np.testing.assert_array_equal(log.channels[f"{FAST}.data"].values, np.flatnonzero(inside))
        assert log.summary.damage == ()
        assert [t.count for t in log.summary.topics] == [COUNT, COUNT // 5]


def test_a_window_opens_only_the_chunks_inside_it(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = bytearray(write(path))
    start, end = places(raw, 6)[0]
    raw[start + 60 : end] = bytes(end - start - 60)  # the first chunk is gone, and nobody asks for it
    path.write_bytes(raw)
    log = read_log(path, OPTIONS, [FAST], "log", (T0 + 200 * STEP, T0 + 210 * STEP))
    assert log.channels[f"{FAST}.data"].values.tolist() == list(range(200, 210))
    assert log.summary.damage == ()
    assert read_log(path, OPTIONS).summary.damage


@pytest.mark.parametrize("window", [None, (T0, T0 + COUNT * STEP)])
def test_chunks_without_the_wanted_topic_are_not_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, window: tuple[int, int] | None
) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1000, repeat_channels=False, repeat_schemas=False)
        writer.start()
        schema = writer.register_schema("p/msg/T", "ros2msg", b"float64 data")
        first, second = (writer.register_channel(t, "cdr", schema) for t in (FAST, SLOW))
        for i in range(COUNT):
            data = b"\0\1\0\0" + struct.pack("<d", i)
            writer.add_message(first if i < 250 else second, T0 + i * STEP, data, T0 + i * STEP)
        writer.finish()
    opened: list[int] = []

    def count(file: Any, row: int) -> Any:
        opened.append(row)
        return chunk.open_chunk(file, row)

    monkeypatch.setattr(reader, "open_chunk", count)
    log = read_log(path, OPTIONS, [SLOW], "log", window)
    np.testing.assert_array_equal(log.channels[f"{SLOW}.data"].values, np.arange(250, COUNT))
    assert len(opened) <= 4
    assert log.summary.damage == ()
    assert [t.count for t in log.summary.topics] == [250, 50]
