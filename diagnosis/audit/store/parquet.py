"""The store's tables as Parquet files for pandas, DuckDB and others."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from diagnosis.audit.store.store import Store
from replay.atomic_write import atomic_path

_TYPES = {"TEXT": pa.string(), "INTEGER": pa.int64(), "REAL": pa.float64()}
_JOINED = ("result", "attempt", "fault", "component")


def export(store: Store, folder: Path) -> tuple[Path, ...]:
    """Write one Parquet file per table, with the mission's name in front of each row.

    Copies of a mission have rows of their own; results to which no mission points any more are left out.

    Parameters
    ----------
    store : Store
        Opened.
    folder : Path
        Made if absent; files of earlier exports are replaced, each whole.

    Returns
    -------
    tuple[Path, ...]
        ``mission.parquet``, ``file.parquet``, ``repair.parquet``, ``result.parquet``, ``attempt.parquet``, ``fault.parquet``,
        ``component.parquet``.

    Raises
    ------
    OutputError
        Where a file cannot be written or the store not be read.
    """
    written = []
    for table in ("mission", "file", "repair", *_JOINED):
        columns = {
            row["name"]: _TYPES[row["type"]]
            for row in store.database.rows(f"SELECT name, type FROM pragma_table_info('{table}')")
            if (table, row["name"]) != ("result", "id") and row["name"] != "result"
        }
        shown = ", ".join(f"t.{name}" for name in columns)
        query = f"SELECT {shown} FROM {table} t ORDER BY 1"
        if table in _JOINED:
            own = "t.id" if table == "result" else "t.result"
            query = f"SELECT m.name, {shown} FROM mission m JOIN {table} t ON {own} = m.result ORDER BY m.name, t.rowid"
            schema = {"mission": pa.string(), **{_renamed(table, n): t for n, t in columns.items()}}
        else:
            schema = dict(columns)
        rows = store.database.rows(query)
        values = list(zip(*rows, strict=True)) or [()] * len(schema)
        arrays = [pa.array(v, type=t) for v, t in zip(values, schema.values(), strict=True)]
        with atomic_path(folder / f"{table}.parquet") as temporary:
            pq.write_table(pa.table(arrays, names=list(schema)), temporary, compression="zstd")
        written.append(folder / f"{table}.parquet")
    return tuple(written)


def _renamed(table: str, column: str) -> str:
    return "fault" if (table, column) == ("fault", "id") else column
