"""Texts of protobuf messages, message by message, for logs that are to be given as they were recorded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from replay.readers.messages.cdr_layout import MAX_ELEMENTS
from replay.readers.messages.protobuf_schema import MESSAGE, STRING, Schema
from replay.readers.messages.protobuf_types import parts_of
from replay.readers.messages.topic_store import Part

MAX_DEPTH = 32

Names = tuple[str, ...]


def text_parts(
    schema: Schema, data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64]
) -> Iterator[Part]:
    """Yield the texts of payloads, one part for each path.

    Parameters
    ----------
    schema : Schema
        The type of all payloads.
    data : NDArray[np.uint8], shape (b,)
        Bytes that hold all payloads.
    starts, lengths : NDArray[np.int64], shape (n,)
        Place of each payload in `data`; what cannot be decoded has no texts.
    """
    if not any(f.kind == STRING for f in schema.fields):
        return
    found: dict[str, tuple[list[int], list[str]]] = {}
    for row, (start, size) in enumerate(zip(starts.tolist(), lengths.tolist(), strict=True)):
        try:
            pairs = list(_texts(schema, 0, data[start : start + size].tobytes(), "", (), 0))
        except (ValueError, IndexError):
            continue
        for path, text in pairs:
            rows, texts = found.setdefault(path, ([], []))
            rows.append(row)
            texts.append(text)
    for path, (rows, texts) in found.items():
        yield Part(np.array(rows, np.int64), {}, (), {path: texts})


def _texts(
    schema: Schema, kind: int, raw: bytes, path: str, scopes: Sequence[Names], depth: int
) -> Iterator[tuple[str, str]]:
    """Path and text of every text of a message, those left out that name elements of an array beside them."""
    if depth > MAX_DEPTH:
        return
    first, stop = int(schema.tables.first[kind]), int(schema.tables.first[kind + 1])
    place = {schema.fields[i].number: i for i in range(first, stop)}
    held: dict[int, list[bytes]] = {}
    counts: dict[int, int] = {}
    for number, value in parts_of(raw):
        i = place.get(number, -1)
        if i >= 0:
            counts[i] = counts.get(i, 0) + 1
            if isinstance(value, bytes):
                held.setdefault(i, []).append(value)
    keys = {i: _names(held[i]) for i in held if schema.tables.key[i]}
    inner = [*(names for names in keys.values() if names), *scopes]
    for i, values in held.items():
        own = schema.fields[i]
        if own.kind not in (STRING, MESSAGE) or own.is_map or len(values) > MAX_ELEMENTS:
            continue
        if keys.get(i) and any(_is_array(schema, j) and counts[j] in (1, len(values)) for j in counts if j != i):
            continue
        names = next((n for n in inner if len(n) == len(values)), None) if own.repeated else None
        for index, value in enumerate(values if own.repeated else values[-1:]):
            label = f"[{names[index] if names else index}]" if own.repeated else ""
            below = f"{path}.{own.name}{label}" if path else f"{own.name}{label}"
            if own.kind == STRING:
                yield below, value.decode("utf-8", "replace")
            else:
                yield from _texts(schema, int(schema.tables.target[i]), value, below, inner, depth + 1)


def _is_array(schema: Schema, index: int) -> bool:
    """Whether a field is an array of something but text; packed numbers are one value on the wire."""
    return schema.fields[index].repeated and schema.fields[index].kind != STRING


def _names(values: Sequence[bytes]) -> Names:
    names = tuple(v.rstrip(b"\0").decode("utf-8", "replace").strip() for v in values)
    return names if len(names) <= MAX_ELEMENTS and all(names) and len(set(names)) == len(names) else ()
