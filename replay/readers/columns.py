"""Cells of a table as numbers and stamps."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from replay.errors import LogError
from replay.readers.clocks import Report
from replay.sources import SourceOptions

FILETIME_EPOCH = 116_444_736_000_000_000
_NANOSECONDS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
_TRUTH = {"true": 1, "false": 0, "yes": 1, "no": 0, "on": 1, "off": 0}
_EMPTY = ["", " ", "n. def.", "NaN", "nan", "NA", "N/A", "#N/A", "null", "NULL", "None", "-1.#IND", "1.#QNAN"]
_MIN_NUMERIC = 0.5
# pandas before 3 rounds the last digit unless told otherwise; pandas 3 never does
_PRECISION: dict[str, Any] = {"float_precision": "round_trip"} if int(pd.__version__.split(".")[0]) < 3 else {}


def parse(
    text: str, separator: str, decimal: str, names: list[str], exact: Collection[str], quoted: bool
) -> pd.DataFrame:
    """Parse the data rows of a text table.

    Parameters
    ----------
    text : str
        Data rows without header.
    separator, decimal : str
        As found in the file.
    names : list[str]
        Unique column names; shorter rows end in empty cells.
    exact : set[str]
        Columns kept as text, so that long integers stay exact.
    quoted : bool
        Whether double quotes enclose cells.
    """
    table: pd.DataFrame = pd.read_csv(
        io.StringIO(text),
        sep=separator,
        decimal=decimal,
        header=None,
        names=names,
        index_col=False,
        dtype=dict.fromkeys(exact, str),
        na_values=_EMPTY,
        keep_default_na=False,
        skipinitialspace=separator != " ",
        skip_blank_lines=True,
        quoting=csv.QUOTE_MINIMAL if quoted else csv.QUOTE_NONE,
        low_memory=False,
        **_PRECISION,
    )
    return table


def numbers(column: pd.Series[Any], decimal: str = ".") -> tuple[NDArray[Any] | None, int]:
    """Return a column's numbers and how many cells were no numbers; None where it is a text column."""
    if column.dtype.kind in "iufb":
        values = column.to_numpy()
        return (values.astype(np.uint8) if column.dtype.kind == "b" else values), 0
    cells = column.dropna().astype(str).str.strip()
    cells = cells[cells != ""]
    if not len(cells):
        return np.full(len(column), np.nan), 0
    truth = cells.str.lower().map(_TRUTH)
    plain = cells.str.replace(decimal, ".", regex=False) if decimal != "." else cells
    found = pd.to_numeric(plain, errors="coerce").astype(np.float64).fillna(truth.astype(np.float64))
    bad = int(found.isna().sum())
    if bad > _MIN_NUMERIC * len(cells):
        return None, bad
    values = np.full(len(column), np.nan)
    values[column.index.get_indexer(cells.index)] = found.to_numpy()
    return values, bad


def epoch_ns(options: SourceOptions, source: str) -> int:
    """Zero of the time column [ns since 1970].

    Raises
    ------
    LogError
        Where the epoch is not an ISO date and time.
    """
    if options.epoch is None:
        return 0
    try:
        moment = datetime.fromisoformat(options.epoch)
    except ValueError as error:
        raise LogError(
            f"{source}: epoch = {options.epoch!r} is no ISO date and time; write it like 2000-01-01T00:00:00Z"
        ) from error
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    since = moment - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * 1_000_000_000 + since.microseconds * 1_000


def stamps(
    column: pd.Series[Any], unit: str, epoch: int, decimal: str, label: str, report: Report
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Stamps of a time column.

    Parameters
    ----------
    column : pd.Series, shape (n,)
        Cells as parsed.
    unit : str
        As in `SourceOptions.time_unit`.
    epoch : int
        Zero of the column [ns since 1970].
    decimal : str
        Decimal sign of cells that are still text.
    label : str
        The column, for messages.
    report : Report
        Takes the count of rows without a time.

    Returns
    -------
    tuple[NDArray[np.int64], NDArray[np.bool_]]
        Stamps [ns] of the rows that have one, and which rows these are.
    """
    if unit == "iso" or column.dtype.kind == "M":
        moments = pd.to_datetime(
            column, errors="coerce", utc=True, format=None if column.dtype.kind == "M" else "ISO8601"
        )
        keep = moments.notna().to_numpy()
        ns = moments[keep].dt.tz_localize(None).to_numpy().astype("datetime64[ns]").astype(np.int64) + epoch
    elif unit in ("filetime", "ns") or column.dtype.kind in "iu":
        whole = column if column.dtype.kind in "iu" else _integers(column)
        keep = whole.notna().to_numpy()
        ticks = whole[keep].to_numpy().astype(np.int64)
        ns = (ticks - FILETIME_EPOCH) * 100 if unit == "filetime" else ticks * _NANOSECONDS[unit] + epoch
    else:
        values, _ = numbers(column, decimal)
        seconds = np.full(len(column), np.nan) if values is None else values.astype(np.float64)
        keep = np.isfinite(seconds) & (np.abs(seconds) * _NANOSECONDS[unit] < 2.0**62)
        base = np.floor(seconds[keep])
        ns = base.astype(np.int64) * _NANOSECONDS[unit] + epoch
        ns = ns + np.rint((seconds[keep] - base) * _NANOSECONDS[unit]).astype(np.int64)
    if not keep.all():
        report.lost(f"{label}: {(~keep).sum()} of {len(keep)} rows have no readable time and were left out")
    return ns, keep


def _integers(column: pd.Series[Any]) -> pd.Series[Any]:
    """Cells as integers, text ones exactly; others are missing."""
    if column.dtype.kind == "f":
        return column.where(column.abs() < 2.0**62).round().astype("Int64")
    cells = column.astype("string").str.strip()
    fits = cells.str.fullmatch(r"[+-]?(?:\d{1,18}|[1-8]\d{18})").fillna(False)
    return cells.where(fits).astype("Int64")


def unit_of(header: str) -> str | None:
    """Return the unit in a header like ``speed [rpm]`` or ``speed (rpm)``."""
    found = re.search(r"[\[(]([^\[\]()]{1,12})[\])]\s*$", header)
    if found is None:
        return None
    unit = found.group(1).strip()
    return None if not unit or unit.isdigit() else unit
