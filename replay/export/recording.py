"""Write mapped signals in any format: canonical names, SI, every signal at its own stamps.

Message logs hold JointState topics ``/mfhca/signals_<n>``, one per set of stamps, whose joint names are the signals'
and whose positions are their values; tables hold one column per signal; a TwinCAT export one group per set of stamps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from replay.atomic_write import atomic_path
from replay.errors import ConfigError, OutputError
from replay.export.formats.mcap import write_mcap
from replay.export.formats.message_layout import Dialect, Layout, TopicBatch
from replay.export.formats.rosbag1 import write_ros1_bag
from replay.export.formats.rosbag2 import write_rosbag2
from replay.export.formats.twincat import ScopeGroup, write_scope
from replay.log.open_loop import COLUMN, TOPIC
from replay.machine.signal_table import signal_of
from replay.signals.channel_data import sparse_rows
from replay.signals.signal import Signals

RECORDING_FORMATS = ("mcap", "bag", "rosbag2", "twincat", "csv", "parquet")
_LAST_ROS_NS = 2**32 * 1_000_000_000
_FIRST_SCOPE_NS = -116_444_736_000_000_000 * 100 + 86_400_000_000_000


@dataclass(frozen=True)
class _Group:
    """Signals that share their stamps."""

    stamps: NDArray[np.int64]
    columns: Mapping[str, NDArray[np.float64]]


def write_recording(signals: Signals, path: Path, format: str) -> None:  # noqa: A002
    """Write signals as a log that `replay.mission.load_mission` reads back with the same stamps and values.

    Parameters
    ----------
    signals : Signals
        What to write; where `open_loop` is set the log carries the mark.
    path : Path
        File, or folder for ``rosbag2``; an existing one is replaced.
    format : str
        One of `RECORDING_FORMATS`.

    Raises
    ------
    ConfigError
        Where the format is not known, or a table cannot hold signals of such different stamps.
    OutputError
        Where the place cannot be written, or the format cannot hold the stamps.
    """
    if format not in RECORDING_FORMATS:
        raise ConfigError(f"format = {format!r} is not known; expected one of {', '.join(RECORDING_FORMATS)}")
    groups = _groups(signals)
    if not groups:
        raise ConfigError(f"{path}: there is no signal to write")
    if format == "twincat":
        _write_twincat(path, groups, signals.open_loop)
    elif format in ("csv", "parquet"):
        _write_table(path, _table(path, groups, signals.open_loop), format)
    else:
        first, last = min(g.stamps[0] for g in groups), max(g.stamps[-1] for g in groups)
        if first < 0 or last >= _LAST_ROS_NS:
            raise OutputError(
                f"{path}: ROS stamps hold 1970 to 2106, the log starts at {np.datetime64(int(first), 'ns')}; choose "
                "--format parquet or csv"
            )
        batches = _batches(groups, "ros1" if format == "bag" else "cdr", signals.open_loop)
        if format == "rosbag2":
            write_rosbag2(path, batches)
        else:
            (write_ros1_bag if format == "bag" else write_mcap)(path, batches)


def _groups(signals: Signals) -> list[_Group]:
    """Signals by their stamps, the longest first."""
    found: dict[bytes, tuple[NDArray[np.int64], dict[str, NDArray[np.float64]]]] = {}
    for name, signal in signals.items.items():
        if signal.stamps.size:
            found.setdefault(signal.stamps.tobytes(), (signal.stamps, {}))[1][name] = signal.values
    return sorted((_Group(*g) for g in found.values()), key=lambda g: -g.stamps.size)


def _batches(groups: list[_Group], dialect: Dialect, open_loop: bool) -> list[TopicBatch]:
    batches = [_joint_states(f"/mfhca/signals_{i}", group, dialect) for i, group in enumerate(groups, 1)]
    if open_loop:
        first = min((g.stamps[:1] for g in groups), key=lambda s: int(s[0]))
        layout = Layout(dialect)
        layout.varying("data", "u1")
        batches.append(TopicBatch(TOPIC, "std_msgs/msg/Bool", layout, {"data": np.ones(1, np.uint8)}, first))
    return batches


def _joint_states(topic: str, group: _Group, dialect: Dialect) -> TopicBatch:
    layout = Layout(dialect)
    fields: dict[str, NDArray[np.generic]] = {}
    if dialect == "ros1":
        layout.varying("seq", "u4")
        fields["seq"] = np.arange(group.stamps.size, dtype=np.uint32)
    layout.varying("sec", "u4")
    layout.varying("nanosec", "u4")
    layout.text("")
    layout.constant("I", len(group.columns))
    for name in group.columns:
        layout.text(name)
    layout.doubles("position", len(group.columns))
    layout.doubles(None)
    layout.doubles(None)
    fields["sec"] = (group.stamps // 1_000_000_000).astype(np.uint32)
    fields["nanosec"] = (group.stamps % 1_000_000_000).astype(np.uint32)
    fields["position"] = np.column_stack(list(group.columns.values()))
    return TopicBatch(topic, "sensor_msgs/msg/JointState", layout, fields, group.stamps)


def _table(path: Path, groups: list[_Group], open_loop: bool) -> pa.Table:
    """One row per stamp of the fastest signals; cells of slower ones are empty in between.

    Raises
    ------
    ConfigError
        Where signals would not be found again at their own stamps.
    """
    stamps = np.unique(np.concatenate([g.stamps for g in groups]))
    columns = {"time_ns": pa.array(stamps)}
    for group in groups:
        rows = np.searchsorted(stamps, group.stamps)
        for name, values in group.columns.items():
            column = np.full(stamps.size, np.nan)
            column[rows] = values
            gaps = np.count_nonzero(np.diff(rows) > 1)  # few and long where a sensor was silent
            if gaps > 0.01 * rows.size and not np.array_equal(sparse_rows(column), np.flatnonzero(~np.isnan(column))):
                raise ConfigError(
                    f"{path}: {name} is recorded at other times than the fastest signals, which a table with one time "
                    "column cannot hold; choose --format mcap or twincat"
                )
            columns[name] = pa.array(column, from_pandas=True)
    if open_loop:
        columns[COLUMN] = pa.array(np.ones(stamps.size, np.int8))
    return pa.table(columns)


def _write_table(path: Path, table: pa.Table, format: str) -> None:  # noqa: A002
    with atomic_path(path) as temporary:
        if format == "csv":
            pa.csv.write_csv(table, temporary, pa.csv.WriteOptions(quoting_style="none"))
        else:
            pa.parquet.write_table(table, temporary, compression="zstd")


def _write_twincat(path: Path, groups: list[_Group], open_loop: bool) -> None:
    if min(int(g.stamps[0]) for g in groups) < _FIRST_SCOPE_NS:
        raise OutputError(f"{path}: stamps before 1601 do not fit a TwinCAT export; choose --format parquet or csv")
    scope = []
    for i, group in enumerate(groups):
        columns = dict(group.columns)
        if open_loop and i == 0:
            columns[COLUMN] = np.ones(group.stamps.size)
        period = float(np.median(np.diff(group.stamps))) / 1e6 if group.stamps.size > 1 else 1.0
        units = ["1" if name == COLUMN else signal_of(name).unit for name in columns]
        scope.append(ScopeGroup(period, list(columns), units, group.stamps, list(columns.values())))
    write_scope(path, scope)
