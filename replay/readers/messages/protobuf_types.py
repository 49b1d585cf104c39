"""Message types in a serialised FileDescriptorSet by their full names, with the features of the language that hold in each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

MAX_TYPES = 20_000
MAX_NESTING = 32

# Values of FeatureSet
_EXPLICIT, IMPLICIT = 1, 2
VERIFY, _NO_CHECK = 2, 3
DELIMITED = 2


@dataclass
class Features:
    """What editions of the language turn on and off, inherited inwards."""

    presence: int
    utf8: int
    encoding: int = 1

    def with_options(self, options: bytes, number: int) -> Features:
        """Take over a FeatureSet found under a number of an options message."""
        out = Features(self.presence, self.utf8, self.encoding)
        for n, value in parts_of(options):
            if n == number and isinstance(value, bytes):
                for key, chosen in parts_of(value):
                    if isinstance(chosen, int):
                        out.presence = chosen if key == 1 else out.presence
                        out.utf8 = chosen if key == 4 else out.utf8
                        out.encoding = chosen if key == 5 else out.encoding
        return out


@dataclass
class ProtobufType:
    """A message type that was found but not yet read."""

    raw: bytes
    features: Features
    editions: bool
    parts: list[tuple[int, int | bytes]] = field(default_factory=list)


def types_of(raw: bytes) -> dict[str, ProtobufType]:
    """Find all message types of a FileDescriptorSet by their full names."""
    types: dict[str, ProtobufType] = {}
    for number, file in parts_of(raw):
        if number != 1 or not isinstance(file, bytes):
            continue
        parts = list(parts_of(file))
        package, syntax = text_of(parts, 2), text_of(parts, 12)
        editions = syntax == "editions"
        open_kind = syntax == "proto3"
        features = Features(IMPLICIT if open_kind else _EXPLICIT, VERIFY if open_kind or editions else _NO_CHECK)
        for n, value in parts:
            if editions and n == 8 and isinstance(value, bytes):
                features = features.with_options(value, 50)
        for n, value in parts:
            if n == 4 and isinstance(value, bytes):
                _collect(types, value, package, features, editions, 0)
    return types


def _collect(
    types: dict[str, ProtobufType], raw: bytes, scope: str, features: Features, editions: bool, depth: int
) -> None:
    if depth > MAX_NESTING or len(types) >= MAX_TYPES:
        raise ValueError(f"more than {MAX_TYPES} types, or nested deeper than {MAX_NESTING}")
    kind = ProtobufType(raw, features, editions, list(parts_of(raw)))
    name = text_of(kind.parts, 1)
    full = f"{scope}.{name}" if scope else name
    if editions:
        kind.features = features.with_options(block_of(kind.parts, 7), 12)
    types[full] = kind
    for n, value in kind.parts:
        if n == 3 and isinstance(value, bytes):
            _collect(types, value, full, kind.features, editions, depth + 1)


def parts_of(raw: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Yield number and value of each field of a serialised message.

    Raises
    ------
    ValueError
        Where a field does not lie within the message, or is of no known kind.
    """
    at = 0
    while at < len(raw):
        tag, at = _varint(raw, at)
        number, wire = tag >> 3, tag & 7
        if wire == 0:
            value, at = _varint(raw, at)
            yield number, value
        elif wire == 2:
            size, at = _varint(raw, at)
            if size > len(raw) - at:
                raise ValueError("a part is longer than the whole")
            yield number, raw[at : at + size]
            at += size
        elif wire in (1, 5):
            at += 8 if wire == 1 else 4
            if at > len(raw):
                raise ValueError("it ends inside a field")
        else:
            raise ValueError(f"wire type {wire}")


def _varint(raw: bytes, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = raw[at]
        at += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
    raise ValueError("a number of more than ten bytes")


def text_of(parts: list[tuple[int, int | bytes]], number: int) -> str:
    """Text of the last field of a number; empty where there is none."""
    return block_of(parts, number).decode()


def block_of(parts: list[tuple[int, int | bytes]], number: int) -> bytes:
    """Bytes of the last field of a number; empty where there is none."""
    return next((v for n, v in reversed(parts) if n == number and isinstance(v, bytes)), b"")


def int_of(parts: list[tuple[int, int | bytes]], number: int) -> int:
    """Value of the last field of a number; 0 where there is none."""
    return next((v for n, v in reversed(parts) if n == number and isinstance(v, int)), 0)
