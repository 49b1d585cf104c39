"""MCAP files made to mislead: no place, length or definition in them is followed out of the file or without end."""

from __future__ import annotations

import gc
import struct
import time
import weakref
import zlib
from pathlib import Path

import numpy as np
import pytest

from replay.border import UnforeseenContent
from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.common.inflate import Inflater
from replay.readers.mcap import file
from replay.readers.registry import read_log, summarise_log

OPTIONS = SourceOptions()
MAGIC = b"\x89MCAP0\r\n"
T0 = 1_760_000_000_000_000_000
COUNT = 40
FAR = [2**31, 2**62, 2**63 - 1, 2**63, 2**64 - 9, 2**64 - 1]


def record(op: int, body: bytes) -> bytes:
    return bytes([op]) + struct.pack("<Q", len(body)) + body


def text(value: str) -> bytes:
    return struct.pack("<I", len(value.encode())) + value.encode()


def build(
    schema: str = "float64 data",
    payloads: list[bytes] | None = None,
    place: int | None = None,
    length: int | None = None,
    indexes: int = 0,
    pairs: bytes = b"",
    extra: bytes = b"",
    tail: bytes = b"",
) -> bytes:
    """A file of one chunk, with what its summary says of it as given."""
    raw = record(3, struct.pack("<H", 1) + text("a/msg/B") + text("ros2msg") + text(schema))
    raw += record(4, struct.pack("<HH", 1, 1) + text("/f") + text("cdr") + struct.pack("<I", 0))
    messages = payloads or [b"\0\1\0\0" + struct.pack("<d", i) for i in range(COUNT)]
    for i, payload in enumerate(messages):
        raw += record(5, struct.pack("<HIQQ", 1, i, T0 + i * 10**7, T0) + payload)
    last = T0 + (len(messages) - 1) * 10**7
    chunk = record(
        6, struct.pack("<QQQI", T0, last, len(raw), zlib.crc32(raw)) + text("") + struct.pack("<Q", len(raw)) + raw
    )
    head = MAGIC + record(1, text("") + text(""))
    data = head + chunk + tail + record(15, bytes(4))
    summary = record(
        11, struct.pack("<QHIIIIQQIHQ", len(messages), 1, 1, 0, 0, 1, T0, last, 10, 1, len(messages))
    ) + record(
        8,
        struct.pack("<QQ", T0, last)
        + struct.pack("<QQ", len(head) if place is None else place, len(chunk) if length is None else length)
        + struct.pack("<I", len(pairs))
        + pairs
        + struct.pack("<Q", indexes)
        + text("")
        + struct.pack("<QQ", len(raw), len(raw)),
    )
    summary += extra
    footer = record(2, struct.pack("<QQI", len(data), 0, 0))[:-4]
    return data + summary + footer + struct.pack("<I", zlib.crc32(summary + footer)) + MAGIC


def told(path: Path, raw: bytes) -> list[str]:
    """Write the file and read it in both ways; the messages are all there, and what was said."""
    path.write_bytes(raw)
    log, summary = read_log(path, OPTIONS), summarise_log(path, OPTIONS)
    assert "/f.data" in log.channels, (log.summary.notes, log.summary.damage)
    np.testing.assert_array_equal(log.channels["/f.data"].values, np.arange(COUNT))
    assert [t.count for t in summary.topics] == [COUNT]
    return [*log.summary.damage, *summary.damage]


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("field", ["place", "length", "indexes"])
def test_places_in_the_summary_are_bounded_before_they_are_followed(tmp_path: Path, field: str, far: int) -> None:
    said = told(tmp_path / "log.mcap", build(**{field: far}))  # type: ignore[arg-type]
    assert said if field != "indexes" else True


@pytest.mark.parametrize("far", FAR)
def test_places_of_message_indexes_are_bounded(tmp_path: Path, far: int) -> None:
    told(tmp_path / "log.mcap", build(pairs=struct.pack("<HQ", 1, far)))


@pytest.mark.parametrize("far", FAR)
def test_places_of_the_footer_metadata_and_attachments_are_bounded(tmp_path: Path, far: int) -> None:
    indexes = record(13, struct.pack("<QQ", far, far) + text("m"))
    indexes += record(10, struct.pack("<QQQQQ", far, far, far, far, far) + text("a") + text("b"))
    indexes += record(9, struct.pack("<QQ", 0, 0) + text("a") + text("b") + struct.pack("<Q", far) + b"abc" + bytes(4))
    told(tmp_path / "log.mcap", build(extra=indexes))
    raw = build()
    at = raw.rindex(record(2, b"")[:1] + struct.pack("<Q", 20)) + 9
    assert told(tmp_path / "log.mcap", raw[:at] + struct.pack("<Q", far) + raw[at + 8 :])


def test_a_chunk_without_content_at_the_end_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    raw = build()
    raw = raw[: raw.index(record(15, bytes(4)))]
    whole = raw + record(128, bytes(-len(raw) % 4096 + 4096 - 18)) + record(6, b"")
    assert len(whole) % 4096 == 0  # a byte behind the end is in no page of the file
    assert told(path, whole)


@pytest.mark.parametrize("indexed", [False, True])
def test_records_of_data_behind_the_end_of_the_data_are_told(tmp_path: Path, indexed: bool) -> None:
    raw = build()
    start = len(MAGIC) + len(record(1, text("") + text("")))
    chunk = raw[start : raw.index(record(15, bytes(4)))]
    message = record(5, struct.pack("<HIQQ", 1, 0, T0, T0) + b"\0\1\0\0" + bytes(8))
    whole = build(extra=chunk + 2 * message)
    if not indexed:  # a summary that lists no chunk is walked in any case
        whole = build(extra=chunk + 2 * message, length=1)
    said = told(tmp_path / "log.mcap", whole)
    assert any("1 chunk from byte" in words and "behind the end of its data" in words for words in said), said
    assert any("2 messages from byte" in words for words in said), said


def test_arrays_that_no_message_fills_cost_nothing(tmp_path: Path) -> None:
    payloads, line = [], "=" * 80
    for i in range(COUNT):
        word = b"x" * (i * 7 % 23) + b"\0"
        body = struct.pack("<dI", i, len(word)) + word
        payloads.append(b"\0\1\0\0" + body + bytes(-len(body) % 4) + bytes(4))
    start = time.process_time()
    twins = "".join(f"{line}\nMSG: a/E{k}\na/E{k + 1} p\na/E{k + 1} q\n" for k in range(24))
    for inner in (
        "string[25000000] t",
        "float64[200000000] t",
        f"a/F[250000000] t\n{line}\nMSG: a/F\nstring t",
        f"a/E0 p\n{twins}{line}\nMSG: a/E24\nfloat64 z",
    ):
        said = told(
            tmp_path / "log.mcap", build(f"float64 data\nstring s\na/E[] e\n{line}\nMSG: a/E\n{inner}\n", payloads)
        )
        assert not said
    assert time.process_time() - start < 20.0


@pytest.mark.parametrize("size", [2**31, 2**63, 10**30])
def test_arrays_of_impossible_length_are_said(tmp_path: Path, size: int) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(build(f"float64 data\nfloat64[{size}] t"))
    (topic,) = summarise_log(path, OPTIONS).topics
    assert f"gives t {str(size)[:20]} elements" in topic.note


def test_reading_leaves_no_memory_to_the_collector(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[weakref.ref[Inflater]] = []

    class Watched(Inflater):
        def __init__(self, file_bytes: int | None = None) -> None:
            super().__init__(file_bytes)
            made.append(weakref.ref(self))

    monkeypatch.setattr(file, "Inflater", Watched)
    path = tmp_path / "log.mcap"
    path.write_bytes(build())
    gc.disable()  # chunks' room of up to 512 MB must not wait for it
    try:
        summarise_log(path, OPTIONS)
        read_log(path, OPTIONS)
    finally:
        gc.enable()
    assert len(made) == 2
    assert not any(one() is not None for one in made)


def test_any_number_in_the_summary_may_be_wrong(tmp_path: Path) -> None:
    path, raw = tmp_path / "log.mcap", build(pairs=struct.pack("<HQ", 1, 70))
    start = raw.index(record(15, bytes(4))) + 13
    rng = np.random.default_rng(5)
    for at in range(start, len(raw) - 16, 2):
        far = FAR[rng.integers(len(FAR))]
        changed = raw[:at] + struct.pack("<Q", far) + raw[at + 8 :]
        body = changed[start:-12]
        path.write_bytes(changed[:-12] + struct.pack("<I", zlib.crc32(body)) + MAGIC)  # its checksum is right again
        try:
            summarise_log(path, OPTIONS)
        except UnforeseenContent:
            raise
        except LogError:
            continue
