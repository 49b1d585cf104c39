"""What a store says of each component and side in each mission, in columns: a large fleet has more than a million such rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.audit.store.database import Database
from diagnosis.results.assessed import LEAST_SHARE
from replay.faults import Side

LARGEST, LONGEST = 1e6, 1e15  # of a loss ε, and of seconds and metres: more is damage
_ROWS = 1 << 14  # that are taken from the store at once
_MOST = (LONGEST, LONGEST, LARGEST, LARGEST, LARGEST)
_PARTS = (
    "SELECT result, component, side, driving_s, decided_s, epsilon, epsilon_low, epsilon_high, epsilon_relative FROM component "
    "ORDER BY rowid"
)

#: Component and side.
PartKey = tuple[str, str]


class PartTable(NamedTuple):
    """Parts of all results of a store, those of one result together.

    Attributes
    ----------
    keys : tuple[PartKey, ...]
        Every component and side that occurs.
    key : NDArray[np.intp], shape (n,)
        Place in `keys`.
    driving_s, decided_s : NDArray[np.float64], shape (n,)
        Driving time, and how much of it was judged [s].
    value, low, high : NDArray[np.float64], shape (n,)
        ε̂ with 95 % bounds [1]; NaN where there is no estimate.
    relative : NDArray[np.bool_], shape (n,)
        Whether ε̂ is one against the other wheels.
    """

    keys: tuple[PartKey, ...]
    key: NDArray[np.intp]
    driving_s: NDArray[np.float64]
    decided_s: NDArray[np.float64]
    value: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    relative: NDArray[np.bool_]

    def assessed(self, rows: NDArray[np.intp], least_s: float) -> NDArray[np.bool_]:
        """Which of some rows were judged for `least_s` seconds and four fifths of their driving; no row (−1) was not.

        Both of shape (m,).
        """
        decided = self.decided_s[rows]
        enough = decided >= np.maximum(least_s, LEAST_SHARE * self.driving_s[rows])
        return np.asarray((rows >= 0) & (decided > 0) & enough)


class Parts(NamedTuple):
    """Parts of one result: rows of the table of its store, from the first to before the last."""

    table: PartTable
    start: int
    stop: int

    def rows(self) -> dict[PartKey, int]:
        """Row of each part by component and side."""
        return {self.table.keys[k]: self.start + n for n, k in enumerate(self.table.key[self.start : self.stop])}


_NO = np.empty(0)
_NONE = PartTable((), np.empty(0, np.intp), _NO, _NO, _NO, _NO, _NO, np.empty(0, np.bool_))
NO_PARTS = Parts(_NONE, 0, 0)


def columns_of(parts: Sequence[Parts]) -> tuple[PartTable, dict[PartKey, NDArray[np.intp]]]:
    """Their table, and the row of each component and side in each of several results of one store; −1 where it has none.

    Parts are in the order in which they come first; each column has the shape (n,) of n results.
    """
    table = next((p.table for p in parts if p.stop > p.start), _NONE)
    counts = np.array([p.stop - p.start for p in parts], np.intp)
    result = np.repeat(np.arange(len(parts)), counts)
    row = np.arange(len(result)) + np.repeat(
        np.array([p.start for p in parts], np.intp) - np.cumsum(counts) + counts, counts
    )
    at = np.full((len(table.keys), len(parts)), -1, np.intp)
    key = table.key[row]
    at[key, result] = row
    found, first = np.unique(key, return_index=True)
    return table, {table.keys[k]: at[k] for k in found[np.argsort(first)].tolist()}


def read_parts(db: Database) -> dict[int, Parts]:
    """Parts of each result of a store, by the result's id; within `Database.decoding`.

    Raises
    ------
    ValueError, TypeError
        Where a value is none that an audit writes, or none that sums and squares may be made of.
    OutputError
        Where the store cannot be read.
    """
    codes: dict[PartKey, int] = {}
    results, keys, relative = list[NDArray[np.int64]](), list[NDArray[np.intp]](), list[NDArray[np.bool_]]()
    numbers: list[list[NDArray[np.float64]]] = [[] for _ in _MOST]
    for rows in db.blocks(_PARTS, _ROWS):
        result, component, side, *values, unlike = zip(*rows, strict=True)
        pairs = list(zip(component, side, strict=True))
        for pair in dict.fromkeys(pairs):
            codes.setdefault((str(pair[0]), Side(pair[1])), len(codes))
        results.append(np.array(result, np.int64))
        keys.append(np.fromiter(map(codes.__getitem__, pairs), np.intp, len(pairs)))
        relative.append(np.array(unlike, np.int64) != 0)
        for column, found, most in zip(numbers, values, _MOST, strict=True):
            column.append(_numbers(found, most))
    if not results:
        return {}
    of = np.concatenate(results)
    driving, decided, value, low, high = map(np.concatenate, numbers)
    if np.isnan(driving).any() or np.isnan(decided).any():
        raise ValueError("no number of seconds in a row of parts")
    unknown = np.isnan(value) | np.isnan(low) | np.isnan(high)
    value[unknown] = low[unknown] = high[unknown] = np.nan
    columns: list[Any] = [np.concatenate(keys), driving, decided, value, low, high, np.concatenate(relative)]
    if (of[1:] < of[:-1]).any():
        order = np.argsort(of, kind="stable")
        of, columns = of[order], [column[order] for column in columns]
    table = PartTable(tuple(codes), *columns)
    starts = np.flatnonzero(np.concatenate(([True], of[1:] != of[:-1])))
    ends = [*starts[1:].tolist(), len(of)]
    return {r: Parts(table, a, b) for r, a, b in zip(of[starts].tolist(), starts.tolist(), ends, strict=True)}


def _numbers(values: Iterable[Any], most: float) -> NDArray[np.float64]:
    """A column of numbers, NaN where it has none."""
    if not set(map(type, values)) <= {float, int, type(None)}:
        raise TypeError("a text among the numbers of parts")
    out = np.array(values, np.float64)
    if (np.abs(out) > most).any():
        raise ValueError(f"a value of {np.nanmax(np.abs(out)):g} in a row of parts")
    return out
