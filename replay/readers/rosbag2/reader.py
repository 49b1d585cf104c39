"""rosbag2 recordings: folders of SQLite or MCAP files, and single ``.db3`` or compressed files."""

from __future__ import annotations

import tempfile
from collections.abc import Collection
from dataclasses import replace
from functools import partial
from pathlib import Path

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.raw_log import Clock, LogSummary, RawLog, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.mcap import reader
from replay.readers.rosbag2 import sqlite_reader
from replay.readers.rosbag2.message_compression import unpacked
from replay.readers.rosbag2.metadata import Metadata
from replay.readers.rosbag2.parts import find_parts, is_compressed, storage_files
from replay.readers.rosbag2.sqlite_file import MAGIC

_SERVICE = "/_service_event"
_SHOWN = 6


class Rosbag2Reader:
    """Reader of rosbag2 folders and of ``.db3`` files."""

    format = "rosbag2"

    def matches(self, path: Path) -> bool:
        """Whether the path is an SQLite file or called so, or a folder with ``metadata.yaml`` or storage files."""
        if path.is_dir():
            return (path / "metadata.yaml").is_file() or bool(storage_files(path))
        if path.suffix == ".db3" or is_compressed(path):
            return True
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List topics and counts of all parts.

        Raises
        ------
        LogError
            Where no part can be read.
        """
        with tempfile.TemporaryDirectory(prefix="mfhca-") as scratch:
            report = Report()
            files, meta = find_parts(path, report, Path(scratch))
            if _is_mcap(files, path):
                summary = reader.summary_of(reader.open_files(files, path, report), path, self.format, report)
            else:
                summary = sqlite_reader.summarise(files, path, report, meta.counts is not None)
            return _complete(summary, meta, compare=True)

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
        store: ColumnStore | None = None,
        texts: bool = False,
    ) -> RawLog:
        """Decode the given topics and time of all parts.

        Raises
        ------
        LogError
            Where no part can be read.
        """
        with tempfile.TemporaryDirectory(prefix="mfhca-") as scratch:
            report = Report(store=store or ColumnStore())
            files, meta = find_parts(path, report, Path(scratch))
            packed = meta.facts.get("compression_mode") == "message"
            if _is_mcap(files, path):
                unpack = partial(unpacked, name=path.name, report=report) if packed else None
                log = reader.read_files(files, path, self.format, report, topics, clock, window, unpack, texts)
            else:
                log = sqlite_reader.read(files, path, report, topics, clock, window, packed, meta.counts, texts)
            calls = _services(log.summary)
            channels = {name: c for name, c in log.channels.items() if c.topic not in calls}
            return replace(log, channels=channels, summary=_complete(log.summary, meta, compare=window is None))


def _is_mcap(files: list[Path], path: Path) -> bool:
    """Whether the parts are MCAP files; a mixture is refused."""
    kinds = {f.suffix == ".mcap" for f in files}
    if len(kinds) > 1:
        raise LogError(f"{path} mixes .db3 and .mcap files; give the files of one recording")
    return kinds == {True}


def _services(summary: LogSummary) -> list[str]:
    """Topics on which the calls of services and actions were recorded."""
    return [t.name for t in summary.topics if t.name.endswith(_SERVICE) or t.type_name.endswith("_Event")]


def _complete(summary: LogSummary, meta: Metadata, compare: bool) -> LogSummary:
    """Add what ``metadata.yaml`` says, hold its counts against those found, and name what is no signal."""
    notes, damage = list(summary.notes), list(summary.damage)
    found: dict[str, int] = {}
    for topic in summary.topics:
        found[topic.name] = found.get(topic.name, 0) + topic.count
    for name, stated in sorted((meta.counts or {}).items()) if compare else ():
        count = found.get(name, 0)
        if stated > count:
            damage.append(
                f"{name[:80]}: metadata.yaml counts {stated} messages, {count} were found; {stated - count} are missing"
            )
        elif count > stated:
            notes.append(f"{name[:80]}: metadata.yaml counts {stated} messages, {count} were found; all count")
    services = _services(summary)
    if services:
        more = f" and {len(services) - _SHOWN} more" if len(services) > _SHOWN else ""
        notes = [n for n in notes if not any(n.startswith(f"{s} is not decoded") for s in services)]
        notes.append(f"calls of services and actions are not signals and were left out: "
                     f"{', '.join(services[:_SHOWN])}{more}")  # fmt: skip
    if compare and not damage and not sum(found.values()):
        notes.append("the recording holds no messages: it was started and stopped with nothing received")
    custom = {f"custom_data.{key}": value for key, value in meta.custom.items()}
    return replace(
        summary, notes=tuple(notes), damage=tuple(damage), metadata={**custom, **meta.facts, **summary.metadata}
    )
