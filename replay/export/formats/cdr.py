"""CDR of messages whose length varies: little-endian, each number aligned to its size behind the encapsulation header."""

from __future__ import annotations

import struct

HEADER = b"\x00\x01\x00\x00"


class Cdr:
    """Bytes of a part of a message.

    Parameters
    ----------
    start : int
        Place of the part's first byte behind the encapsulation header; its remainder by 8 decides the alignment.
    """

    def __init__(self, start: int = 0) -> None:
        self._start = start
        self._bytes = bytearray()

    def number(self, code: str, value: float) -> None:
        """Append a number; `code` as in `struct`. In the field's own unit."""
        size = struct.calcsize(code)
        self._bytes += bytes(-(self._start + len(self._bytes)) % size)
        self._bytes += struct.pack("<" + code, value)

    def text(self, value: str) -> None:
        """Append a string in UTF-8; its length counts the NUL at its end, so a NUL within it is left out."""
        octets = value.replace("\0", "").encode("utf-8", "replace") + b"\0"
        self.number("I", len(octets))
        self._bytes += octets

    def stamp(self, ns: int) -> None:
        """Append a ``builtin_interfaces/Time``."""
        self.number("I", ns // 1_000_000_000)  # to 2106, as the other topics
        self.number("I", ns % 1_000_000_000)

    def octets(self, octets: bytes) -> None:
        """Append bytes that were made for this place."""
        self._bytes += octets

    @property
    def place(self) -> int:
        """Place of the next byte behind the encapsulation header."""
        return self._start + len(self._bytes)

    def part(self) -> bytes:
        """The bytes, without the encapsulation header."""
        return bytes(self._bytes)

    def message(self) -> bytes:
        """A whole message."""
        return HEADER + bytes(self._bytes)
