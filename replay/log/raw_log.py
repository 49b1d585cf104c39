"""A recorded log as columns, exactly as recorded: integer nanoseconds, no resampling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore

Clock = Literal["header", "log", "publish"]
Window = tuple[int, int]


@dataclass(frozen=True)
class Channel:
    """One recorded scalar over time.

    Attributes
    ----------
    name : str
        ``topic.field`` for message logs (``/joint_states.velocity[fr_wheel]``), the symbol or column name for
        tables.
    topic, field : str
        The two parts of the name; ``topic`` is empty for tables.
    stamps : NDArray[np.int64], shape (n,)
        Time of each sample on the chosen clock, in nanoseconds since 1970, in recorded order.
    values : NDArray, shape (n,)
        Recorded values in the recorded number type; NaN only where NaN was recorded or a cell was empty. Texts, which are
        channels where they are asked for, are objects; None where a cell was empty.
    unit : str or None
        Unit as the file states it, or None where it states none.
    type_name : str
        Message type or data type as the file states it.
    """

    name: str
    topic: str
    field: str
    stamps: NDArray[np.int64]
    values: NDArray[np.generic]
    unit: str | None = None
    type_name: str = ""


@dataclass(frozen=True)
class TopicInfo:
    """What the index of a log says about one topic (or one group of table columns).

    Attributes
    ----------
    name, type_name : str
        Topic and message type; for tables the group's or file's name and ``table``.
    count : int
        Number of messages or rows.
    encoding : str
        Serialisation (``cdr``, ``ros1``, ``json``, ``table``, …).
    fields : tuple[str, ...]
        Column or symbol names where the container lists them without decoding; empty otherwise.
    note : str
        Why the topic cannot be decoded, or what is unusual about it; empty where all is well.
    """

    name: str
    type_name: str
    count: int
    encoding: str
    fields: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class AttachmentInfo:
    """A file that a log carries within it.

    Attributes
    ----------
    name, media_type : str
        As recorded.
    size : int
        Length of its content [bytes].
    log_ns, create_ns : int
        When it was recorded and created [ns]; 0 where not stated.
    checksum : str
        ``right``, ``wrong``, ``none`` (the log has none) or ``unchecked`` (only the index was read).
    """

    name: str
    media_type: str
    size: int
    log_ns: int = 0
    create_ns: int = 0
    checksum: str = "unchecked"


@dataclass(frozen=True)
class LogSummary:
    """A log's contents without its samples.

    Attributes
    ----------
    source : str
        Path as given.
    format : str
        Short name of the container: ``mcap``, ``bag``, ``rosbag2``, ``twincat``, ``csv``, ``parquet``.
    start_ns, stop_ns : int
        First and last log stamp; both 0 where the log is empty.
    topics : tuple[TopicInfo, ...]
        Every topic or column group.
    notes : tuple[str, ...]
        Unusual but harmless facts, one sentence each.
    damage : tuple[str, ...]
        What was lost and why, one sentence each; a log with damage is ``degraded``.
    metadata : Mapping[str, str]
        Key-value pairs stored in the container.
    attachments : tuple[AttachmentInfo, ...]
        Files within the log.
    """

    source: str
    format: str
    start_ns: int
    stop_ns: int
    topics: tuple[TopicInfo, ...]
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)
    attachments: tuple[AttachmentInfo, ...] = ()


@dataclass(frozen=True)
class RawLog:
    """The decoded channels of one source.

    Attributes
    ----------
    source : str
        Path as given.
    format : str
        As in `LogSummary`.
    clock : str
        Clock asked for (``header``, ``log`` or ``publish``); tables have their own time column. A channel whose
        message type has no header stamp stands on the log clock; `notes` says so.
    channels : Mapping[str, Channel]
        Channels by name, in recorded order of first appearance.
    summary : LogSummary
        The log's contents, with `notes` and `damage` completed by what decoding found.
    store : ColumnStore
        Where its long columns stand.
    robot_description : str
        Text of the last message on a topic called ``robot_description``; empty where there is none.
    """

    source: str
    format: str
    clock: Clock
    channels: Mapping[str, Channel]
    summary: LogSummary
    store: ColumnStore = field(default_factory=ColumnStore, repr=False, compare=False)
    robot_description: str = field(default="", repr=False)
