"""Schemas and channels of an MCAP file, of which several copies may stand in it, some of them damaged."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from replay.readers.mcap import format as fmt
from replay.readers.mcap.records import BAD_RECORD, Channel, Schema, parse
from replay.readers.messages.connection import Connection

MAX_TEXT = 1 << 16


class Names:
    """The schemas and channels met so far.

    Copies of one record must agree. Where they do not, one that stood under a checksum is believed before one that did
    not, one among the data before the summary's, and the first among equals.

    Parameters
    ----------
    lost : Callable[[str, str], None]
        Takes the kind of a loss and its sentence.

    Attributes
    ----------
    named, ready : NDArray[np.uint8], shape (65536,)
        1 for channels that are known, and for those whose schema is known as well.
    """

    def __init__(self, lost: Callable[[str, str], None]) -> None:
        self._lost = lost
        self._known: dict[tuple[int, int], tuple[bytes, int]] = {}
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._connections: dict[int, Connection] = {}
        self.named: NDArray[np.uint8] = np.zeros(fmt.CHANNELS, np.uint8)
        self.ready: NDArray[np.uint8] = np.zeros(fmt.CHANNELS, np.uint8)

    @property
    def schema_count(self) -> int:
        """Number of schemas."""
        return len(self._schemas)

    @property
    def channels(self) -> dict[int, Connection]:
        """Connections by channel number, in the order met."""
        return {number: self._connection(number) for number in self._channels}

    @property
    def records(self) -> list[tuple[int, bytes]]:
        """Opcode and content of every schema and channel record that is believed, as it stands in the file."""
        return [(op, raw) for (op, _), (raw, _) in self._known.items()]

    def take(self, op: int, raw: bytes, verified: bool, place: str, data: bool = True) -> None:
        """Take a schema or channel record; a damaged one is said and left out.

        Parameters
        ----------
        op : int
            Its opcode.
        raw : bytes
            Its content.
        verified : bool
            Whether it stood under a checksum that is right.
        place : str
            Where it stood, in words.
        data : bool
            Whether it stood among the data, not in the summary.
        """
        key, rank = (op, int.from_bytes(raw[:2], "little")), 2 * verified + data
        known = self._known.get(key)
        if known is not None and known[0] == raw:
            self._known[key] = (raw, max(known[1], rank))
            return
        what = "schema" if op == fmt.SCHEMA else "channel"
        try:
            record = parse(op, raw)
            if isinstance(record, Channel) and len(record.topic) > MAX_TEXT:
                raise ValueError("a topic without end")
        except BAD_RECORD as error:
            self._lost("name", f"the {what} record {place} is damaged ({type(error).__name__})")
            return
        if known is not None:
            better = rank > known[1]
            if record != (self._schemas if op == fmt.SCHEMA else self._channels)[key[1]]:
                taken = "the one" if better else "the first, not the one"
                self._lost("name", f"two copies of {what} {key[1]} differ; {taken} {place} was taken")
            if not better:
                return
        self._known[key] = (raw, rank)
        self._connections.clear()
        if isinstance(record, Schema):
            self._schemas[record.id] = record
            self.ready[[c.id for c in self._channels.values() if c.schema_id == record.id]] = 1
        elif isinstance(record, Channel):
            self._channels[record.id] = record
            self.named[record.id] = 1
            self.ready[record.id] = not record.schema_id or record.schema_id in self._schemas

    def connection(self, number: int) -> Connection | None:
        """Return the connection of a channel, or None where it is not named."""
        return self._connection(number) if number in self._channels else None

    def _connection(self, number: int) -> Connection:
        if number not in self._connections:
            channel = self._channels[number]
            schema = self._schemas.get(channel.schema_id)
            if schema is None:
                schema = Schema(0, "", "", b"")
            text = schema.data.decode(*(("latin-1",) if schema.encoding == "protobuf" else ("utf-8", "replace")))
            self._connections[number] = Connection(
                channel.topic, schema.name, channel.message_encoding, schema.encoding, text
            )
        return self._connections[number]

    def without_schema(self) -> list[str]:
        """Topics whose schema is named but not in the file."""
        return [c.topic for c in self._channels.values() if c.schema_id and c.schema_id not in self._schemas]

    def topic(self, number: int) -> str:
        """Topic of a channel, or its number where it is not named."""
        channel = self._channels.get(number)
        return f"channel {number}" if channel is None else channel.topic
