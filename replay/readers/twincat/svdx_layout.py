"""The frame of a TwinCAT Scope recording (``.svdx``): block index, block heads, and the XML at its end.

Every length is checked; the XML is untrusted, so document types (and with them entities) are refused and its size and
depth are bounded.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO
from xml.parsers import expat

from replay.errors import LogError

VERSION = b"01.00.00.40"
HEAD, ENTRY = 20, 20
_BOM = b"\xef\xbb\xbf"
MAX_XML = 256 << 20
MAX_DEPTH = 200
_MAX_TEXT = 1 << 16
_MAX_BLOCKS = 100_000
_CHANNEL = "Acquisition"
_FIELDS = frozenset(
    [
        "Name",
        "SymbolName",
        "DataType",
        "AmsNetId",
        "TargetPort",
        "BaseSampleTime",
        "Oversample",
        "FileHandle",
        "ScaleFactor",
        "Offset",
        "Unit",
    ]
)
HOW = "export the recording as text (CSV) from Scope and read that"


@dataclass(frozen=True)
class Block:
    """One entry of the index: where the samples of one acquisition stand [bytes]."""

    offset: int
    length: int
    handle: int


@dataclass(frozen=True)
class BlockHead:
    """Head of a block.

    Attributes
    ----------
    start, first, last : int
        FILETIME of its beginning and of the exported window.
    period : int
        Sample time [100 ns].
    samples : int
        Offset of the first segment of samples in the block; smaller ones hold a pyramid of minima and maxima.
    """

    start: int
    first: int
    last: int
    period: int
    samples: int


@dataclass(frozen=True)
class Frame:
    """Blocks, and what the XML says of each acquisition, by its handle."""

    blocks: tuple[Block, ...]
    acquisitions: dict[int, dict[str, str]]


def is_svdx(file: IO[bytes], size: int) -> bool:
    """Whether the first bytes are those of a Scope recording of this size."""
    head = file.read(HEAD + ENTRY)
    if len(head) < HEAD + ENTRY:
        return False
    xml, length, count = struct.unpack_from("<QQI", head)
    offset, _, _ = struct.unpack_from("<QQI", head, HEAD)
    if xml + length != size or not 0 < count <= _MAX_BLOCKS or offset + len(VERSION) > size:
        return False
    file.seek(offset)
    return file.read(len(VERSION)) == VERSION


def read_frame(path: Path, file: IO[bytes], size: int) -> Frame:
    """Read the index and the XML.

    Raises
    ------
    LogError
        Where a length does not fit the file, or the XML cannot be used.
    """
    xml, length, count = struct.unpack("<QQI", _exactly(path, file, 0, HEAD))
    if xml + length != size:
        raise LogError(
            f"{path}: its head places {length} bytes of XML at byte {xml}, but the file has {size} bytes; it was cut off or "
            "changed; copy it again"
        )
    if count > _MAX_BLOCKS or HEAD + count * ENTRY > xml:
        raise LogError(f"{path}, byte 16: {count} blocks do not fit before the XML at byte {xml}; {HOW}")
    blocks = []
    raw = _exactly(path, file, HEAD, count * ENTRY)
    for i in range(count):
        offset, size_of, handle = struct.unpack_from("<QQI", raw, i * ENTRY)
        if offset < HEAD + count * ENTRY or offset + size_of > xml:
            raise LogError(
                f"{path}, byte {HEAD + i * ENTRY}: block {i + 1} of {size_of} bytes at byte {offset} is not between the "
                f"index and the XML at byte {xml}; {HOW}"
            )
        blocks.append(Block(offset, size_of, handle))
    if length > MAX_XML:
        raise LogError(f"{path}: its XML takes {length} bytes; at most {MAX_XML} are read; {HOW}")
    return Frame(tuple(blocks), _acquisitions(path, _exactly(path, file, xml, length)))


def _exactly(path: Path, file: IO[bytes], at: int, count: int) -> bytes:
    file.seek(at)
    raw = file.read(count)
    if len(raw) != count:
        raise LogError(f"{path}, byte {at}: {count} bytes were expected, {len(raw)} are left; the file was cut off")
    return raw


def read_head(path: Path, file: IO[bytes], block: Block) -> BlockHead:
    """Read the head of a block.

    Raises
    ------
    LogError
        Where it is of another version or its lengths do not fit.
    """
    where = f"{path}, block of handle {block.handle} at byte {block.offset}"
    raw = _exactly(path, file, block.offset, min(block.length, 87))
    if len(raw) < 87 or not raw.startswith(VERSION):
        raise LogError(f"{where}: it begins with {raw[:11]!r}; only version {VERSION.decode()} is known; {HOW}")
    start, first, last = (struct.unpack_from("<Q", raw, at)[0] for at in (11, 27, 35))
    sixteen, period = struct.unpack_from("<QQ", raw, 51)
    if sixteen != 16:
        raise LogError(f"{where}: byte 51 of its head holds {sixteen}, 16 was expected; {HOW}")
    (level,) = struct.unpack_from("<I", raw, 83)
    place = 83 + 56 * level + 4
    if place + 8 > block.length:
        raise LogError(f"{where}: its pyramid of {level} levels does not fit its {block.length} bytes; {HOW}")
    (samples,) = struct.unpack("<Q", _exactly(path, file, block.offset + place, 8))
    if not place + 8 <= samples <= block.length:
        raise LogError(f"{where}: its samples should begin at its byte {samples}, it has {block.length}; {HOW}")
    return BlockHead(start, first, last, period, samples)


@dataclass
class _Walk:
    """State of the pull through the XML."""

    path: Path
    stack: list[str] = field(default_factory=list)
    acquisition: dict[str, str] | None = None
    level: int = 0
    text: list[str] = field(default_factory=list)
    held: int = 0
    found: dict[int, dict[str, str]] = field(default_factory=dict)

    def begin(self, name: str, _attributes: object) -> None:
        self.stack.append(name)
        if len(self.stack) > MAX_DEPTH:
            raise LogError(f"{self.path}: its XML is nested deeper than {MAX_DEPTH}; {HOW}")
        if name.endswith(_CHANNEL) and self.acquisition is None:
            self.acquisition, self.level = {}, len(self.stack)
        self.text, self.held = [], 0

    def characters(self, text: str) -> None:
        if self.acquisition is not None and self.held < _MAX_TEXT:
            self.text.append(text)
            self.held += len(text)

    def end(self, name: str) -> None:
        if self.acquisition is not None:
            if len(self.stack) == self.level:
                handle = self.acquisition.get("FileHandle", "")
                if handle.isdigit() and len(handle) < 10:
                    self.found.setdefault(int(handle), self.acquisition)
                self.acquisition = None
            elif name in _FIELDS and (len(self.stack) == self.level + 1 or name == "FileHandle"):
                self.acquisition[name] = "".join(self.text).strip()
        self.stack.pop()

    def refuse(self, *_: object) -> None:
        raise LogError(f"{self.path}: its XML declares a document type or entities, which Scope never writes; {HOW}")


def _acquisitions(path: Path, raw: bytes) -> dict[int, dict[str, str]]:
    """Fields of each acquisition by its file handle."""
    if not raw.startswith(_BOM):
        raise LogError(f"{path}: its XML does not begin with a byte-order mark but with {raw[:8]!r}; {HOW}")
    walk = _Walk(path)
    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler, parser.EndElementHandler = walk.begin, walk.end
    parser.CharacterDataHandler = walk.characters
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = walk.refuse
    try:
        parser.Parse(raw[len(_BOM) :], True)
    except expat.ExpatError as error:
        raise LogError(f"{path}: its XML is damaged ({error}); {HOW}") from error
    return walk.found
