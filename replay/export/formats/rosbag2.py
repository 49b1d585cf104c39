"""Write rosbag2 folders: SQLite database and metadata.yaml, as ROS 2 Iron and later record them."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from rosbags.typesys import Stores, get_typestore

from replay.atomic_write import atomic_path
from replay.errors import OutputError
from replay.export.formats.message_layout import ChunkPlan, TopicBatch, plan_chunks

_VERSION = 8
_BLOCK = 4 << 20
_TABLES = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL,
  offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
  encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
  data BLOB NOT NULL);
INSERT INTO schema VALUES(4, 'jazzy');
"""


def write_rosbag2(path: Path, batches: Sequence[TopicBatch], *, compressed: bool = False) -> None:
    """Write topics in CDR as a rosbag2 folder.

    Parameters
    ----------
    path : Path
        Folder; an existing recording there is replaced.
    batches : Sequence[TopicBatch]
        Messages.
    compressed : bool
        Whether the database is compressed as a whole with zstd (``compression_mode: FILE``).

    Raises
    ------
    OutputError
        Where the folder cannot be written or holds other files.
    """
    with atomic_path(path, folder=True) as folder:
        database = folder / f"{path.name}_0.db3"
        try:
            metadata = _write_database(database, batches, compressed)
        except sqlite3.Error as error:
            raise OutputError(f"{path}: cannot be written ({error}); give another place") from error
        if compressed:
            with database.open("rb") as plain, database.with_name(database.name + ".zstd").open("wb") as packed:
                zstandard.ZstdCompressor(level=19).copy_stream(plain, packed, size=database.stat().st_size)
            database.unlink()
        text = "\n".join(_yaml({"rosbag2_bagfile_information": metadata}, 0))
        (folder / "metadata.yaml").write_text(text + "\n", encoding="utf-8")


def _write_database(database: Path, batches: Sequence[TopicBatch], compressed: bool) -> dict[str, Any]:
    """Fill the database; return the recording's metadata."""
    type_of = {b.topic: b.type_name for b in batches}
    topics = list(type_of)
    numbers = [topics.index(b.topic) + 1 for b in batches]
    store = get_typestore(Stores.ROS2_HUMBLE)
    digests = {name: store.hash_rihs01(name) for name in type_of.values()}
    with closing(sqlite3.connect(database)) as connection:
        connection.executescript("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;" + _TABLES)
        connection.executemany(
            "INSERT INTO topics VALUES(?, ?, ?, 'cdr', '', ?)",
            [(i, topic, type_of[topic], digests[type_of[topic]]) for i, topic in enumerate(topics, 1)],
        )
        connection.executemany(
            "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition, type_description_hash)"
            " VALUES(?, 'ros2msg', ?, ?)",
            [(name, store.generate_msgdef(name, ros_version=2)[0], digest) for name, digest in digests.items()],
        )
        first, last = None, 0
        for plan in plan_chunks(batches, 0, _BLOCK):
            _insert(connection, plan, batches, numbers)
            first, last = plan.start_ns if first is None else first, plan.stop_ns
        connection.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
        counts = {t: sum(b.log_stamps.size for b in batches if b.topic == t) for t in topics}
        metadata = _metadata(database.name + ".zstd" * compressed, type_of, digests, counts, first or 0, last)
        document = "\n".join(_yaml(metadata, 0))
        connection.execute("INSERT INTO metadata(metadata_version, metadata) VALUES(?, ?)", (_VERSION, document))
        connection.commit()
    return metadata


def _insert(
    connection: sqlite3.Connection, plan: ChunkPlan, batches: Sequence[TopicBatch], numbers: Sequence[int]
) -> None:
    """Insert one block in order of time; SQLite takes one object per message."""
    blobs: list[bytes] = []
    stamps, owners = [], []
    for piece in plan.pieces:
        batch = batches[piece.batch]
        blobs += batch.encode(piece.start, piece.stop).view(f"V{batch.size}")[:, 0].tolist()
        stamps.append(batch.log_stamps[piece.start : piece.stop])
        owners.append(np.full(piece.stop - piece.start, numbers[piece.batch]))
    order = np.argsort(np.concatenate([p.offsets for p in plan.pieces]))
    connection.executemany(
        "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
        zip(
            np.concatenate(owners)[order].tolist(),
            np.concatenate(stamps)[order].tolist(),
            map(blobs.__getitem__, order.tolist()),
            strict=True,
        ),
    )


def _metadata(
    file_name: str, type_of: dict[str, str], digests: dict[str, str], counts: dict[str, int], first: int, last: int
) -> dict[str, Any]:
    span = {"starting_time": {"nanoseconds_since_epoch": first}, "duration": {"nanoseconds": last - first}}
    total = sum(counts.values())
    compressed = file_name.endswith(".zstd")
    return {
        "version": _VERSION,
        "storage_identifier": "sqlite3",
        **span,
        "message_count": total,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic,
                    "type": type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": "",
                    "type_description_hash": digests[type_name],
                },
                "message_count": counts[topic],
            }
            for topic, type_name in type_of.items()
        ],
        "compression_format": "zstd" if compressed else "",
        "compression_mode": "FILE" if compressed else "",
        "relative_file_paths": [file_name],
        "files": [{"path": file_name, **span, "message_count": total}],
        "custom_data": None,
        "ros_distro": "jazzy",
    }


def _yaml(value: Any, depth: int) -> list[str]:
    """Lines of a YAML mapping or sequence in block style; scalars as JSON, which is YAML too."""
    pad = "  " * depth
    lines = []
    for key, item in value.items() if isinstance(value, dict) else ((None, v) for v in value):
        name = "-" if key is None else f"{key}:"
        if isinstance(item, dict | list) and item:
            lines += [f"{pad}{name}", *_yaml(item, depth + 1)]
        else:
            lines.append(f"{pad}{name} {json.dumps(item)}")
    return lines
