"""Parsing of JSON payloads: many at once where all are JSON, else one by one."""

from __future__ import annotations

import json
import secrets
from collections.abc import Iterator
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.arrays.copying import put
from replay.readers.common.compiled import plain
from replay.readers.messages.cdr import Outcome


@njit(cache=True)
def _join(data, starts, lengths, between, out):  # type: ignore[no-untyped-def]
    """Write ``[payload between payload between … payload]``."""
    out[0] = 91
    at = 1
    for i in range(len(starts)):
        if i:
            put(out[at:], between)
            at += len(between)
        put(out[at:], data[starts[i] : starts[i] + lengths[i]])
        at += lengths[i]
    out[at] = 93


def parse_together(data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64]) -> list[Any] | None:
    """Values of all payloads, or None where one of them is not JSON value of its own.

    A word that no payload can know stands between them, so that two broken ones cannot make up a valid whole.

    `data` of shape (bytes,), `starts` and `lengths` of shape (payloads,).
    """
    word = secrets.token_hex(8)
    between = np.frombuffer(f',"{word}",'.encode(), np.uint8)
    out = np.empty(int(lengths.sum()) + len(between) * (len(starts) - 1) + 2, np.uint8)
    _join(plain(data), starts, lengths, between, out)
    try:
        together = orjson.loads(out.data)
    except orjson.JSONDecodeError:
        return None
    own = len(together) == 2 * len(starts) - 1 and together[1::2].count(word) == len(starts) - 1
    return together[::2] if own else None


def parse_singly(
    data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64], outcome: Outcome
) -> Iterator[tuple[int, Any]]:
    """Yield number and value of each payload that is JSON, or JSON with NaN and Infinity.

    `data` of shape (bytes,), `starts` and `lengths` of shape (payloads,).
    """
    for i, (start, size) in enumerate(zip(starts.tolist(), lengths.tolist(), strict=True)):
        raw = data[start : start + size].tobytes()
        try:
            yield i, orjson.loads(raw)
        except orjson.JSONDecodeError as error:
            if b"NaN" in raw or b"Infinity" in raw:
                try:
                    value = json.loads(raw)
                except (ValueError, RecursionError):
                    pass
                else:
                    outcome.slow += 1
                    yield i, value
                    continue
            outcome.bad += 1
            outcome.reason = outcome.reason or f"not JSON ({error.msg})"
