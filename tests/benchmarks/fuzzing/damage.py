"""Damage that knows nothing of a format but where its numbers and texts stand."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

FAR = (0, 1, 2, 7, 8, 127, 128, 255, 256, 4095, 4096, 32767, 32768, 65535, 65536, 10**6, 2**24, 2**31 - 1, 2**31, 2**32 - 1,
       2**40, 2**53, 2**62, 2**63 - 1, 2**63, 2**64 - 9, 2**64 - 1)  # fmt: skip


class Spot(NamedTuple):
    """A number or a stretch of bytes within a record.

    Attributes
    ----------
    at, size : int
        Place and length [bytes].
    kind : str
        ``int`` or ``bytes``.
    """

    at: int
    size: int
    kind: str


def other_number(value: int, size: int, source: random.Random, near: Sequence[int] = ()) -> int:
    """Another number of `size` bytes: far, next to the one that was there, of one other bit, or one of `near`."""
    match source.randrange(6):
        case 0 | 1:
            value = source.choice(FAR)
        case 2:
            value += source.choice((-9, -8, -2, -1, 1, 2, 8, 9))
        case 3:
            value ^= 1 << source.randrange(8 * size)
        case 4 if near:
            value = source.choice(near) + source.choice((-1, 0, 0, 1))
        case _:
            value = source.getrandbits(8 * size)
    return value % (1 << 8 * size)


def with_number(raw: bytes, spot: Spot, source: random.Random, order: str = "little") -> bytes:
    """The bytes with another number at a spot."""
    end = spot.at + spot.size
    value = int.from_bytes(raw[spot.at : end], order)  # type: ignore[arg-type]
    new = other_number(value, spot.size, source, (len(raw), spot.at, end))
    return raw[: spot.at] + new.to_bytes(spot.size, order) + raw[end:]  # type: ignore[arg-type]


def _cut(raw: bytes, source: random.Random) -> bytes:
    return raw[: source.randrange(len(raw))]


def _flip(raw: bytes, source: random.Random) -> bytes:
    data = bytearray(raw)
    for _ in range(source.choice((1, 1, 1, 2, 8))):
        data[source.randrange(len(data))] ^= 1 << source.randrange(8)
    return bytes(data)


def _overwrite(raw: bytes, source: random.Random) -> bytes:
    at, size = source.randrange(len(raw)), source.choice((1, 2, 4, 8, 64, 600))
    fill = source.choice((bytes(size), b"\xff" * size, source.randbytes(size)))
    return raw[:at] + fill[: len(raw) - at] + raw[at + size :]


def _insert(raw: bytes, source: random.Random) -> bytes:
    at, size = source.randrange(len(raw)), source.choice((1, 2, 8, 100, 4096))
    return raw[:at] + source.choice((bytes(size), source.randbytes(size))) + raw[at:]


def _delete(raw: bytes, source: random.Random) -> bytes:
    at = source.randrange(len(raw))
    return raw[:at] + raw[at + source.choice((1, 2, 8, 100, 4096)) :]


def _repeat(raw: bytes, source: random.Random) -> bytes:
    at = source.randrange(len(raw))
    return raw[:at] + raw[at : at + source.choice((1, 16, 200))] * source.choice((2, 3, 20)) + raw[at:]


def _move(raw: bytes, source: random.Random) -> bytes:
    at, to, size = source.randrange(len(raw)), source.randrange(len(raw)), source.choice((4, 32, 512))
    return raw[:to] + raw[at : at + size] + raw[to + size :]


def _number(raw: bytes, source: random.Random) -> bytes:
    size = source.choice((1, 2, 4, 8))
    at = source.randrange(max(len(raw) - size, 1))
    return with_number(raw, Spot(at, min(size, len(raw) - at), "int"), source, source.choice(("little", "big")))


def _tail(raw: bytes, source: random.Random) -> bytes:
    return raw + source.choice((bytes(4096), source.randbytes(100), raw[-200:], raw))


def _nest(raw: bytes, source: random.Random) -> bytes:
    at, mark = source.randrange(len(raw)), source.choice((b"(", b"[", b"{", b"<", b'"', b"'", b"-", b"/", b",", b"."))
    return raw[:at] + mark * source.choice((3, 30, 3000)) + raw[at:]


_TOKENS = re.compile(rb"[\w.]+|\s+|[^\w\s]")
_PAIRS = (
    (b"(", b")"),
    (b"[", b"]"),
    (b"{", b"}"),
    (b"<", b">"),
    (b'"', b'"'),
    (b"sequence<", b">"),
    (b"/*", b"*/"),
    (b"<a>", b"</a>"),
)


def reworded(raw: bytes, source: random.Random) -> tuple[bytes, str]:
    """Wrap, repeat, swap, drop or replace words and signs of a text."""
    words = _TOKENS.findall(raw) or [b"x"]
    for _ in range(source.choice((1, 1, 2, 4))):
        k = source.randrange(len(words))
        way = source.randrange(6)
        if way == 0:
            left, right = source.choice(_PAIRS)
            times = source.choice((1, 2, 3, 4, 30, 2000))
            words[k] = left * times + words[k] + right * (times if source.random() < 0.8 else 0)
        elif way == 1:
            words[k : k + 1] = words[k : k + source.choice((1, 2, 6))] * source.choice((2, 10, 500))
        elif way == 2:
            j = source.randrange(len(words))
            words[j], words[k] = words[k], words[j]
        elif way == 3:
            words[k] = b""
        elif way == 4:
            words[k] = str(source.choice((*FAR, -1, 1e400, 10**30))).encode()
        else:
            words[k] = source.choice(words)
    return b"".join(words), "reworded"


def spliced(raw: bytes, other: bytes, source: random.Random) -> tuple[bytes, str]:
    """The beginning of one file and the end, or a stretch, of another."""
    at, to = source.randrange(len(raw) + 1), source.randrange(len(other) + 1)
    if source.random() < 0.5:
        return raw[:at] + other[to:], "spliced"
    size = source.choice((16, 200, 2000))
    return raw[:at] + other[to : to + size] + raw[at + source.choice((0, size)) :], "with a stretch of another"


BLIND: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _cut, _flip, _flip, _overwrite, _insert, _delete, _repeat, _move, _number, _number, _tail, _nest,
)  # fmt: skip


def blindly(raw: bytes, source: random.Random) -> tuple[bytes, str]:
    """Damage bytes at random places; what was done."""
    if not raw:
        return source.randbytes(source.randrange(1, 64)), "made up"
    way = source.choice(BLIND)
    return way(raw, source), way.__name__.strip("_")
