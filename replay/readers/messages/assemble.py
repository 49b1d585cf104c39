"""From the payloads of a message log to named channels with stamps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.log.raw_log import Channel, Clock, LogSummary, RawLog
from replay.log.reading_notes import Report
from replay.readers.common.message_stamps import Clocks
from replay.readers.messages import cdr, json_messages, protobuf
from replay.readers.messages.cdr_layout import MAX_ELEMENTS
from replay.readers.messages.cdr_program import Spec
from replay.readers.messages.connection import Block, Connection
from replay.readers.messages.description_text import description_in
from replay.readers.messages.protobuf_texts import text_parts
from replay.readers.messages.tables import Budget, Cells, Table
from replay.readers.messages.texts import GIVE_UP, TextDecoder, TextStore, has_texts
from replay.readers.messages.topic_store import Store

MEMORY = 512 << 20
_SLOW_SHARE = 0.2
_LOOK_EVERY = 16
_MOST_ROWS = 1 << 14


@dataclass
class _Topic:
    """Columns of one topic and type, gathered batch by batch."""

    connection: Connection
    store: Store
    stamps: Table
    last: Connection | None = None
    stamp: str | None = None
    outcome: cdr.Outcome = field(default_factory=cdr.Outcome)
    known: set[Connection] = field(default_factory=set)
    texts: TextStore | None = None
    decoders: dict[Connection, cdr.Decoder] = field(default_factory=dict)
    readers: dict[Connection, TextDecoder | None] = field(default_factory=dict)
    walkers: dict[Connection, protobuf.Decoder] = field(default_factory=dict)
    mute: str = ""

    def add(self, blocks: list[Block]) -> None:
        """Decode the blocks of one buffer as one batch, in the order of their places."""
        for block in blocks:
            if block.connection is not self.last and block.connection not in self.known:
                self.known.add(block.connection)
                self.mute = self.mute or block.connection.why_not()
            self.last = block.connection
        if self.mute:
            return
        slots = _slots(blocks)
        count = sum(len(b.starts) for b in blocks)
        if slots[0] is None and count > _MOST_ROWS:
            for part in (slice(at, at + _MOST_ROWS) for at in range(0, count, _MOST_ROWS)):
                self.add([blocks[0].part(part)])
            return
        self.store.begin(count)
        for block, slot in zip(blocks, slots, strict=True):
            self._decode(block, slot)
        self.store.end()
        self._keep_stamps(blocks, slots, count)

    def _decode(self, block: Block, slots: NDArray[np.int64] | None) -> None:
        connection, places = block.connection, (block.data, block.starts, block.lengths)
        if connection.encoding in ("json", "protobuf"):
            for part in self._parts(connection, places):
                own = part if slots is None else replace(part, rows=slots[part.rows])
                self.store.add(own)
                if self.texts is not None and own.texts:
                    self.texts.add(own.rows + self.store.count, own.texts)
            return
        decoder = self.decoders.get(connection)
        if decoder is None:
            kind = connection.message_type()
            self.stamp = kind.stamp
            decoder = self.decoders[connection] = cdr.Decoder(kind, self.outcome, self.store)
        decoder.decode(*places, slots)
        if self.texts is not None:
            self._take_texts(self.texts, block, np.arange(len(block.starts)) if slots is None else slots)

    def _take_texts(self, texts: TextStore, block: Block, slots: NDArray[np.int64]) -> None:
        if block.connection not in self.readers:
            kind = block.connection.message_type()
            self.readers[block.connection] = TextDecoder(kind, texts) if has_texts(kind) else None
        reader = self.readers[block.connection]
        if reader is not None:
            reader.decode(block.data, block.starts, block.lengths, slots + self.store.count)

    def _parts(
        self, connection: Connection, places: tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]
    ) -> Iterable[cdr.Part]:
        if connection.encoding == "json":
            stamp, parts = json_messages.decode(*places, self.outcome, texts=self.texts is not None)
            self.stamp = stamp or self.stamp
            return parts
        walker = self.walkers.get(connection)
        if walker is None:
            schema = connection.protobuf_schema()
            self.stamp = schema.stamp and schema.stamp[0]
            walker = self.walkers[connection] = protobuf.Decoder(schema, self.outcome)
        return chain(walker.decode(*places), text_parts(walker.schema, *places) if self.texts is not None else ())

    def _keep_stamps(self, blocks: list[Block], slots: list[NDArray[np.int64] | None], count: int) -> None:
        """Copy the container's stamps; publish stamps only where they are asked for."""
        at = self.stamps.open(count)
        cells = self.stamps.grid.cells[3].view(np.int64)[:, at : at + count]
        for block, slot in zip(blocks, slots, strict=True):
            where = slice(None) if slot is None else slot
            cells[0, where] = block.log_ns
            if len(cells) > 1:
                cells[1, where] = block.log_ns if block.publish_ns is None else block.publish_ns
        self.stamps.close(None, count, self.stamps.count)


def _slots(blocks: list[Block]) -> list[NDArray[np.int64] | None]:
    """Rows of a batch that each block's messages are; None where a block is the whole batch in order."""
    starts = [b.starts for b in blocks]
    if len(blocks) == 1 and np.all(starts[0][1:] >= starts[0][:-1]):
        return [None]
    order = np.argsort(np.concatenate(starts), kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return list(np.split(rank, np.cumsum([len(s) for s in starts])[:-1]))


class Assembler:
    """Collects blocks and builds the `RawLog`, with the messages' texts where they are asked for."""

    def __init__(self, clock: Clock, report: Report, texts: bool = False) -> None:
        self.clock, self.report, self.texts = clock, report, texts
        self.topics: dict[tuple[str, str], _Topic] = {}
        self.expected: dict[tuple[str, str], int] = {}
        self.stamps = (Spec("log", "i8"), Spec("publish", "i8"))[: 2 if clock == "publish" else 1]
        self.batches, self.budget = 0, Budget(MEMORY)
        self.clocks = Clocks(clock, report)
        self.robot_description = ""

    def expect(self, connection: Connection, count: int) -> None:
        """Foretell how many messages of a connection will come, which spares memory and time; it need not be true."""
        key = connection.topic, connection.type_name
        self.expected[key] = self.expected.get(key, 0) + count

    def add(self, arrived: Iterable[Block]) -> None:
        """Decode blocks; `starts` order messages within one call of one buffer, and nothing keeps the buffer."""
        batches: dict[tuple[str, str], list[Block]] = {}
        for block in arrived:
            batches.setdefault((block.connection.topic, block.connection.type_name), []).append(block)
        for key, batch in batches.items():
            self.robot_description = description_in(batch) or self.robot_description
            topic = self.topics.get(key)
            if topic is None:
                count = self.expected.get(key, 0)
                stamps = Table(0, self.stamps, self.report.store, count, self.budget)
                topic = self.topics[key] = _Topic(
                    batch[0].connection, Store(count, self.budget, self.report.store), stamps,
                    texts=TextStore() if self.texts else None,
                )  # fmt: skip
            topic.add([_within_range(b, self.report) for b in batch])
        self.batches += 1
        if self.batches % _LOOK_EVERY == 0:
            self._spill()

    def _spill(self) -> None:
        """Send the largest topics to temporary files once all together are too large for memory."""
        held = {key: t.store.held + t.stamps.held for key, t in self.topics.items()}
        total = sum(held.values())
        while total > MEMORY:
            largest = max(held, key=lambda key: held[key])
            self.topics[largest].store.spill()
            self.topics[largest].stamps.spill()
            total -= held.pop(largest)

    def finish(self, summary: LogSummary) -> RawLog:
        """Build the channels and complete the summary's notes and damage."""
        channels: dict[str, Channel] = {}
        seen: set[str] = set()
        for name, type_name in list(self.topics):
            topic = self.topics.pop((name, type_name))
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
        return RawLog(
            summary.source, summary.format, self.clock, channels, summary, self.report.store, self.robot_description
        )

    def _channels(self, label: str, topic: _Topic) -> Iterable[Channel]:
        count = topic.store.count
        columns = topic.store.finish()
        texts = {} if topic.texts is None else topic.texts.finish(count)
        self._say(label, topic)
        if topic.mute or not count:
            return
        log, *publish = topic.stamps.finish()[1]
        header = _take_header(topic.stamp, columns, count, topic.outcome.bad, self.report.store)
        stamps = self.clocks.stamps(label, header, log, publish[0] if publish else log)
        shared: dict[int, tuple[NDArray[np.int64], NDArray[np.int64]]] = {}
        columns |= {path if path not in columns else f"{path} (text)": cells for path, cells in texts.items()}
        for path, (rows, values) in columns.items():
            at = stamps
            if rows is not None:
                if id(rows) not in shared:
                    shared[id(rows)] = rows, stamps[rows]
                at = shared[id(rows)][1]
            yield Channel(f"{label}.{path}", label, path, at, values, None, topic.connection.type_name)

    def _say(self, label: str, topic: _Topic) -> None:
        report, outcome = self.report, topic.outcome
        skipped = sorted(topic.store.skipped | (topic.texts.skipped if topic.texts is not None else set()))
        lost = sum(reader.bad > GIVE_UP for reader in topic.readers.values() if reader is not None)
        if lost:
            report.note(
                f"{label}: more than {GIVE_UP} messages do not fit their definition; texts of others may be missing"
            )
        if topic.mute:
            report.note(f"{label} is not decoded: {topic.mute}")
        for walker in topic.walkers.values():
            for text in walker.schema.notes:
                report.note(f"{label}: {text}")
        if skipped:
            more = f" and {len(skipped) - 5} more" if len(skipped) > 5 else ""
            report.note(
                f"{label}: left out arrays of more than {MAX_ELEMENTS} elements: {', '.join(skipped[:5])}{more}"
            )
        if outcome.bad:
            text = f"{label}: {outcome.bad} of {topic.store.count} messages cannot be decoded: {outcome.reason}"
            guessed = not topic.connection.definition and outcome.bad == topic.store.count
            (report.note if guessed else report.lost)(text)
        if outcome.slow > _SLOW_SHARE * max(topic.store.count, 1):
            report.note(
                f"{label}: {outcome.slow} of {topic.store.count} messages change their layout; decoded one by one"
            )


def _take_header(
    path: str | None, columns: dict[str, Cells], count: int, bad: int, store: ColumnStore
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Take the header stamp out of the columns: rows that should have one, and stamps of all rows [ns], 0 for none."""
    sec, nsec = (columns.pop(f"{path}.{part}", None) for part in ("sec", "nanosec"))
    if sec is None or nsec is None or len(sec[1]) != len(nsec[1]):
        return None
    whole = store.map(_nanoseconds, sec[1], nsec[1])
    if sec[0] is not None:
        header = np.zeros(count, np.int64)
        header[sec[0]] = whole
        return sec[0] if len(whole) >= count - bad else np.arange(count), header
    return np.arange(count), whole if whole.all() else np.array(whole)  # zeros are filled in later, never in a map


def _nanoseconds(sec: NDArray[Any], nanosec: NDArray[Any]) -> NDArray[np.int64]:
    stamps = sec.astype(np.int64)
    stamps *= 1_000_000_000
    stamps += nanosec.astype(np.int64)
    return stamps


def _within_range(block: Block, report: Report) -> Block:
    """Drop messages whose unsigned log stamp does not fit 63 bits."""
    late = block.log_ns < 0
    if not late.any():
        return block
    report.lost(f"{block.connection.topic}: {late.sum()} messages with impossible log stamps were left out")
    return block.part(~late)
