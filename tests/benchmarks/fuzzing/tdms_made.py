"""TDMS segments whose lengths agree or not: objects, types, counts, properties, layouts and byte orders of every kind."""

from __future__ import annotations

import random
import struct

from tests.benchmarks.fuzzing.case import Case
from tests.benchmarks.fuzzing.damage import FAR

_TYPES = {
    1: "b",
    2: "h",
    3: "i",
    4: "q",
    5: "B",
    6: "H",
    7: "I",
    8: "Q",
    9: "f",
    10: "d",
    0x19: "f",
    0x1A: "d",
    0x21: "b",
}
PATHS = (
    "/",
    "/'G'",
    "/'G'/'a'",
    "/'G'/'a'",
    "/'G'/'time'",
    "/'H'/'b'",
    "/'G'/'it''s'",
    "G",
    "",
    "/'G'/'a'/'b'",
    "/'" + "x" * 70_000 + "'",
    "/'\x1b[31m\n'/'a'",
    "//",
)


def made_up(source: random.Random) -> Case:
    """A file of one to five segments."""
    order = "<" if source.random() < 0.9 else ">"
    parts = [_segment(order, k, source) for k in range(source.choice((1, 1, 2, 5)))]
    return Case(b"".join(parts), f"made up of {len(parts)} segments")


def _text(order: str, text: str, source: random.Random) -> bytes:
    raw = text.encode("utf-8", "surrogatepass")
    size = len(raw) if source.random() < 0.98 else source.choice(FAR) % 2**32
    return struct.pack(f"{order}I", size) + raw


def _property(order: str, source: random.Random) -> bytes:
    name = source.choice(
        ("wf_start_time", "wf_increment", "wf_start_offset", "wf_samples", "unit_string", "wf_increment", "", "x")
    )
    kind = source.choice((*_TYPES, 0x20, 0x44, 0, 0xFFFFFFFF, 0x69, 0x08000C))
    out = _text(order, name, source) + struct.pack(f"{order}I", kind)
    if kind == 0x20:
        return out + _text(order, source.choice(("rpm", "", "\0", "x" * 9000)), source)
    if kind == 0x44:
        return out + struct.pack(
            f"{order}Qq", source.choice(FAR) % 2**64, source.choice((0, 3_700_000_000, 2**62, -(2**63)))
        )
    letter = _TYPES.get(kind, "I")
    if letter in "fd":
        return out + struct.pack(order + letter, source.choice((0.0, 0.001, -1.0, float("nan"), float("inf"), 1e38)))
    size = struct.calcsize(letter)
    return out + (source.choice(FAR) % 2 ** (8 * size)).to_bytes(size, "little")


def _segment(order: str, number: int, source: random.Random) -> bytes:
    paths = source.sample(PATHS, source.choice((1, 2, 3)))
    count = len(paths) if source.random() < 0.95 else source.choice(FAR) % 2**32
    meta, data = struct.pack(f"{order}I", count), b""
    for path in paths:
        meta += _text(order, path, source)
        kind, values = (
            source.choice((*_TYPES, 10, 10, 0x20, 0x44, 0, 0xFFFFFFFF)),
            source.choice((0, 1, 20, 20, 20, *FAR)),
        )
        sound = values == 20 and kind in _TYPES
        raw = (
            struct.pack(f"{order}20{_TYPES[kind]}", *range(20))
            if sound
            else source.randbytes(source.choice((0, 8, 160)))
        )
        way = source.random()
        if way < 0.1 or path.count("/'") < 2:
            meta += struct.pack(f"{order}I", source.choice((0xFFFFFFFF, 0xFFFFFFFF, 0, 0x69120000, 0x69130000)))
        elif way < 0.2 and number:
            meta += struct.pack(f"{order}I", 0)
            data += raw
        else:
            index = struct.pack(f"{order}IIQ", kind, source.choice((1, 1, 1, 0, 2, 2**32 - 1)), values % 2**64)
            if kind == 0x20:
                texts = b"".join(
                    struct.pack(f"{order}I", source.choice((k * 2, k * 2, 2**32 - 1))) for k in range(1, 21)
                )
                raw = texts + b"x" * 40 if source.random() < 0.7 else raw
                index += struct.pack(f"{order}Q", len(raw) if source.random() < 0.9 else source.choice(FAR) % 2**64)
            meta += (
                struct.pack(f"{order}I", len(index) + 4 if source.random() < 0.95 else source.choice(FAR) % 2**32)
                + index
            )
            data += raw
        properties = [_property(order, source) for _ in range(source.choice((0, 1, 3)))]
        meta += struct.pack(
            f"{order}I", len(properties) if source.random() < 0.95 else source.choice(FAR) % 2**32
        ) + b"".join(properties)
    data *= source.choice((1, 1, 1, 2, 0))
    flags = source.choice((0x0E, 0x0E, 0x0E, 0x0A, 0x2E, 0x08, 0xFF, 0x8E)) | (0x40 if order == ">" else 0)
    after, start = len(meta) + len(data), len(meta)
    if source.random() < 0.15:
        after = source.choice((2**64 - 1, 0, len(meta), after + 1, after - 1, 2**63, 2**62)) % 2**64
    if source.random() < 0.1:
        start = source.choice((0, 1, len(meta) - 1, len(meta) + 1, after, 2**63)) % 2**64
    return (
        b"TDSm"
        + struct.pack("<I", flags)
        + struct.pack(f"{order}I", source.choice((4713, 4712, 0, 9)))
        + struct.pack(f"{order}QQ", after, start)
        + meta
        + data
    )
