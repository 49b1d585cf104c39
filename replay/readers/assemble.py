"""From the payloads of a message log to named channels with stamps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.rawlog import Channel, Clock, LogSummary, RawLog
from replay.readers import cdr, jsonmsg, protobuf
from replay.readers.clocks import Clocks, Report
from replay.readers.definitions import DefinitionError, MessageType, resolve
from replay.readers.protobuf_schema import Schema, schema_of

_SLOW_SHARE = 0.2


@dataclass(frozen=True)
class Connection:
    """One stream of messages of one type.

    Attributes
    ----------
    topic, type_name : str
        As recorded.
    encoding : str
        Serialisation of the payloads: ``cdr``, ``ros1``, ``json`` or ``protobuf``; others are not decoded.
    schema_encoding, definition : str
        Language and text of the message definition, one character per byte for ``protobuf``; empty where the log holds
        none.
    """

    topic: str
    type_name: str
    encoding: str
    schema_encoding: str = ""
    definition: str = ""

    def why_not(self) -> str:
        """Return why messages of this stream cannot be decoded, or an empty string."""
        if self.encoding == "json":
            return ""
        if self.encoding not in ("cdr", "ros1", "protobuf"):
            return f"{self.encoding or 'unnamed'} serialisation is not decoded"
        try:
            self.protobuf_schema() if self.encoding == "protobuf" else self.message_type()
        except DefinitionError as error:
            return str(error)
        return ""

    def message_type(self) -> MessageType:
        """Return the resolved type; raises `DefinitionError`."""
        return resolve(self.type_name, self.schema_encoding, self.definition, self.encoding == "ros1")

    def protobuf_schema(self) -> Schema:
        """Return the resolved type of protobuf messages; raises `DefinitionError`."""
        return schema_of(self.type_name, self.definition if self.schema_encoding == "protobuf" else "")


@dataclass(frozen=True)
class Block:
    """Some messages of one connection.

    Attributes
    ----------
    connection : Connection
        Their stream.
    data : NDArray[np.uint8], shape (b,)
        Bytes that hold the payloads.
    starts, lengths : NDArray[np.int64], shape (n,)
        Place of each payload.
    log_ns : NDArray[np.int64], shape (n,)
        Log stamps [ns].
    publish_ns : NDArray[np.int64], shape (n,) or None
        Publish stamps [ns], where the container has them.
    """

    connection: Connection
    data: NDArray[np.uint8]
    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    publish_ns: NDArray[np.int64] | None = None


@dataclass
class _Topic:
    """Columns of one topic and type, gathered block by block."""

    connection: Connection
    stamp: str | None = None
    count: int = 0
    log: list[NDArray[np.int64]] = field(default_factory=list)
    publish: list[NDArray[np.int64]] = field(default_factory=list)
    order: list[NDArray[np.int64]] = field(default_factory=list)
    columns: dict[str, list[tuple[NDArray[np.int64], NDArray[Any]]]] = field(default_factory=dict)
    skipped: set[str] = field(default_factory=set)
    outcome: cdr.Outcome = field(default_factory=cdr.Outcome)
    decoders: dict[Connection, cdr.Decoder] = field(default_factory=dict)
    walkers: dict[Connection, protobuf.Decoder] = field(default_factory=dict)
    mute: str = ""

    def add(self, block: Block, serial: int) -> None:
        if self.mute:
            return
        first, n = self.count, len(block.starts)
        self.mute = block.connection.why_not()
        if self.mute:
            return
        if block.connection.encoding == "json":
            stamp, parts = jsonmsg.decode(block.data, block.starts, block.lengths, self.outcome)
            self.stamp = stamp or self.stamp
        elif block.connection.encoding == "protobuf":
            walker = self.walkers.get(block.connection)
            if walker is None:
                schema = block.connection.protobuf_schema()
                self.stamp = schema.stamp and schema.stamp[0]
                walker = self.walkers[block.connection] = protobuf.Decoder(schema, self.outcome)
            parts = list(walker.decode(block.data, block.starts, block.lengths))
        else:
            decoder = self.decoders.get(block.connection)
            if decoder is None:
                kind = block.connection.message_type()
                self.stamp = kind.stamp
                decoder = self.decoders[block.connection] = cdr.Decoder(kind, self.outcome)
            parts = list(decoder.decode(block.data, block.starts, block.lengths))
        for part in parts:
            self.skipped.update(part.skipped)
            rows = part.rows + first
            for path, values in part.columns.items():
                self.columns.setdefault(path, []).append((rows, values))
        self.count += n
        self.log.append(block.log_ns)
        self.publish.append(block.log_ns if block.publish_ns is None else block.publish_ns)
        self.order.append(block.starts + (serial << 40))


class Assembler:
    """Collects blocks and builds the `RawLog`."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self.clock, self.report = clock, report
        self.topics: dict[tuple[str, str], _Topic] = {}
        self.serial = 0
        self.clocks = Clocks(clock, report)

    def add(self, blocks: Iterable[Block]) -> None:
        """Decode blocks; `starts` order messages within one call of one buffer."""
        for block in blocks:
            key = (block.connection.topic, block.connection.type_name)
            topic = self.topics.setdefault(key, _Topic(block.connection))
            topic.add(_within_range(block, self.report), self.serial)
        self.serial += 1

    def finish(self, summary: LogSummary) -> RawLog:
        """Build the channels and complete the summary's notes and damage."""
        channels: dict[str, Channel] = {}
        seen: set[str] = set()
        for (name, type_name), topic in self.topics.items():
            label = name
            if name in seen:
                label = f"{name} ({type_name})"
                self.report.note(f"{name} carries several message types; those of {type_name} are under {label!r}")
            seen.add(name)
            for channel in self._channels(label, topic):
                channels[channel.name] = channel
        self.clocks.finish(channels)
        summary = replace(
            summary,
            notes=tuple(dict.fromkeys((*summary.notes, *self.report.notes))),
            damage=tuple(dict.fromkeys((*summary.damage, *self.report.damage))),
        )
        return RawLog(summary.source, summary.format, self.clock, channels, summary)

    def _channels(self, label: str, topic: _Topic) -> Iterable[Channel]:
        self._say(label, topic)
        if topic.mute or not topic.count:
            return
        log, order = np.concatenate(topic.log), np.concatenate(topic.order)
        rank = None if np.all(order[1:] > order[:-1]) else np.argsort(np.argsort(order, kind="stable"))
        columns = {path: _join(parts, rank) for path, parts in topic.columns.items()}
        publish = np.concatenate(topic.publish)
        if rank is not None:
            log, publish = (a[np.argsort(rank)] for a in (log, publish))
        header = _take_header(topic.stamp, columns, len(log), topic.outcome.bad)
        stamps = self.clocks.stamps(label, header, log, publish)
        for path, (rows, values) in columns.items():
            yield Channel(
                f"{label}.{path}", label, path, stamps if len(rows) == len(stamps) else stamps[rows], values, None,
                topic.connection.type_name,
            )  # fmt: skip

    def _say(self, label: str, topic: _Topic) -> None:
        report, outcome = self.report, topic.outcome
        if topic.mute:
            report.note(f"{label} is not decoded: {topic.mute}")
        for walker in topic.walkers.values():
            for text in walker.schema.notes:
                report.note(f"{label}: {text}")
        if topic.skipped:
            report.note(f"{label}: left out arrays of more than 64 elements: {', '.join(sorted(topic.skipped)[:5])}")
        if outcome.bad:
            text = f"{label}: {outcome.bad} of {topic.count} messages cannot be decoded: {outcome.reason}"
            guessed = not topic.connection.definition and outcome.bad == topic.count
            (report.note if guessed else report.lost)(text)
        if outcome.slow > _SLOW_SHARE * max(topic.count, 1):
            report.note(f"{label}: {outcome.slow} of {topic.count} messages change their layout; decoded one by one")


def _take_header(
    path: str | None, columns: dict[str, tuple[NDArray[np.int64], NDArray[Any]]], count: int, bad: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Take the header stamp out of the columns: rows that should have one, and stamps of all rows [ns], 0 for none."""
    sec, nsec = (columns.pop(f"{path}.{part}", None) for part in ("sec", "nanosec"))
    if sec is None or nsec is None or len(sec[0]) != len(nsec[0]):
        return None
    header = np.zeros(count, np.int64)
    header[sec[0]] = sec[1].astype(np.int64) * 1_000_000_000 + nsec[1].astype(np.int64)
    return sec[0] if len(sec[0]) >= count - bad else np.arange(count), header


def _within_range(block: Block, report: Report) -> Block:
    """Drop messages whose unsigned log stamp does not fit 63 bits."""
    late = block.log_ns < 0
    if not late.any():
        return block
    report.lost(f"{block.connection.topic}: {late.sum()} messages with impossible log stamps were left out")
    keep = ~late
    publish = None if block.publish_ns is None else block.publish_ns[keep]
    return replace(
        block, starts=block.starts[keep], lengths=block.lengths[keep], log_ns=block.log_ns[keep], publish_ns=publish
    )


def _join(
    parts: list[tuple[NDArray[np.int64], NDArray[Any]]], rank: NDArray[np.int64] | None
) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """Rows in recorded order and their values."""
    rows = np.concatenate([r for r, _ in parts]) if len(parts) > 1 else parts[0][0]
    values = np.concatenate([v for _, v in parts]) if len(parts) > 1 else parts[0][1]
    if rank is not None:
        rows = rank[rows]
    if np.all(rows[1:] > rows[:-1]):
        return rows, values
    order = np.argsort(rows, kind="stable")
    return rows[order], values[order]
