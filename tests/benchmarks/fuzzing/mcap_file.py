"""An MCAP file taken apart into records, and put together again: with its places and checksums made right, or not."""

from __future__ import annotations

import random
import struct
import zlib
from dataclasses import dataclass, field

import lz4.frame
import zstandard

from tests.benchmarks.fuzzing.damage import Spot, blindly, reworded, with_number

MAGIC = b"\x89MCAP0\r\n"
_SIZES = {"B": 1, "H": 2, "I": 4, "Q": 8}
# Numbers by their size; s: text, b: bytes with a length of 4, L: with one of 8, m: map or list, *: the rest
LAYOUT = {
    1: "ss", 2: "QQI", 3: "Hssb", 4: "HHssm", 5: "HIQQ*", 6: "QQQIs", 7: "Hm", 8: "QQQQmQsQQ", 9: "QQssLI", 10: "QQQQQss",
    11: "QHIIIIQQm", 12: "sm", 13: "QQs", 14: "BQQ", 15: "I",
}  # fmt: skip
SCHEMA, CHUNK, DATA_END, INDEX, FOOTER = 3, 6, 15, 8, 2


@dataclass
class Record:
    """A record; a chunk has those within it, and its compression.

    Attributes
    ----------
    length : int or None
        The length that is written; None: the right one.
    """

    op: int
    body: bytes = b""
    inner: list[Record] = field(default_factory=list)
    compression: str = ""
    length: int | None = None

    def copy(self) -> Record:
        """One that may be changed apart from this one."""
        return Record(self.op, self.body, [r.copy() for r in self.inner], self.compression, self.length)

    def bytes(self) -> bytes:
        """As it stands in the file."""
        body = self.body + _packed(self.inner, self.compression) if self.op == CHUNK else self.body
        return bytes([self.op]) + struct.pack("<Q", len(body) if self.length is None else self.length) + body


def spots(op: int, body: bytes) -> list[Spot]:
    """Numbers and texts of a record's body, as far as it goes."""
    found, at = [], 0
    for letter in LAYOUT.get(op, "*"):
        if letter == "*":
            found.append(Spot(at, len(body) - at, "bytes"))
            break
        size = _SIZES.get(letter) or (8 if letter == "L" else 4)
        if at + size > len(body):
            break
        found.append(Spot(at, size, "int"))
        if letter not in _SIZES:
            length = int.from_bytes(body[at : at + size], "little")
            found.append(Spot(at + size, min(length, len(body) - at - size), "bytes"))
            at += length
        at += size
    return [spot for spot in found if spot.size > 0]


def split(raw: bytes) -> list[Record]:
    """Records of a sound file."""
    out, at = [], len(MAGIC)
    while at + 9 <= len(raw) - len(MAGIC):
        size = int.from_bytes(raw[at + 1 : at + 9], "little")
        body = raw[at + 9 : at + 9 + size]
        out.append(_chunk(body) if raw[at] == CHUNK else Record(raw[at], body))
        at += 9 + size
    return out


def _chunk(body: bytes) -> Record:
    name = int.from_bytes(body[28:32], "little")
    head, data = body[: 40 + name], body[40 + name :]
    compression = head[32 : 32 + name].decode()
    if compression == "zstd":
        data = zstandard.ZstdDecompressor().decompress(data)
    elif compression == "lz4":
        data = lz4.frame.decompress(data)
    inner, at = [], 0
    while at + 9 <= len(data):
        size = int.from_bytes(data[at + 1 : at + 9], "little")
        inner.append(Record(data[at], data[at + 9 : at + 9 + size]))
        at += 9 + size
    return Record(CHUNK, head, inner, compression)


def _packed(inner: list[Record], compression: str) -> bytes:
    data = b"".join(record.bytes() for record in inner)
    if compression == "zstd":
        return zstandard.ZstdCompressor().compress(data)
    return lz4.frame.compress(data) if compression == "lz4" else data


def seal_chunk(chunk: Record) -> None:
    """Make size and checksum of a chunk's content right."""
    data = b"".join(record.bytes() for record in chunk.inner)
    name = chunk.compression.encode()
    head = chunk.body[:16] + struct.pack("<QI", len(data), zlib.crc32(data)) + struct.pack("<I", len(name)) + name
    chunk.body = head + struct.pack("<Q", len(_packed(chunk.inner, chunk.compression)))


def join(records: list[Record], *, places: bool, checksums: bool) -> bytes:
    """Bytes of a file.

    Parameters
    ----------
    records : list[Record]
        In their order.
    places : bool
        Whether places and lengths of chunks in the index, and of the summary in the footer, are made right.
    checksums : bool
        Whether checksums of data and summary are, where the file has them.
    """
    out, chunks, summary = bytearray(MAGIC), list[tuple[int, int]](), 0
    for record in records:
        if record.op == CHUNK:
            chunks.append((len(out), len(record.bytes())))
        elif record.op == INDEX and places and chunks and len(record.body) >= 32:
            start, length = chunks.pop(0)
            record.body = record.body[:16] + struct.pack("<QQ", start, length) + record.body[32:]
        elif record.op == FOOTER and places and summary and len(record.body) == 20:
            record.body = struct.pack("<QQ", summary if summary < len(out) else 0, 0) + record.body[16:]
        if record.op == FOOTER and checksums and len(record.body) == 20 and any(record.body[16:]):
            start = int.from_bytes(record.body[:8], "little") or len(out)
            record.body = record.body[:16] + struct.pack("<I", zlib.crc32(bytes(out[start:]) + record.bytes()[:-4]))
        if record.op == DATA_END and checksums and len(record.body) == 4 and any(record.body):
            record.body = struct.pack("<I", zlib.crc32(bytes(out)))
        out += record.bytes()
        if record.op == DATA_END:
            summary = len(out)
    return bytes(out) + MAGIC


def damage_record(record: Record, source: random.Random) -> str:
    """Change one number or text of a record, its length, or its kind."""
    way = source.random()
    if way < 0.06:
        record.op = source.choice((*range(17), 0x80, 0xFF))
        return "kind"
    if way < 0.12:
        record.length = source.choice(
            (0, 1, len(record.body) + 1, max(len(record.body) - 1, 0), 2**31, 2**63, 2**64 - 9)
        )
        return "length"
    found = spots(record.op, record.body)
    if not found:
        record.body = source.randbytes(source.randrange(40))
        return "made up"
    n = source.randrange(len(found))
    spot = found[n]
    if spot.kind == "int":
        record.body = with_number(record.body, spot, source)
        return f"number {n} of record {record.op}"
    way_of = reworded if record.op == SCHEMA and source.random() < 0.7 else blindly
    part, what = way_of(record.body[spot.at : spot.at + spot.size], source)
    before = record.body[: spot.at]
    if n and found[n - 1].kind == "int" and found[n - 1].at + found[n - 1].size == spot.at and source.random() < 0.7:
        size = found[n - 1].size
        if record.op != 5:  # bytes of a message have no length of their own
            before = before[:-size] + (len(part) % (1 << 8 * size)).to_bytes(size, "little")
    record.body = before + part + record.body[spot.at + spot.size :]
    return f"{what} in text {n} of record {record.op}"
