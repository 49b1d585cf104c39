"""Topics of one rosbag2 database with their definitions, from wherever they are found where it is damaged."""

from __future__ import annotations

import re

import numpy as np

from replay.log.reading_notes import Report
from replay.readers.messages.connection import Connection
from replay.readers.rosbag2 import sqlite_kernel as scan
from replay.readers.rosbag2.metadata import MAX_BYTES, Metadata, parse_metadata
from replay.readers.rosbag2.sqlite_file import Image, Value
from replay.readers.rosbag2.sqlite_messages import Database

_TYPE = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)+")


def open_database(image: Image, report: Report) -> Database:
    """Read the schema and the topics of a database, from wherever they are found where it is damaged."""
    base = Database(image, report)
    base.tables = image.schema()
    topics = _named(base, "topics", ["id", "name", "type", "serialization_format"])
    texts = _named(base, "message_definitions", ["topic_type", "encoding", "encoded_message_definition"])
    if not topics and image.suspects:
        topics, texts = _stray_topics(image)
    base.stated = _own_counts(base)
    definitions = {str(name): (str(encoding), str(text)) for name, encoding, text in texts}
    for number, name, kind, encoding in topics:
        if isinstance(number, int):
            base.connections[number] = Connection(
                str(name), str(kind), str(encoding), *definitions.get(str(kind), ("", ""))
            )
    return base


def _own_counts(base: Database) -> dict[str, int] | None:
    """Messages per topic from the recorder's last copy of its metadata; None for a part among others."""
    texts = [str(text) for (text,) in _named(base, "metadata", ["metadata"])]
    meta = parse_metadata(texts[-1][:MAX_BYTES]) if texts else Metadata()
    return meta.counts if meta.counts and len(meta.files or []) == 1 and any(meta.counts.values()) else None


def _named(base: Database, table: str, names: list[str]) -> list[list[Value]]:
    """Values of some columns of a table; the row's number stands for an empty id."""
    if table not in base.tables:
        return []
    columns = base.tables[table].columns()
    out = []
    for number, values in base.image.rows(base.image.leaves(base.tables[table].root)):
        found = dict(zip(columns, values, strict=False))
        if found.get("id") is None:
            found["id"] = number
        out.append([found.get(n) for n in names])
    return out


def _stray_topics(image: Image) -> tuple[list[list[Value]], list[list[Value]]]:
    """Rows that look like topics and definitions, from pages that no table leads to."""
    topics: list[list[Value]] = []
    texts: list[list[Value]] = []
    starts = np.arange(len(image.seen) - 1) * image.page
    for page in (np.flatnonzero(image.data[starts] == scan.LEAF) + 1).tolist():
        if image.seen[page] and page != 1:
            continue
        for number, values in image.rows(np.array([page], np.int64), 1000):
            words = values[1:4]
            if len(words) < 3 or not all(isinstance(w, str) for w in words):
                continue
            if str(words[0]).startswith("/") and _TYPE.fullmatch(str(words[1])):
                topics.append([number, *words])
            elif _TYPE.fullmatch(str(words[0])) and words[1] in ("ros2msg", "ros2idl"):
                texts.append(words)
    return topics, texts
