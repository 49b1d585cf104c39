"""Text tables of many kinds at once: other encodings midway, NULs, endless lines, odd quotes and clocks, and packed bombs."""

from __future__ import annotations

import gzip
import random

import zstandard

from tests.benchmarks.fuzzing.case import Case

CLOCKS = (
    lambda i: f"{i / 100}", lambda i: str(i), lambda i: str(1_700_000_000_000 + i * 10), lambda i: f"2024-05-01T10:00:{i % 60:02d}.{i:09d}Z",
    lambda i: f"2024-05-01 10:{i // 60 % 60:02d}:{i % 60:02d}+25:99", lambda i: f"{i}e-2", lambda i: str(2**63 - 40 + i), lambda i: f"-{i}", lambda i: "0",
    lambda i: str(i % 7), lambda i: f"99999-12-31T23:59:{i % 60}", lambda i: f"1e{i * 10}", lambda i: f"{i // 60}:{i % 60:02d}:00.5", lambda i: "",
    lambda i: f"0001-01-01T00:00:{i % 60:02d}Z", lambda i: str(2**64 + i), lambda i: f"31.12.2024 23:{i % 60:02d}", lambda i: f"0x{i:x}", lambda i: f"{i}.{i}.{i}",
)  # fmt: skip
HEADS = (
    "t",
    "time",
    "timestamp",
    "Time [s]",
    "stamp_ns",
    "Zeit",
    "",
    "date,time",
    "\ufefft",
    "t\x00",
    "sec,nsec",
    "%time",
    "#t",
    '"t',
    "t [" + "s" * 3000 + "]",
)
CELLS = (
    "1.5",
    "1.5",
    "-0.0",
    "",
    '"',
    '"a""b"',
    '"a\nb"',
    "'",
    "\0",
    "x" * 200_000,
    "\\N",
    "1,5",
    "1.000,5",
    "1e5000",
    "1" * 20_000,
    "+",
    "--1",
    "NaN",
    "∞",
    "\x1a",
    "\x0c",
    "\u2028",
)


def made_up(pack: str, source: random.Random) -> Case:
    """One table, packed as its name says."""
    mark, end = source.choice(",;\t| "), source.choice(("\n", "\n", "\r\n", "\r", "\n\n", ""))
    clock, head = source.choice(CLOCKS), source.choice(HEADS)
    width = source.choice((1, 2, 2, 5, 19_990, 20_010)) if source.random() < 0.1 else source.choice((1, 2, 5))
    rows = [
        mark.join([head, *(source.choice((f"v{k}", "v", "", "v [rpm]", f'"v{mark}{k}"')) for k in range(width))])
    ] * source.choice((1, 1, 1, 0, 2))
    if source.random() < 0.2:
        rows.append(mark.join(source.choice(("s", "[s]", "rpm", "", "m/s", "5")) for _ in range(width + 1)))
    odd = source.choice((0.0, 0.0, 0.02, 0.5)) if width < 100 else 0.0
    for i in range(source.choice((0, 1, 2, 60, 60, 900)) if width < 100 else 2):
        cells = [source.choice(CELLS) if source.random() < odd else str(i * k / 7) for k in range(width)]
        rows.append(mark.join([clock(i), *cells[: None if source.random() > odd else -1]]))
    text = end.join(rows) + source.choice((end, "", '"', "\0" * 5000, "EOF"))
    raw = _encoded(text, source)
    if source.random() < 0.1:
        raw = (
            raw[: len(raw) // 2]
            + source.choice((b"\xff\xfe", b"\xef\xbb\xbf", bytes(4096), "é".encode("latin-1"), b"\r"))
            + raw[len(raw) // 2 :]
        )
    return Case(
        _packed(raw, pack, source),
        f"made up: {len(rows)} rows, {width} columns, clock {clock(3)[:20]!r}",
        {"edits": 9, "made": True},
    )


def _encoded(text: str, source: random.Random) -> bytes:
    way = source.choice(
        ("utf-8", "utf-8", "utf-8", "utf-8-sig", "latin-1", "utf-16", "utf-16-be", "utf-32", "cp1252", "utf-7")
    )
    raw = text.encode(way, "replace")
    if source.random() < 0.1:
        half = len(text) // 2
        raw = text[:half].encode("utf-8", "replace") + text[half:].encode(
            source.choice(("utf-16-le", "latin-1")), "replace"
        )
    return raw[: -1 if source.random() < 0.1 else None]


def _packed(raw: bytes, pack: str, source: random.Random) -> bytes:
    """Packed, sometimes in several members, behind a bomb, or with more behind its end."""
    if pack not in ("gz", "zst"):
        return raw
    way, half = source.random(), len(raw) // 2
    press = (
        (lambda b: gzip.compress(b, 1, mtime=0))
        if pack == "gz"
        else zstandard.ZstdCompressor(write_checksum=True, write_content_size=source.random() < 0.5).compress
    )
    if way < 0.3:
        return press(raw)
    if way < 0.5:
        return press(raw[:half]) + press(raw[half:])
    if way < 0.6:
        return press(raw) + source.choice((bytes(600), b"\x1f\x8b", b"x" * 9, press(b"")))
    if way < 0.7:
        return press(press(raw))
    if way < 0.75:
        filler = source.choice((b"\n", b"\0", b"1,1\n", b"1", b'"', b"#\n"))
        return press(raw + filler * (source.choice((1 << 20, 24 << 20)) // len(filler)))
    if way < 0.8:
        return press(b"")
    return press(raw)[: source.randrange(1, 200)]
