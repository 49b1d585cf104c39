"""Write a mission as one table: CSV or Parquet, canonical names, SI, stamps in ``time_ns``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from replay.atomic_write import atomic_path
from replay.simulation.options import SimulatedMission


def mission_table(mission: SimulatedMission) -> pa.Table:
    """One row per recorded stamp; cells of slower signals are empty in between, as are those of silent sensors and lost rows."""
    columns = {"time_ns": pa.array(mission.stamps)}
    for name, values in mission.columns.items():
        columns[name] = pa.array(np.where(mission.rows(name), values, np.nan), from_pandas=True)
    for group in mission.slow:
        rows = np.searchsorted(mission.stamps, group.stamps)
        for name, values in group.columns.items():
            column = np.full(mission.stamps.size, np.nan)
            column[rows] = values
            columns[name] = pa.array(column, from_pandas=True)
    return pa.table(columns)


def write_csv(path: Path, mission: SimulatedMission) -> None:
    """Write a mission as comma-separated text.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    with atomic_path(path) as temporary:
        options = pa.csv.WriteOptions(quoting_style="none")
        pa.csv.write_csv(mission_table(mission), temporary, options)


def write_parquet(path: Path, mission: SimulatedMission) -> None:
    """Write a mission as Parquet.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    with atomic_path(path) as temporary:
        pa.parquet.write_table(mission_table(mission), temporary, compression="zstd")
