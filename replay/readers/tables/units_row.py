"""A row of units below the header of a table: ``Zeit;nIst_VR`` and below it ``s;1/min``."""

from __future__ import annotations

import csv
from collections.abc import Sequence

from replay.machine.units import known_unit
from replay.readers.tables.columns import unit_of

_TIMES = frozenset(("s", "sec", "ms", "us", "µs", "ns"))
# Units that no signal has, but other columns beside them.
_OTHERS = frozenset(
    ("-", "°C", "K", "l/min", "kg", "t", "kN", "N", "W", "kW", "Hz", "1/s", "min", "h", "l", "bit", "bool", "°F")
)
_LONGEST = 12


def units_of_row(line: str, separator: str, names: Sequence[str]) -> tuple[str, ...] | None:
    """Names of the columns with the units of a row of units, None where a line is none.

    It is one where no cell is a number, most that are not empty are units, and at least one is a unit of time or of a signal.

    Parameters
    ----------
    line : str
        The first line below the header.
    separator : str
        Between its cells.
    names : Sequence[str]
        The columns.
    """
    try:
        row = next(csv.reader([line], delimiter=separator), [])
    except csv.Error:  # a line that ends within, or holds what no line of a table may
        return None
    cells = [c.strip().strip("[]()").strip() for c in row]
    written = [c for c in cells if c]
    sure = [c for c in written if c != "-" and (c in _TIMES or known_unit(c) is not None)]
    units = len(sure) + sum(c in _OTHERS and c not in sure for c in written)
    if (
        len(cells) != len(names)
        or not sure
        or 2 * units <= len(written)
        or any(_number(c) or len(c) > _LONGEST for c in written)
    ):
        return None
    told = [
        f"{name} [{cell}]" if cell and cell != "-" and unit_of(name) is None else name
        for name, cell in zip(names, cells, strict=True)
    ]
    # a column keeps its name where another one is called so with its unit
    return tuple(name if told.count(new) > 1 else new for name, new in zip(names, told, strict=True))


def _number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return cell != "1"  # the unit of a ratio
