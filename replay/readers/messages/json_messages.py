"""JSON messages as columns: many are parsed at once, then taken apart field by field rather than message by message.

Fields are found in the data, no schema is needed: messages of one shape cost a few passes over lists; each further shape
costs as much again. Integers stay exact to 64 bits while no fraction stands in the same column, booleans become 0 and
1, null and text give no sample, and numbers written as NaN or Infinity (which are no JSON) are understood, slowly.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, compress
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.readers.messages.cdr import Outcome, Part
from replay.readers.messages.cdr_layout import MAX_ELEMENTS
from replay.readers.messages.fields import is_key_list
from replay.readers.messages.json_parsing import parse_singly, parse_together

MAX_PATHS = 20_000
MAX_DEPTH = 32
_STAMPS = ("header.stamp", "header.timestamp", "stamp", "timestamp")
_PARTS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"), ("seconds", "nanos"))
_BATCH_BYTES = 1 << 17  # what the caches hold as objects
_MANY_SHAPES = 24
_LAST_SECOND = 9_000_000_000
_WORDS = {"NaN": np.nan, "Infinity": np.inf, "-Infinity": -np.inf}

_NUMBERS: set[type] = {int, float, bool}

Columns = dict[str, list[tuple[Sequence[int], NDArray[Any]]]]


def decode(
    data: NDArray[np.uint8],
    starts: NDArray[np.int64],
    lengths: NDArray[np.int64],
    outcome: Outcome,
    *,
    texts: bool = False,
) -> tuple[str | None, list[Part]]:
    """Decode JSON payloads.

    Parameters
    ----------
    data : NDArray[np.uint8], shape (b,)
        Bytes that hold all payloads.
    starts, lengths : NDArray[np.int64], shape (n,)
        Place of each payload in `data`.
    outcome : Outcome
        Counts of undecodable and slowly decoded messages, added to.
    texts : bool
        Whether texts are wanted too.

    Returns
    -------
    tuple[str or None, list[Part]]
        Path of the stamp, and the columns.
    """
    stamp, parts = None, []
    lengths = np.where((starts >= 0) & (starts + lengths <= len(data)), lengths, 0)
    ends = np.cumsum(lengths)
    first = 0
    while first < len(starts):
        before = int(ends[first - 1]) if first else 0
        stop = max(int(np.searchsorted(ends, before + _BATCH_BYTES)), first + 1)
        found, own = _batch(data, starts[first:stop], lengths[first:stop], first, outcome, texts)
        stamp = found or stamp
        parts += own
        first = stop
    return stamp, parts


def _batch(
    data: NDArray[np.uint8],
    starts: NDArray[np.int64],
    lengths: NDArray[np.int64],
    first: int,
    outcome: Outcome,
    texts: bool,
) -> tuple[str | None, list[Part]]:
    values = parse_together(data, starts, lengths)
    rows: Sequence[int] = range(first, first + len(starts))
    if values is None:
        kept = list(parse_singly(data, starts, lengths, outcome))
        rows, values = [first + i for i, _ in kept], [v for _, v in kept]
    taker = _Taker(texts)
    taker.take("", rows, values, [], 0)
    if taker.full:
        outcome.bad += len(values)
        outcome.reason = outcome.reason or f"its messages have more than {MAX_PATHS} different fields"
        return None, []
    stamp = _take_stamp(taker.columns, rows)
    outcome.slow += taker.slow
    words = [Part(np.array(own, np.int64), {}, (), {path: some}) for path, own, some in taker.texts]
    return stamp, [Part(np.empty(0, np.int64), {}, tuple(taker.skipped)), *_parts(taker.columns), *words]


class _Taker:
    """Takes lists of values of one path apart, down to numbers."""

    def __init__(self, with_texts: bool = False) -> None:
        self.columns: Columns = {}
        self.with_texts = with_texts
        self.texts: list[tuple[str, Sequence[int], list[str]]] = []
        self.skipped: set[str] = set()
        self.slow = 0
        self.full = False

    def take(self, path: str, rows: Sequence[int], values: Sequence[Any], scopes: list[Any], depth: int) -> None:
        """Take the values of one path in some rows, of which those of one kind are taken together.

        Parameters
        ----------
        path : str
            Path of the values.
        rows : Sequence[int], shape (m,)
            Their row numbers, increasing.
        values : Sequence, shape (m,)
            Parsed values.
        scopes : list
            Arrays of names in the messages around, innermost first.
        depth : int
            Nesting so far.
        """
        kinds = set(map(type, values))
        if self.with_texts and str in kinds and depth <= MAX_DEPTH and not self.full:
            pick = [type(v) is str and not (float in kinds and v in _WORDS) for v in values]
            some = [_clean(v) for v in compress(values, pick)]
            self.texts += [(path or "value", list(compress(rows, pick)), some)] if some else []
        if depth > MAX_DEPTH or self.full or kinds <= {str, type(None)}:
            return
        if kinds <= _NUMBERS:
            self._add(path or "value", rows, _column(values, kinds))
        elif kinds == {dict}:
            self._objects(path, rows, values, scopes, depth)
        elif kinds == {list}:
            self._lists(path, rows, values, scopes, depth)
        else:
            self._take_mixed(path, rows, values, kinds, scopes, depth)

    def _take_mixed(
        self, path: str, rows: Sequence[int], values: Sequence[Any], kinds: set[type], scopes: list[Any], depth: int
    ) -> None:
        """Take apart what is of several kinds; text among numbers counts where it is NaN or Infinity."""
        for group in (_NUMBERS, {dict}, {list}):
            if not kinds.isdisjoint(group):
                pick = [type(v) in group for v in values]
                some = list(compress(values, pick))
                self.take(path, list(compress(rows, pick)), some, scopes, depth)
        if str in kinds and float in kinds:
            pick = [type(v) is str and v in _WORDS for v in values]
            if any(pick):
                some = [_WORDS[v] for v in compress(values, pick)]
                self.take(path, list(compress(rows, pick)), some, scopes, depth)

    def _objects(self, path: str, rows: Sequence[int], values: Sequence[Any], scopes: list[Any], depth: int) -> None:
        shapes = set(map(tuple, values))
        if len(shapes) == 1:
            keys = shapes.pop()
            for names, some_rows, some in _by_names(keys, rows, values):
                for key in keys:
                    below = f"{path}.{_clean(key)}" if path else _clean(key)
                    self.take(below, some_rows, list(map(itemgetter(key), some)), [*names, *scopes], depth + 1)
            return
        by_shape: dict[tuple[str, ...], tuple[list[int], list[Any]]] = {}
        for row, value in zip(rows, values, strict=True):
            own_rows, own = by_shape.setdefault(tuple(value), ([], []))
            own_rows.append(row)
            own.append(value)
        if len(by_shape) > _MANY_SHAPES:
            self.slow = max(self.slow, len(values))
        for own_rows, own in by_shape.values():
            self._objects(path, own_rows, own, scopes, depth)
            if self.full:
                return

    def _lists(self, path: str, rows: Sequence[int], values: Sequence[Any], scopes: list[Any], depth: int) -> None:
        sizes = set(map(len, values))
        if max(sizes) > MAX_ELEMENTS:
            self.skipped.add(path)
        for size in sizes:
            if not 0 < size <= MAX_ELEMENTS:
                continue
            pick = [len(v) == size for v in values] if len(sizes) > 1 else None
            own_rows = rows if pick is None else list(compress(rows, pick))
            own = values if pick is None else list(compress(values, pick))
            names = next((n for n in scopes if len(n) == size), None)
            if names is not None and tuple(own[0]) == names:
                continue  # the names themselves, which stand in the paths beside them
            labels = [f"{path}[{_clean(n)}]" for n in (range(size) if names is None else names)]
            kinds = set(map(type, chain.from_iterable(own)))
            if len(kinds) == 1 and kinds <= _NUMBERS:  # one conversion for all elements
                table = _column(list(chain.from_iterable(own)), kinds).reshape(-1, size)
                for i, label in enumerate(labels):
                    self._add(label, own_rows, table[:, i].copy())
            else:
                for label, column in zip(labels, zip(*own, strict=True), strict=True):
                    self.take(label, own_rows, column, scopes, depth + 1)

    def _add(self, path: str, rows: Sequence[int], column: NDArray[Any]) -> None:
        known = self.columns.get(path)
        if known is not None:
            known.append((rows, column))
        elif len(self.columns) < MAX_PATHS:
            self.columns[path] = [(rows, column)]
        else:
            self.full = True


def _by_names(
    keys: tuple[str, ...], rows: Sequence[int], values: Sequence[Any]
) -> Iterator[tuple[list[tuple[str, ...]], Sequence[int], Sequence[Any]]]:
    """Yield groups of objects whose arrays of names agree, with these names."""
    lists = [k for k in keys if is_key_list(k)]
    first = [values[0][k] for k in lists]
    if all(list(map(itemgetter(k), values)).count(v) == len(values) for k, v in zip(lists, first, strict=True)):
        yield _distinct(map(_names, first)), rows, values
        return
    groups: dict[tuple[tuple[str, ...], ...], tuple[list[int], list[Any]]] = {}
    for row, value in zip(rows, values, strict=True):
        own_rows, own = groups.setdefault(tuple(_names(value[k]) for k in lists), ([], []))
        own_rows.append(row)
        own.append(value)
    for names, (own_rows, own) in groups.items():
        yield _distinct(names), own_rows, own


def _distinct(names: Iterable[tuple[str, ...]]) -> list[tuple[str, ...]]:
    return [n for n in names if n and len(set(n)) == len(n) and all(n)]


def _names(value: Any) -> tuple[str, ...]:
    if type(value) is list and len(value) <= MAX_ELEMENTS and all(type(v) is str for v in value):
        return tuple(v.strip() for v in value)
    return ()


def _clean(key: object) -> str:
    """Text without halves of characters, which JSON can escape but nothing can store."""
    return str(key).encode("utf-8", "replace").decode()


def _column(values: Sequence[Any], kinds: set[type]) -> NDArray[Any]:
    if float in kinds:
        try:
            return np.array(values, np.float64)
        except OverflowError:  # an integer beyond all floats
            return np.array([_as_float(v) for v in values])
    try:
        return np.array(values, np.int64)
    except OverflowError:
        if min(values) >= 0 and max(values) < 2**64:
            return np.array(values, np.uint64)
        return np.array([_as_float(v) for v in values])


def _as_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf


def _take_stamp(columns: Columns, rows: Sequence[int]) -> str | None:
    """Give the stamp its common names, in all rows: 0 where it is absent, no pair of integers, or out of range."""
    for path in _STAMPS:
        for leaves in _PARTS:
            if all(f"{path}.{leaf}" in columns for leaf in leaves):
                both = [_spread(columns.pop(f"{path}.{leaf}"), rows) for leaf in leaves]
                far = (both[0] > _LAST_SECOND) | (both[0] < -_LAST_SECOND)
                for values, name in zip(both, ("sec", "nanosec"), strict=True):
                    values[far] = 0
                    columns[f"{path}.{name}"] = [(rows, values)]
                return path
    return None


def _spread(parts: Iterable[tuple[Sequence[int], NDArray[Any]]], rows: Sequence[int]) -> NDArray[np.int64]:
    out = np.zeros(len(rows), np.int64)
    place = np.asarray(rows)
    for own, values in parts:
        if values.dtype.kind == "f":
            values = np.where(np.isfinite(values) & (np.abs(values) < 2.0**62), values, 0)
        out[np.searchsorted(place, np.asarray(own))] = values.astype(np.int64)
    return out


def _parts(columns: Columns) -> Iterator[Part]:
    """Columns that stand in the same rows together, the others one by one."""
    shared: dict[int, tuple[Sequence[int], dict[str, NDArray[Any]]]] = {}
    for path, parts in columns.items():
        for i, (rows, values) in enumerate(parts):
            group = shared.setdefault(id(rows), (rows, {}))[1] if not i else None
            if group is None:
                yield Part(np.array(rows, np.int64), {path: values}, ())
            else:
                group[path] = values
    for rows, group in shared.values():
        yield Part(np.array(rows, np.int64), group, ())
