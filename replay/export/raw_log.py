"""Write a log as it was recorded: one Parquet file for each topic, in a folder with an index.

Channels of one topic that have the same stamps stand in one file; those that only some of its messages hold stand in
further ones, so that every sample comes back as it was: ``/imu`` → ``imu.parquet``, ``imu~2.parquet``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from replay.arrays.blocks import release
from replay.errors import LogError, OutputError
from replay.export.raw_folder import INDEX, SCHEMA, RawFile, RawHead, RawIndex, new_folder, place, refuse_foreign_folder
from replay.log.content_hash import content_hash
from replay.log.raw_log import Channel, RawLog, Window
from replay.log.source_options import SourceOptions
from replay.progress import Progress, Stage, Subscriber, silent
from replay.readers.registry import read_log, summarise_log

STAMP = "stamp_ns"
_GROUP_CELLS = 1 << 22
_LONGEST_NAME = 80


@dataclass(frozen=True)
class _Group:
    """Channels that share their stamps."""

    topic: str
    stamps: NDArray[np.int64]
    channels: tuple[Channel, ...]


def write_raw(
    path: Path,
    folder: Path,
    options: SourceOptions,
    *,
    start_s: float | None = None,
    stop_s: float | None = None,
    force: bool = False,
    progress: Subscriber = silent,
) -> RawIndex:
    """Convert one log.

    Parameters
    ----------
    path : Path
        File or rosbag2 folder.
    folder : Path
        Folder to write; one that an earlier conversion wrote is replaced.
    options : SourceOptions
        How the log is read.
    start_s, stop_s : float or None
        Part of the log [s from its first stamp].
    force : bool
        Whether to write into a folder that holds something else; files of other names stay.
    progress : Subscriber
        Called at the beginning of each stage.

    Returns
    -------
    RawIndex
        Source and its SHA-256, clock, files with their columns, notes, damage.

    Raises
    ------
    LogError
        Where the log cannot be read or holds no samples.
    OutputError
        Where the folder cannot be written, or holds something else.
    """
    refuse_foreign_folder(folder, force=force)
    progress(Progress(Stage.READING, path.name))
    log = read_log(path, options, window=_window(path, options, start_s, stop_s), texts=True)
    groups = _groups(log)
    if not groups:
        raise LogError(f"{path}: no samples to convert: {_nothing(log)}")
    progress(Progress(Stage.HASHING, path.name))
    head = _head(path, log)
    try:
        with new_folder(folder) as temporary:
            index = _write_all(temporary, log, groups, head, progress)
            (temporary / INDEX).write_text(json.dumps(index, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
            place(temporary, folder)
    except (OSError, pa.ArrowException) as error:
        said = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise OutputError(f"{folder}: cannot be written ({said}); give another place") from error
    return index


def _head(path: Path, log: RawLog) -> RawHead:
    sha256, size = content_hash(path)
    return {
        "schema": SCHEMA, "source": path.name, "sha256": sha256, "bytes": size, "format": log.format,
        "clock": log.clock, "start_ns": log.summary.start_ns, "stop_ns": log.summary.stop_ns,
    }  # fmt: skip


def _write_all(folder: Path, log: RawLog, groups: Sequence[_Group], head: RawHead, progress: Subscriber) -> RawIndex:
    """Write every file, and describe them."""
    files: list[RawFile] = []
    for group, name in zip(groups, _names(groups), strict=True):
        progress(Progress(Stage.WRITING, name))
        files.append(_write(folder / name, group, head))
        release(group.stamps, *(c.values for c in group.channels))
    damage = log.summary.damage
    return {
        **head,
        "status": "degraded" if damage else "ok",
        "damage": list(damage),
        "notes": [*log.summary.notes, *_split_topics(files)],
        "files": files,
    }


def _nothing(log: RawLog) -> str:
    """Say why a log holds no samples."""
    topics = log.summary.topics
    if not topics or not any(t.count for t in topics):
        return "; ".join(log.summary.damage) or ("its topics hold no messages" if topics else "it holds no topics")
    shown = ", ".join(f"{t.name} ({t.note or t.type_name or t.encoding or 'no type'})" for t in topics[:6])
    more = f" and {len(topics) - 6} more" if len(topics) > 6 else ""
    return "; ".join((f"its topics hold none: {shown}{more}", *log.summary.damage))


def _window(path: Path, options: SourceOptions, start_s: float | None, stop_s: float | None) -> Window | None:
    if start_s is None and stop_s is None:
        return None
    summary = summarise_log(path, options)
    first = summary.start_ns + round((start_s or 0.0) * 1e9)
    return first, summary.stop_ns + 1 if stop_s is None else summary.start_ns + round(stop_s * 1e9)


def _groups(log: RawLog) -> list[_Group]:
    """Channels by topic and stamps, in recorded order."""
    listed = {field: info.name for info in log.summary.topics for field in info.fields}
    topics: dict[str, dict[int, list[Channel]]] = {}
    for channel in log.channels.values():
        topic = channel.topic or listed.get(channel.name, Path(log.source).stem)
        same = topics.setdefault(topic, {})
        key = id(channel.stamps)
        if key not in same:
            equal = (k for k, held in same.items() if np.array_equal(held[0].stamps, channel.stamps))
            key = next(equal, key)
        same.setdefault(key, []).append(channel)
    return [_Group(topic, held[0].stamps, tuple(held)) for topic, same in topics.items() for held in same.values()]


def _split_topics(files: list[RawFile]) -> list[str]:
    """Say why one topic stands in several files."""
    topics: dict[str, list[str]] = {}
    for file in files:
        topics.setdefault(file["topic"], []).append(file["file"])
    several = {topic: names for topic, names in topics.items() if len(names) > 1}
    if not several:
        return []
    shown = "; ".join(
        f"{t}: {n[0]} to {n[-1]}" if len(n) > 2 else f"{t}: {n[0]}, {n[1]}" for t, n in [*several.items()][:6]
    )
    more = f" and {len(several) - 6} more" if len(several) > 6 else ""
    return [
        "topics are written to several files where only some of their messages hold a number (lists of changing length, empty "
        f"fields), so that every number keeps its own stamp: {shown}{more}"
    ]


def _names(groups: Iterable[_Group]) -> list[str]:
    """File names that every system can hold, each once."""
    names: list[str] = []
    seen: dict[str, int] = {}
    for group in groups:
        plain = re.sub(r"[^A-Za-z0-9_-]+", ".", group.topic).strip(".")[:_LONGEST_NAME] or "topic"
        number = seen[plain.lower()] = seen.get(plain.lower(), 0) + 1
        names.append(f"{plain}.parquet" if number == 1 else f"{plain}~{number}.parquet")
    return names


def _type_of(channel: Channel) -> str:
    """Number type, or ``text``."""
    return "text" if channel.values.dtype == object else str(channel.values.dtype)


def _write(path: Path, group: _Group, head: RawHead) -> RawFile:
    """Write one file, some rows at a time, and describe it."""
    names = [c.name for c in group.channels]
    stamp = STAMP if STAMP not in names else f"log.{STAMP}"
    fields = [pa.field(stamp, pa.int64(), nullable=False, metadata={"unit": "ns"})]
    for c in group.channels:
        about = {"topic": c.topic, "field": c.field, "type": c.type_name} | ({"unit": c.unit} if c.unit else {})
        text = c.values.dtype == object
        kind = pa.string() if text else pa.from_numpy_dtype(c.values.dtype)
        fields.append(pa.field(c.name, kind, nullable=text, metadata=about))
    origin = {f"mfhca.{key}": str(value) for key, value in head.items()} | {
        "mfhca.topic": group.topic,
        "mfhca.time": stamp,
    }
    schema = pa.schema(fields, metadata=origin)
    count = len(group.stamps)
    step = max(_GROUP_CELLS // len(fields), 1 << 10)
    with pq.ParquetWriter(path, schema, compression="zstd", write_page_checksum=True) as writer:
        for at in range(0, count, step):
            part = slice(at, min(at + step, count))
            cells = zip(group.channels, fields[1:], strict=True)
            arrays = [pa.array(group.stamps[part]), *(pa.array(c.values[part], field.type) for c, field in cells)]
            writer.write_batch(pa.record_batch(arrays, schema=schema))
    return {
        "file": path.name,
        "topic": group.topic,
        "type": group.channels[0].type_name,
        "rows": count,
        "first_ns": int(group.stamps.min()) if count else None,
        "last_ns": int(group.stamps.max()) if count else None,
        "columns": [{"name": c.name, "field": c.field, "dtype": _type_of(c), "unit": c.unit} for c in group.channels],
    }
