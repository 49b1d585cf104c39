"""Bytes of a text table: plain or packed, in the encodings that exports use, block by block."""

from __future__ import annotations

import codecs
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import zstandard

from replay.errors import LogError
from replay.log.reading_notes import Report

GZIP, ZSTD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"
MAX_EXPANDED = 32 << 30
BLOCK = 4 << 20
_PIECE = 1 << 20
_ZSTD_PIECE = 1 << 10  # packed bytes that are expanded at once; each may become 32 KiB
_ZSTD_WINDOW = 1 << 28
_TAIL = 64 << 10
_ZEROS = re.compile(rb"\0{16,}")


def first_text(path: Path, size: int = 65_536) -> str:
    """Return the beginning of a text file, or an empty string where it is not text."""
    try:
        raw = TextFile(path, Report()).head(size).partition(b"\0" * 16)[0]
    except LogError:
        return ""
    text = decoded(raw)
    odd = sum(c < " " and c not in "\t\r\n\f" for c in text[:4096])
    return "" if odd else text


def decoded(raw: bytes) -> str:
    """Return text of UTF-8 bytes, or else of Windows-1252; a letter cut in two at the end is left out."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        if error.end >= len(raw) - 3 and error.reason == "unexpected end of data":
            return raw[: error.start].decode("utf-8")
        return raw.decode("cp1252", "replace")


class TextFile:
    """A text file whose bytes come in blocks, expanded, as UTF-8 (or Windows-1252) without a byte-order mark.

    Parameters
    ----------
    path : Path
        The file; gzip and zstd are expanded, UTF-16 is turned into UTF-8.
    report : Report
        Takes what is lost, and a note on the encoding.
    """

    def __init__(self, path: Path, report: Report) -> None:
        self.path, self.report = path, report
        first = next(self._expanded(Report(), 4096), b"")
        self.packed = self._packed
        self._codec = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}.get(first[:2], "")
        self._skip = 2 if self._codec else 3 if first.startswith(codecs.BOM_UTF8) else 0
        self._bare_returns = b"\r" in first and b"\n" not in first and not self._codec

    def head(self, size: int) -> bytes:
        """Return the first bytes, at least `size` where the file has so many; nothing of it is reported."""
        parts, held = [], 0
        for block in self._clean(Report(), min(size, BLOCK)):
            parts.append(block)
            held += len(block)
            if held >= size:
                break
        return b"".join(parts)

    def tail(self, skip: int) -> bytes:
        """Return the whole lines in the last bytes of a plain file, behind the first `skip`; nothing of a packed one."""
        if self.packed or self._codec:
            return b""
        with self.path.open("rb") as raw:
            at = max(raw.seek(0, 2) - _TAIL, skip)
            raw.seek(at)
            text = raw.read(_TAIL)
        return text if at == skip else text[text.find(b"\n") + 1 :]

    def quiet(self, skip: int) -> Iterator[bytes]:
        """Yield the bytes behind the first `skip`; nothing of them is reported."""
        for block in self._clean(Report(), BLOCK):
            piece = block[skip:]
            skip = max(skip - len(block), 0)
            if piece:
                yield piece

    def position_after(self, size: int) -> int:
        """Return about how many bytes of a packed file its first `size` bytes of text take."""
        with self.path.open("rb") as file:
            unpack = self._unzip if self.packed == "gzip" else self._unzstd
            held = taken = 0
            for piece in unpack(file, Report()):
                held, taken = held + len(piece), file.tell()
                if held >= size:
                    break
            return taken

    def blocks(self, skip: int = 0) -> Iterator[bytes]:
        """Yield the bytes behind the first `skip`; zeros of blocks that were never written are told and taken out.

        Raises
        ------
        LogError
            Where the file cannot be opened or expands beyond all measure.
        """
        at = zeros = 0
        for block in self._clean(self.report, BLOCK):
            size = len(block)
            piece = block[max(skip - at, 0) :] if at < skip else block
            at += size
            if b"\0" * 16 in piece:
                short = _ZEROS.sub(b"\0", piece)
                zeros += len(piece) - len(short)
                piece = short
            if piece:
                yield piece
        if zeros:
            self.report.lost(
                f"{self.path.name}: {zeros} bytes are zero where text was expected; the recorder reserved them or lost "
                "power before it wrote them"
            )

    def _clean(self, report: Report, size: int) -> Iterator[bytes]:
        """Blocks without byte-order mark, as UTF-8, with line feeds."""
        decoder = codecs.getincrementaldecoder(self._codec)("replace") if self._codec else None
        skip = self._skip
        for raw in self._expanded(report, size):
            block, skip = raw[skip:], 0
            if decoder is not None:
                block = decoder.decode(block).encode("utf-8", "replace")
            yield block.replace(b"\r", b"\n") if self._bare_returns else block

    def _expanded(self, report: Report, size: int) -> Iterator[bytes]:
        try:
            with self.path.open("rb") as file:
                magic = file.read(4)
                file.seek(0)
                self._packed = "gzip" if magic.startswith(GZIP) else "zstd" if magic == ZSTD else ""
                if not self._packed:
                    while block := file.read(size):
                        yield block
                    return
                total = 0
                unpack = self._unzip if self._packed == "gzip" else self._unzstd
                for block in unpack(file, report):
                    total += len(block)
                    if total > MAX_EXPANDED:
                        raise LogError(
                            f"{self.path} expands to more than {MAX_EXPANDED >> 30} GiB of text; expand and split it"
                        )
                    yield block
        except OSError as error:
            raise LogError(f"{self.path} cannot be read: {error.strerror or error}") from error

    def _unzip(self, file: IO[bytes], report: Report) -> Iterator[bytes]:
        """Expand as far as the file is whole, members one after the other."""
        size, member, trouble = 0, zlib.decompressobj(31), ""
        left = file.read(_PIECE)
        while left:
            try:
                piece = member.decompress(left, _PIECE)
            except zlib.error:
                trouble = "damaged"
                break
            size += len(piece)
            if piece:
                yield piece
            left = (member.unused_data if member.eof else member.unconsumed_tail) or file.read(_PIECE)
            if member.eof and left:
                if not left.startswith(GZIP[: len(left)]):
                    trouble = "" if not left.strip(b"\0") else "followed by something else"
                    break
                member = zlib.decompressobj(31)
        if not member.eof or trouble:
            report.lost(f"{self.path.name}: its gzip data are {trouble or 'cut off'} after {size} bytes of text")

    def _unzstd(self, file: IO[bytes], report: Report) -> Iterator[bytes]:
        """Expand as far as the file is whole, frames one after the other."""
        size, trouble = 0, ""
        expander = zstandard.ZstdDecompressor(max_window_size=_ZSTD_WINDOW)
        frame = expander.decompressobj()
        left = file.read(_ZSTD_PIECE)
        while left:
            try:
                piece = frame.decompress(left)
            except zstandard.ZstdError as error:
                trouble = f"damaged ({error})"
                break
            size += len(piece)
            for at in range(0, len(piece), _PIECE):
                yield piece[at : at + _PIECE]
            left = (frame.unused_data if frame.eof else b"") or file.read(_ZSTD_PIECE)
            if frame.eof and left:
                frame = expander.decompressobj()
        if trouble or not frame.eof:
            report.lost(f"{self.path.name}: its zstd data are {trouble or 'cut off'} after {size} bytes of text")
