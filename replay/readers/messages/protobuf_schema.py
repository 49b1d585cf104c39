"""Protobuf message types from a serialised FileDescriptorSet, as tables that a compiled walk can follow.

Only what a walk over payloads needs is taken: numbers, kinds, presence and nesting of fields.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.readers.messages.definitions import DefinitionError
from replay.readers.messages.fields import is_key_list
from replay.readers.messages.protobuf_types import (
    DELIMITED,
    IMPLICIT,
    VERIFY,
    ProtobufType,
    block_of,
    int_of,
    parts_of,
    text_of,
    types_of,
)

MAX_BYTES = 16 << 20
MAX_FIELDS = 20_000

# Kinds of `Tables.kind`: numbers first, in the order of `NUMBERS`.
NUMBERS = ("f8", "f4", "i8", "u8", "i4", "u8", "u4", "u1", "u4", "i4", "i4", "i8", "i4", "i8")
(DOUBLE, FLOAT, INT64, UINT64, INT32, FIXED64, FIXED32, BOOL, UINT32, ENUM, SFIXED32, SFIXED64, SINT32, SINT64) = range(
    14
)
BYTES, STRING, MESSAGE, GROUP = 14, 15, 16, 17
# FieldDescriptorProto.Type, from 1
_KINDS = (
    DOUBLE, FLOAT, INT64, UINT64, INT32, FIXED64, FIXED32, BOOL, STRING, GROUP, MESSAGE, BYTES, UINT32, ENUM,
    SFIXED32, SFIXED64, SINT32, SINT64,
)  # fmt: skip
_REPEATED = 3


@dataclass(frozen=True)
class Field:
    """One field of a message type.

    Attributes
    ----------
    name : str
        As the schema names it.
    number, kind : int
        Its number on the wire and one of this module's kinds.
    repeated, implicit, check, is_map : bool
        Whether it is an array; whether its absence means 0; whether its text must be UTF-8; whether it is a map.
    choice : int
        Number of the oneof that it belongs to, −1 for none.
    type_name : str
        Full name of its message type.
    """

    name: str
    number: int
    kind: int
    repeated: bool = False
    implicit: bool = False
    check: bool = False
    is_map: bool = False
    choice: int = -1
    type_name: str = ""


class Tables(NamedTuple):
    """Fields of all types as arrays, shape (fields,), by number in each type; first field of each, shape (types + 1,)."""

    first: NDArray[np.int64]
    number: NDArray[np.int64]
    kind: NDArray[np.int64]
    repeated: NDArray[np.bool_]
    implicit: NDArray[np.bool_]
    check: NDArray[np.bool_]
    key: NDArray[np.bool_]
    hidden: NDArray[np.bool_]
    choice: NDArray[np.int64]
    target: NDArray[np.int64]


@dataclass(frozen=True)
class Schema:
    """A message type and all that it holds.

    Attributes
    ----------
    fields : tuple[Field, ...]
        Fields of all types, as numbered in `tables`.
    tables : Tables
        The same for compiled code; type 0 is the message itself.
    stamp : tuple[str, str, str] or None
        Path of the message's stamp and the names of its seconds and nanoseconds.
    notes : tuple[str, ...]
        What is left out.
    """

    fields: tuple[Field, ...]
    tables: Tables
    stamp: tuple[str, str, str] | None
    notes: tuple[str, ...]


@lru_cache(maxsize=256)
def schema_of(type_name: str, definition: str) -> Schema:
    """Read a message type.

    Parameters
    ----------
    type_name : str
        Full name, with or without a leading dot.
    definition : str
        The serialised FileDescriptorSet, one character per byte (Latin-1).

    Raises
    ------
    DefinitionError
        Where the set is damaged, too large, or does not hold the type.
    """
    try:
        raw = definition.encode("latin-1")
    except UnicodeEncodeError as error:
        raise DefinitionError("its schema is text, not a serialised FileDescriptorSet") from error
    if len(raw) > MAX_BYTES:
        raise DefinitionError(f"its schema has {len(raw)} bytes; at most {MAX_BYTES} are read")
    try:
        types = types_of(raw)
        return _compile(type_name.removeprefix("."), types)
    except (ValueError, IndexError, struct.error, UnicodeDecodeError) as error:
        raise DefinitionError(f"its schema is not a FileDescriptorSet ({error})") from error


def _compile(root: str, types: dict[str, ProtobufType]) -> Schema:
    """Number the types that the root reaches, and read their fields."""
    if root not in types:
        raise DefinitionError(f"its schema does not hold the message type {root!r}")
    order, number = [root], {root: 0}
    rows: list[Field] = []
    first, target = [0], []
    left: list[str] = []
    for name in order:  # grows while it is walked
        for entry in sorted(_fields(name, types), key=lambda f: f.number):
            rows.append(entry)
            if len(rows) > MAX_FIELDS:
                raise DefinitionError(f"its schema has more than {MAX_FIELDS} fields")
            if entry.kind == GROUP or entry.is_map:
                left.append(entry.name)
            if entry.kind == MESSAGE and entry.type_name not in number:
                number[entry.type_name] = len(order)
                order.append(entry.type_name)
            target.append(number[entry.type_name] if entry.kind == MESSAGE else -1)
        first.append(len(rows))
    tables = Tables(
        np.array(first, np.int64),
        np.array([f.number for f in rows], np.int64),
        np.array([f.kind for f in rows], np.int64),
        np.array([f.repeated for f in rows], np.bool_),
        np.array([f.implicit for f in rows], np.bool_),
        np.array([f.check for f in rows], np.bool_),
        np.array([f.kind == STRING and f.repeated and is_key_list(f.name) for f in rows], np.bool_),
        np.array([f.is_map for f in rows], np.bool_),
        np.array([f.choice for f in rows], np.int64),
        np.array(target, np.int64),
    )
    notes = (f"left out maps and groups: {', '.join(dict.fromkeys(left[:5]))}",) if left else ()
    return Schema(tuple(rows), tables, _stamp(rows, first, target), notes)


def _fields(name: str, types: dict[str, ProtobufType]) -> Iterator[Field]:
    kind = types[name]
    for n, value in kind.parts:
        if n == 2 and isinstance(value, bytes):
            yield _field(list(parts_of(value)), name, kind, types)


def _field(
    parts: list[tuple[int, int | bytes]], scope: str, owner: ProtobufType, types: dict[str, ProtobufType]
) -> Field:
    name, number, code = text_of(parts, 1), int_of(parts, 3), int_of(parts, 5)
    if not name or not 0 < number < 1 << 29 or not 0 < code <= len(_KINDS):
        raise ValueError(f"field {name!r} of {scope} has number {number} and type {code}")
    kind, repeated = _KINDS[code - 1], int_of(parts, 4) == _REPEATED
    choice = next((v for n, v in parts if n == 9 and isinstance(v, int)), -1)
    features = owner.features.with_options(block_of(parts, 8), 21) if owner.editions else owner.features
    type_name, is_map = "", False
    if kind == MESSAGE:
        type_name = _resolve(text_of(parts, 6), scope, types)
        is_map = bool(int_of(list(parts_of(block_of(types[type_name].parts, 7))), 7))
        kind = GROUP if features.encoding == DELIMITED and not is_map else kind
    implicit = not repeated and choice < 0 and features.presence == IMPLICIT and kind < BYTES
    return Field(name, number, kind, repeated, implicit, features.utf8 == VERIFY, is_map, choice, type_name)


def _resolve(name: str, scope: str, types: dict[str, ProtobufType]) -> str:
    """Full name of a type: absolute with a leading dot, else searched from the inside outwards."""
    if name.startswith("."):
        if name[1:] in types:
            return name[1:]
    else:
        while True:
            full = f"{scope}.{name}" if scope else name
            if full in types:
                return full
            if not scope:
                break
            scope = scope.rpartition(".")[0]
    raise DefinitionError(f"its schema does not hold the message type {name!r}")


def _stamp(rows: list[Field], first: list[int], target: list[int]) -> tuple[str, str, str] | None:
    """Find ``header.stamp``, ``stamp`` or ``timestamp`` made of seconds and nanoseconds."""
    for path in ("header.stamp", "header.timestamp", "stamp", "timestamp"):
        kind = 0
        for name in path.split("."):
            inside = range(first[kind], first[kind + 1]) if kind >= 0 else range(0)
            found = [i for i in inside if rows[i].name == name and rows[i].kind == MESSAGE and not rows[i].repeated]
            kind = target[found[0]] if found else -1
        if kind >= 0:
            held = {rows[i].name for i in range(first[kind], first[kind + 1]) if rows[i].kind < BYTES}
            for sec, nsec in (("seconds", "nanos"), ("sec", "nsec"), ("sec", "nanosec")):
                if {sec, nsec} <= held:
                    return path, sec, nsec
    return None
