"""MCAP files whose lengths, places and checksums all agree, and which mean nonsense: bombs, doubled indexes, stamps at the bounds."""

from __future__ import annotations

import random
import struct

import lz4.frame
import zstandard

from tests.benchmarks.fuzzing import bombs, mcap_file
from tests.benchmarks.fuzzing.case import Case
from tests.benchmarks.fuzzing.mcap_file import CHUNK, Record, seal_chunk

T0 = 1_760_000_000_000_000_000
STAMPS = (0, 1, T0, T0, T0 + 10**9, 2**63 - 1, 2**63, 2**64 - 1)
NAMES = ("/a", "/a", "", "/", "../../x", "/a\n", "\x1b[31m", "x" * 70_000, "/é", "\u202e/a", "http://a/b", "/a/b.c[0]")
_DEFINITIONS = {
    "ros2msg": bombs.text_definition, "ros1msg": bombs.text_definition, "ros2idl": bombs.idl_definition, "protobuf": bombs.protobuf_definition,
    "jsonschema": bombs.json_message, "": lambda source: b"", "flatbuffer": lambda source: source.randbytes(20),
}  # fmt: skip
_MESSAGES = {
    "cdr": bombs.cdr_message,
    "ros1": bombs.cdr_message,
    "protobuf": bombs.protobuf_message,
    "json": bombs.json_message,
}
_PAIRS = (
    ("ros2msg", "cdr"),
    ("ros2msg", "cdr"),
    ("ros1msg", "ros1"),
    ("ros2idl", "cdr"),
    ("protobuf", "protobuf"),
    ("jsonschema", "json"),
)


def _text(value: str | bytes) -> bytes:
    raw = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(raw)) + raw


def made_up(source: random.Random) -> Case:
    """A file of one to three channels in one to four chunks, or in none."""
    kinds = []
    head: list[Record] = []
    for number in range(1, source.choice((2, 2, 4))):
        language, encoding = source.choice(_PAIRS)
        if source.random() < 0.1:
            language, encoding = source.choice(list(_DEFINITIONS)), source.choice((*_MESSAGES, "", "cbor"))
        schema = source.choice((number, number, number, 0, 1, 65535))
        kinds.append((number, encoding))
        name = {"protobuf": "a.P", "ros2idl": "a/msg/I"}.get(
            language, source.choice(("a/msg/B", "a/B", "", "std_msgs/msg/Float64"))
        )
        head.append(
            Record(3, struct.pack("<H", number) + _text(name) + _text(language) + _text(_DEFINITIONS[language](source)))
        )
        head.append(
            Record(
                4,
                struct.pack("<HH", number, schema)
                + _text(source.choice(NAMES))
                + _text(encoding)
                + struct.pack("<I", 0),
            )
        )
    chunks = [_chunk(head, kinds, source) for _ in range(source.choice((1, 1, 2, 4)))]
    records: list[Record] = [Record(1, _text("ros2") + _text("x"))]
    loose = source.random() < 0.2
    for chunk in chunks:
        records += chunk.inner if loose else [chunk]
    if not loose and source.random() < 0.15:
        records.insert(source.randrange(1, len(records) + 1), chunks[0])  # the same bytes twice
    records.append(Record(15, source.choice((bytes(4), b"\1\1\1\1"))))
    records += _summary(head, [r for r in records if r.op == CHUNK], source)
    records.append(Record(2, struct.pack("<QQI", 1, 0, 1)))
    return Case(
        mcap_file.join(records, places=True, checksums=True), f"made up of {[k[1] for k in kinds]}", {"sealed": True}
    )


def _chunk(head: list[Record], kinds: list[tuple[int, str]], source: random.Random) -> Record:
    inner = [r.copy() for r in head] if source.random() < 0.8 else []
    for i in range(source.choice((0, 1, 5, 40))):
        number, encoding = source.choice(kinds)
        number = number if source.random() < 0.97 else source.choice((0, 7, 65535))
        message = _MESSAGES.get(encoding, bombs.cdr_message)(source)
        stamps = (
            (source.choice(STAMPS), source.choice(STAMPS))
            if source.random() < 0.3
            else (T0 + i * 10**7, T0 + i * 10**7)
        )
        inner.append(Record(5, struct.pack("<HIQQ", number, i, *stamps) + message))
    if source.random() < 0.1:
        inner.append(Record(CHUNK, bytes(40), [Record(5, bytes(22))]))
    way = source.choice(("", "zstd", "lz4", "zstd", "lz4"))
    chunk = Record(CHUNK, struct.pack("<QQ", *(source.choice(STAMPS) for _ in range(2))), inner, way)
    seal_chunk(chunk)
    if source.random() < 0.2:
        return _repacked(chunk, source)
    return chunk


def _repacked(chunk: Record, source: random.Random) -> Record:
    """The same records in frames that a writer may make and few do, or many zeros in their place."""
    raw = b"".join(r.bytes() for r in chunk.inner)
    size = source.choice((0, 1 << 20, 100 << 20, 128 << 20, 200 << 20, 600 << 20)) if source.random() < 0.3 else 0
    half = len(raw) // 2
    whole = zstandard.ZstdCompressor(write_content_size=False, write_checksum=True)
    name, packed = source.choice((
        ("zstd", lambda: whole.compress(raw[:half]) + whole.compress(raw[half:])),
        ("zstd", lambda: b"\x50\x2a\x4d\x18\x04\0\0\0abcd" + whole.compress(raw)),
        ("zstd", lambda: zstandard.ZstdCompressor(compression_params=zstandard.ZstdCompressionParameters(window_log=28)).compress(raw)),
        ("lz4", lambda: lz4.frame.compress(raw[:half]) + lz4.frame.compress(raw[half:])),
        ("lz4", lambda: lz4.frame.compress(raw, content_checksum=True, block_checksum=True, store_size=False)),
        ("bz2", lambda: raw), ("ZSTD", lambda: whole.compress(raw)), ("none", lambda: raw),
        ("", lambda: raw + b"\0" * 9), ("zstd", lambda: b""),
    ))  # fmt: skip
    data = packed()
    expanded = len(raw)
    if size:
        name, data, expanded = "zstd", zstandard.ZstdCompressor(level=1).compress(bytes(size)), size
    body = chunk.body[:16] + struct.pack("<QI", expanded, 0) + _text(name) + struct.pack("<Q", len(data)) + data
    return Record(0x86 - 0x80, body)  # a chunk without records of its own: its body is whole


def _summary(head: list[Record], chunks: list[Record], source: random.Random) -> list[Record]:
    """Statistics and indexes: right, doubled, of one chunk alone, or none."""
    out = [r.copy() for r in head] if source.random() < 0.7 else []
    count = sum(r.op == 5 for chunk in chunks for r in chunk.inner)
    wrong = source.random() < 0.2
    number = source.choice((0, 2**32, 2**63, 2**64 - 1)) if wrong else count
    out.append(
        Record(
            11,
            struct.pack("<QHIIIIQQ", number, len(head) // 2, len(head) // 2, 0, 0, len(chunks), T0, T0)
            + struct.pack("<I", 0),
        )
    )
    indexes = []
    for chunk in chunks:
        size = int.from_bytes(chunk.body[16:24], "little")
        body = (
            chunk.body[:16]
            + struct.pack("<QQ", 0, 0)
            + struct.pack("<I", 0)
            + struct.pack("<Q", 0)
            + _text(chunk.compression)
            + struct.pack("<QQ", size, size)
        )
        indexes.append(Record(8, body))
    way = source.random()
    if way < 0.15:
        indexes += [r.copy() for r in indexes]
    elif way < 0.3:
        indexes = indexes[:1]
    elif way < 0.4:
        indexes = []
    elif way < 0.5:
        indexes.reverse()
    return out + indexes
