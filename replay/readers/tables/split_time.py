"""One clock in two columns: whole seconds, and the nanoseconds or microseconds within the second.

Exports of ROS messages write header stamps so: ``header.stamp.secs`` and ``header.stamp.nsecs``, ``sec`` and ``nanosec``, ``s``
and ``ns``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.readers.tables.row_kernel import MISSING

_SECONDS = re.compile(r"^(?P<lead>(?:.*[ _./])?(?:tv_)?)(?:s|sec|secs|second|seconds)$")
_PARTS = re.compile(
    r"^(?P<lead>(?:.*[ _./])?(?:tv_)?)(?:(?P<ns>ns|nsecs?|nanos|nanosecs?|nanoseconds?)|us|usecs?|microsecs?|microseconds?)$"
)
_SECOND = 1_000_000_000


class Part(NamedTuple):
    """The column with what comes to the whole seconds.

    Attributes
    ----------
    name : str
        Column.
    unit_ns : int
        What one of it is [ns].
    """

    name: str
    unit_ns: int

    @property
    def unit(self) -> str:
        """Its unit."""
        return "ns" if self.unit_ns == 1 else "us"


def split_times(sample: Mapping[str, NDArray[Any]]) -> Iterator[tuple[str, Part]]:
    """Yield columns of whole seconds with the column of their parts, by names and contents.

    Samples of shape (rows,) each.

    Parameters
    ----------
    sample : Mapping[str, NDArray]
        First rows of each column.
    """
    found = {name: _PARTS.match(name.strip().lower()) for name in sample}
    parts = {m["lead"]: Part(n, 1 if m["ns"] else 1000) for n, m in found.items() if m is not None}
    for name, cells in sample.items():
        match = _SECONDS.match(name.strip().lower())
        part = None if match is None else parts.get(match["lead"])
        if part is not None and _whole(cells) and _within(sample[part.name], part.unit_ns):
            yield name, part


def _numbers(cells: NDArray[Any]) -> NDArray[np.float64]:
    if cells.dtype.kind not in "iuf":
        return np.empty(0)
    values = cells[cells != MISSING] if cells.dtype.kind == "i" else cells
    values = values.astype(np.float64)
    return np.asarray(values[np.isfinite(values)])


def _whole(cells: NDArray[Any]) -> bool:
    values = _numbers(cells)
    return bool(values.size and (values == np.floor(values)).all())


def _within(cells: NDArray[Any], unit_ns: int) -> bool:
    values = _numbers(cells)
    return bool(values.size and (values >= 0).all() and (values * unit_ns < _SECOND).all() and values.any())


def with_part(stamps: NDArray[np.int64], cells: NDArray[Any], unit_ns: int) -> NDArray[np.int64]:
    """Stamps of whole seconds with what comes to them.

    Parameters
    ----------
    stamps : NDArray[np.int64], shape (m,)
        Whole seconds [ns]; `row_kernel.MISSING` where there is none.
    cells : NDArray, shape (m,)
        Parts of the second: integers (`MISSING` where empty) or doubles (NaN where empty).
    unit_ns : int
        What one of them is [ns].

    Returns
    -------
    NDArray[np.int64], shape (m,)
        Stamps [ns]; `MISSING` where a half is missing or no part of a second.
    """
    given = (cells >= 0) & (cells < _SECOND // unit_ns)  # before they become whole numbers, which know no larger ones
    parts = np.rint(np.where(given, cells, 0) * unit_ns).astype(np.int64)
    good = given & (stamps != MISSING) & (parts < _SECOND)
    return np.where(good, stamps + parts, MISSING)
