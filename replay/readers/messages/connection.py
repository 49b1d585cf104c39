"""What a container hands over: streams of messages of one type, and blocks of their messages."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from replay.readers.messages.definitions import DefinitionError, MessageType, resolve
from replay.readers.messages.protobuf_schema import Schema, schema_of


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

    def part(self, kept: NDArray[np.bool_] | slice) -> Block:
        """Some of its messages. `kept` are flags of shape (messages,)."""
        publish = None if self.publish_ns is None else self.publish_ns[kept]
        return replace(
            self, starts=self.starts[kept], lengths=self.lengths[kept], log_ns=self.log_ns[kept], publish_ns=publish
        )
