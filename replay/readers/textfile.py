"""Text of a table file: gzip or not, in the encodings that exports use."""

from __future__ import annotations

import zlib
from pathlib import Path

from replay.errors import LogError
from replay.readers.clocks import Report

GZIP = b"\x1f\x8b"
MAX_TEXT = 4 << 30
_PIECE = 1 << 20


def first_text(path: Path, size: int = 65_536) -> str:
    """Return the beginning of a text file, or an empty string where it is not text."""
    try:
        with path.open("rb") as file:
            head = file.read(size)
        if head.startswith(GZIP):
            head = zlib.decompressobj(31).decompress(head, size)
    except (OSError, zlib.error):
        return ""
    text = _decoded(head)[0]
    odd = sum(c < " " and c not in "\t\r\n\f" for c in text[:4096])
    return "" if odd else text


def read_text(path: Path, report: Report) -> str:
    """Return a whole text file; every line ends in a line feed.

    Raises
    ------
    LogError
        Where the file cannot be opened, is empty or larger than `MAX_TEXT`.
    """
    try:
        with path.open("rb") as file:
            packed = file.read(2) == GZIP
        raw = _unzip(path, report) if packed else path.read_bytes()
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error
    if len(raw) > MAX_TEXT:
        raise LogError(f"{path} holds more than {MAX_TEXT >> 30} GiB of text; split it or export fewer channels")
    text, encoding = _decoded(raw)
    if encoding == "cp1252":
        report.note(f"{path.name} is not UTF-8; it was read as Windows-1252, so some letters may be wrong")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _unzip(path: Path, report: Report) -> bytes:
    """Expand as far as the file is whole, members one after the other."""
    pieces: list[bytes] = []
    size, member = 0, zlib.decompressobj(31)
    trouble = ""
    with path.open("rb") as file:
        left = file.read(_PIECE)
        while left and size <= MAX_TEXT and not trouble:
            try:
                piece = member.decompress(left, _PIECE)
            except zlib.error:
                trouble = "damaged"
                break
            pieces.append(piece)
            size += len(piece)
            left = (member.unused_data if member.eof else member.unconsumed_tail) or file.read(_PIECE)
            if member.eof and left:
                member = zlib.decompressobj(31)
    if not member.eof or trouble:
        report.lost(f"{path.name}: its gzip data are {trouble or 'cut off'} after {size} bytes of text")
    return b"".join(pieces)


def _decoded(raw: bytes) -> tuple[str, str]:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16", "replace"), "utf-16"
    try:
        return raw.decode("utf-8-sig"), "utf-8"
    except UnicodeDecodeError as error:
        if error.end >= len(raw) - 3 and error.reason == "unexpected end of data":
            return raw[: error.start].decode("utf-8-sig"), "utf-8"
        return raw.decode("cp1252", "replace"), "cp1252"
