"""Write the replayed loop as Parquet, CSV, or an MCAP file to open beside the original log."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from replay.atomic_write import atomic_path
from replay.control.loop import Replay
from replay.control.loop_columns import replay_columns
from replay.errors import ConfigError, OutputError
from replay.export.formats.joint_states import joint_states
from replay.export.formats.mcap import write_mcap
from replay.export.formats.message_layout import TopicBatch
from replay.inspection.mcap_index import mcap_index
from replay.log.open_loop import COLUMN
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

REPLAY_FORMATS = ("parquet", "csv", "mcap")
_LAST_ROS_NS = 2**32 * 1_000_000_000

# Topic and field of `Replay`, by wheel and by steering axle.
_WHEEL_TOPICS = (
    ("v_ref", "v_ref"),
    ("e", "e"),
    ("rho", "rho"),
    ("psi_hat", "psi"),
    ("psi_hat_printed", "psi_printed"),
    ("psi_hat_implied", "psi_implied"),
    ("psi_hat_implied_squared", "implied_squared"),
    ("psi_hat_forcing", "forcing"),
    ("u_replayed", "u"),
    ("u_difference", "u_difference"),
    ("wheel_phi", "wheel_phi"),
)
_AXLE_TOPICS = (
    ("steer_phi_ref", "phi_ref"),
    ("steer_u_replayed", "steer_u"),
    ("steer_u_difference", "steer_difference"),
)


def format_of(path: Path) -> str:
    """Format that a file name asks for.

    Raises
    ------
    ConfigError
        Where its extension is none of `REPLAY_FORMATS`.
    """
    ending = path.suffix.lower().lstrip(".")
    if ending not in REPLAY_FORMATS:
        raise ConfigError(f"{path}: cannot tell the format from its name; expected .parquet, .csv or .mcap")
    return ending


def write_replay(path: Path, timeline: Timeline, replay: Replay, machine: Machine, format: str) -> tuple[str, ...]:  # noqa: A002
    """Write the recorded signals and the replayed loop.

    Tables hold ``stamp_ns`` and the columns of `replay.control.loop_columns.replay_columns`. MCAP holds a JointState topic
    ``/mfhca/<quantity>`` for each replayed quantity, named by wheel or axle, its value in ``position``; log time and
    header stamp are the time of the step on the log's own clock. NaN stays NaN.

    Parameters
    ----------
    path : Path
        File to write; an existing one is replaced.
    timeline : Timeline
        Aligned signals.
    replay : Replay
        The loop replayed on it.
    machine : Machine
        Wheels and axles.
    format : str
        One of `REPLAY_FORMATS`.

    Returns
    -------
    tuple[str, ...]
        Columns or topics written.

    Raises
    ------
    ConfigError
        Where the format is not known.
    OutputError
        Where the file cannot be written.
    """
    if format not in REPLAY_FORMATS:
        raise ConfigError(f"format = {format!r} is not known; expected one of {', '.join(REPLAY_FORMATS)}")
    if format == "mcap":
        first, last = _stamps(timeline)[[0, -1]]
        if first < 0 or last >= _LAST_ROS_NS:
            raise OutputError(
                f"{path}: MCAP with ROS stamps holds 1970 to 2106, the log starts at {np.datetime64(int(first), 'ns')}; "
                "write Parquet or CSV instead"
            )
        batches = replay_topics(timeline, replay, machine)
        write_mcap(path, batches)
        return tuple(b.topic for b in batches)
    columns = replay_columns(timeline, replay, machine, detail=True)
    if timeline.open_loop:
        columns[COLUMN] = np.ones(timeline.size)
    table = pa.table({"stamp_ns": pa.array(_stamps(timeline))} | {k: pa.array(v) for k, v in columns.items()})
    with atomic_path(path) as temporary:
        if format == "csv":
            pa.csv.write_csv(table, temporary, pa.csv.WriteOptions(quoting_style="needed"))
        else:
            readings = json.dumps([[r.name, r.value, r.detail] for r in replay.readings], ensure_ascii=False)
            table = table.replace_schema_metadata({"mfhca.machine": machine.name, "mfhca.readings": readings})
            pa.parquet.write_table(table, temporary, compression="zstd")
    return tuple(table.column_names)


def refuse_foreign_file(path: Path) -> None:
    """Raise an `OutputError` where a file stands in the place of a result that no replay wrote.

    Parameters
    ----------
    path : Path
        File to write.
    """
    if path.is_file() and path.stat().st_size and not _is_own(path):
        raise OutputError(f"{path}: exists, and no replay wrote it; give another name, or --force to replace it")


def _is_own(path: Path) -> bool:
    """Whether a replay wrote a file."""
    kind = format_of(path)
    if kind == "mcap":
        index = mcap_index(path, "log")
        return index is not None and bool(index.topics) and all(t.name.startswith("/mfhca/") for t in index.topics)
    if kind == "csv":
        with path.open("rb") as file:
            return file.readline(20).replace(b'"', b"").startswith(b"stamp_ns,t,")
    try:
        return b"mfhca.readings" in (pa.parquet.read_schema(path).metadata or {})
    except (pa.ArrowException, OSError, ValueError):
        return False


def _stamps(timeline: Timeline) -> NDArray[np.int64]:
    return timeline.start_ns + timeline.step_ns * np.arange(timeline.size, dtype=np.int64)


def replay_topics(timeline: Timeline, replay: Replay, machine: Machine) -> list[TopicBatch]:
    """Every replayed quantity that is defined somewhere, as messages of one topic."""
    stamps = _stamps(timeline)
    batches = []
    for parts, topics in ((machine.wheels, _WHEEL_TOPICS), (machine.axles, _AXLE_TOPICS)):
        for name, field in topics:
            values: NDArray[np.float64] = getattr(replay, field)
            if values.size and np.isfinite(values).any():
                batches.append(joint_states(f"/mfhca/{name}", parts, values, stamps, "base_link"))
    return batches
