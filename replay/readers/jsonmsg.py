"""JSON messages: parsed one by one (stated slow path), flattened like serialised ones."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from replay.readers.cdr import Outcome, Part
from replay.readers.layout import MAX_ELEMENTS

_STAMPS = ("header.stamp", "stamp", "timestamp")
_MAX_DEPTH = 32


def flatten(value: Any, path: str = "", depth: int = 0) -> Iterator[tuple[str, int | float]]:
    """Yield every number of a JSON value with its path; booleans become 0 and 1."""
    if isinstance(value, bool | int | float):
        yield path, int(value) if isinstance(value, bool) else value
    elif depth < _MAX_DEPTH and isinstance(value, dict):
        names = next((v for k, v in value.items() if k in ("name", "names", "joint_names", "varNames")), None)
        for key, item in value.items():
            below = f"{path}.{key}" if path else key
            if isinstance(item, list) and isinstance(names, list) and _keys(names, item):
                for name, entry in zip(names, item, strict=True):
                    yield from flatten(entry, f"{below}[{name}]", depth + 1)
            else:
                yield from flatten(item, below, depth + 1)
    elif depth < _MAX_DEPTH and isinstance(value, list) and len(value) <= MAX_ELEMENTS:
        for i, item in enumerate(value):
            yield from flatten(item, f"{path}[{i}]", depth + 1)


def _keys(names: list[Any], item: list[Any]) -> bool:
    return len(names) == len(item) and all(isinstance(n, str) and n for n in names) and len(set(names)) == len(names)


def decode(
    data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64], outcome: Outcome
) -> tuple[str | None, list[Part]]:
    """Decode JSON payloads.

    Returns
    -------
    tuple[str or None, list[Part]]
        Path of the stamp, and one part per field.
    """
    found: dict[str, tuple[list[int], list[int | float]]] = {}
    for row, (start, size) in enumerate(zip(starts.tolist(), lengths.tolist(), strict=True)):
        try:
            value = orjson.loads(data[start : start + size].tobytes())
        except orjson.JSONDecodeError as error:
            outcome.bad += 1
            outcome.reason = outcome.reason or f"not JSON ({error.msg})"
            continue
        for path, number in flatten(value):
            rows, values = found.setdefault(path, ([], []))
            rows.append(row)
            values.append(number)
    stamp = next((s for s in _STAMPS if f"{s}.sec" in found), None)
    if stamp is not None:
        short = found.pop(f"{stamp}.nsec", None)
        if short is not None:
            found.setdefault(f"{stamp}.nanosec", short)
    return stamp, [Part(np.array(r, np.int64), {p: _column(v)}, ()) for p, (r, v) in found.items()]


def _column(values: list[int | float]) -> NDArray[Any]:
    if all(isinstance(v, int) for v in values):
        low, high = min(values), max(values)
        if low >= -(2**63) and high < 2**63:
            return np.array(values, np.int64)
        if low >= 0 and high < 2**64:
            return np.array(values, np.uint64)
    return np.array(values, np.float64)
