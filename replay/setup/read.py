"""Read the files of a mission for a first look: no machine is known yet."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path

from replay.arrays.column_store import ColumnStore
from replay.log.empty_log import require_messages
from replay.log.joined_tables import joined_tables
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.log.stamp_order import in_order
from replay.machine.config import Machine, haulotte
from replay.progress import Progress, Stage, Subscriber, silent
from replay.readers.messages.description_text import is_description
from replay.readers.registry import read_log, summarise_log
from replay.signals.mapping import plan_topics


def read_everything(
    paths: Sequence[Path], machine: Machine | None = None, *, every: bool = True, progress: Subscriber = silent
) -> list[RawLog]:
    """Decode the files of one mission.

    Parameters
    ----------
    paths : Sequence[Path]
        Files and rosbag2 folders.
    machine : Machine or None
        How its sources are read; None: as files describe themselves.
    every : bool
        Whether every topic is decoded, rather than those that may hold signals.
    progress : Subscriber
        Called at the beginning of each stage.

    Raises
    ------
    LogError
        Where a file cannot be read, or none holds a message.
    """
    store = ColumnStore()
    logs, summaries = [], []
    for path in paths:
        options = options_of(path, machine)
        topics = None
        summary = summarise_log(path, options)
        summaries.append(summary)
        if not every:
            plan = plan_topics([summary], machine or haulotte(), lambda t: is_description(t.name, t.type_name))
            topics = plan[summary.source]
        progress(Progress(Stage.READING, path.name))
        logs.append(in_order(read_log(path, options, topics, store=store)))
    require_messages(summaries, logs)
    return joined_tables(logs)


def options_of(path: Path, machine: Machine | None) -> SourceOptions:
    """Options of a file by the machine's patterns."""
    sources = {} if machine is None else machine.sources
    return next((options for pattern, options in sources.items() if fnmatch(path.name, pattern)), SourceOptions())
