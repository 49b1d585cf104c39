"""ROS 1 bags whose lengths and index agree, and which mean nonsense: bombs, shared numbers of connections, stamps at the bounds."""

from __future__ import annotations

import bz2
import random
import struct

import lz4.frame

from tests.benchmarks.fuzzing import bombs
from tests.benchmarks.fuzzing.bag import MAGIC, PACK, Record
from tests.benchmarks.fuzzing.case import Case

T0 = 1_700_000_000
NAMES = (b"/a", b"/a", b"/b", b"", b"../../x", b"/a\n\x1b[31m", b"x" * 70_000, b"\xff\xfe", b"http://a/b")
STAMPS = ((T0, 0), (T0, 5), (T0, 999_999_999), (T0, 10**9), (0, 0), (2**32 - 1, 2**32 - 1), (2**31, 0))


def _connection(number: int, topic: bytes, kind: bytes, definition: bytes) -> Record:
    fields = {b"topic": topic, b"type": kind, b"md5sum": b"0" * 32, b"message_definition": definition}
    data = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k + b"=" + v for k, v in fields.items())
    return Record([(b"op", b"\x07"), (b"conn", struct.pack("<I", number)), (b"topic", topic)], data)


def made_up(source: random.Random) -> Case:
    """A closed bag of one to three connections in up to three chunks."""
    links = []
    for k in range(source.choice((1, 1, 3))):
        number = source.choice((k, k, 0, 2**31 - 1, 2**32 - 1))
        kind = source.choice((b"a/B", b"a/B", b"std_msgs/Float64", b"", b"a/b/c", b"*"))
        links.append(_connection(number, source.choice(NAMES), kind, bombs.text_definition(source)))
    parts, places, at = [], [], len(MAGIC) + 4096
    for _ in range(source.choice((1, 1, 3))):
        chunk, indexes = _chunk(links, source)
        places.append((at, chunk, indexes))
        parts += [chunk, *indexes]
        at += sum(len(r.bytes()) for r in (chunk, *indexes))
    if source.random() < 0.2 and places:
        places = source.choice((places + places, places[:1], places[::-1], []))
    infos = []
    for place, _, indexes in places:
        counts = b"".join(dict(r.head)[b"conn"] + dict(r.head)[b"count"] for r in indexes)
        stamp = struct.pack("<II", *source.choice(STAMPS))
        head = [(b"op", b"\x06"), (b"ver", b"\1\0\0\0"), (b"chunk_pos", struct.pack("<Q", place)), (b"start_time", stamp), (b"end_time", stamp), (b"count", struct.pack("<I", len(indexes)))]  # fmt: skip
        infos.append(Record(head, counts))
    known = links if source.random() < 0.8 else links[:1]
    numbers = [
        (b"index_pos", struct.pack("<Q", at)),
        (b"conn_count", struct.pack("<I", len(known))),
        (b"chunk_count", struct.pack("<I", len(infos))),
    ]
    first = Record([(b"op", b"\x03"), *numbers])
    first.data = b" " * (4096 - len(first.bytes()))
    content = MAGIC + b"".join(r.bytes() for r in (first, *parts, *known, *infos))
    return Case(content, f"made up of {len(links)} connections, {len(places)} chunks", {"made": True})


def _resembling(size: int, source: random.Random) -> bytes:
    """Bytes in which a record might start anywhere: zeros, headers of tiny fields from every byte on, records within records."""
    way = source.random()
    if way < 0.4:
        return bytes(size)
    head = [(b"op", b"\x02"), (b"conn", bytes(4)), (b"time", bytes(8))]
    if way < 0.7:
        wide = bytes(source.choices((0, 0, 1, 8, 255), k=source.choice((3, 4, 4, 8))))
        unit = struct.pack("<I", source.choice((3, 4, 4, 12))) + wide
        return (unit * (size // len(unit) + 1))[:size]
    one, count = len(Record(head).bytes()), source.choice((100, 5000, 50_000))
    nested = b"".join(Record(head).bytes()[:-4] + struct.pack("<I", one * (count - 1 - k)) for k in range(count))
    last = Record(head).bytes()[:-4] + struct.pack("<I", 2**31)
    return (nested + last + bytes(source.choices((0, 255), k=1)) * size)[:size]


def _chunk(links: list[Record], source: random.Random) -> tuple[Record, list[Record]]:
    inner = [r.copy() for r in links] if source.random() < 0.85 else []
    entries: dict[bytes, list[bytes]] = {}
    at = sum(len(r.bytes()) for r in inner)
    for _ in range(source.choice((0, 1, 5, 40))):
        number = dict(source.choice(links).head)[b"conn"]
        stamp = struct.pack("<II", *source.choice(STAMPS))
        message = Record([(b"op", b"\x02"), (b"conn", number), (b"time", stamp)], bombs.cdr_message(source)[4:])
        entries.setdefault(number, []).append(stamp + struct.pack("<I", at))
        inner.append(message)
        at += len(message.bytes())
    raw = b"".join(r.bytes() for r in inner)
    name = source.choice((b"none", b"lz4", b"bz2"))
    data, size = PACK.get(name, bytes)(raw), len(raw)
    way = source.random()
    if way < 0.06:
        size = source.choice((1 << 20, 60 << 20, 128 << 20, 300 << 20))
        name = source.choice((b"lz4", b"lz4", b"bz2"))
        data = PACK[name](_resembling(size, source))
    elif way < 0.12:
        half = len(raw) // 2
        name, data = source.choice((
            (b"lz4", lz4.frame.compress(raw[:half]) + lz4.frame.compress(raw[half:])), (b"bz2", bz2.compress(raw[:half]) + bz2.compress(raw[half:])),
            (b"LZ4", raw), (b"", raw), (b"zstd", raw), (b"lz4", lz4.frame.compress(raw, store_size=False, content_checksum=True)),
        ))  # fmt: skip
    chunk = Record([(b"op", b"\x05"), (b"compression", name), (b"size", struct.pack("<I", size % 2**32))], data)
    indexes = []
    for number, pairs in entries.items():
        pairs = pairs if source.random() < 0.9 else source.choice((pairs[::-1], pairs[:1], pairs * 2))
        head = [(b"op", b"\x04"), (b"ver", b"\1\0\0\0"), (b"conn", number), (b"count", struct.pack("<I", len(pairs)))]
        indexes.append(Record(head, b"".join(pairs)))
    return chunk, indexes
