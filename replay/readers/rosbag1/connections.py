"""Connection records of a ROS 1 bag: topic, type and definition, and which of two copies is right."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from replay.readers.messages.connection import Connection
from replay.readers.messages.definitions import checksum
from replay.readers.rosbag1.bag import Bag
from replay.readers.rosbag1.records_kernel import BagRecords

#: What reading a damaged header raises.
DAMAGED = (struct.error, KeyError, ValueError)
MAX_TEXT = 1 << 20


def fields_of(raw: bytes) -> dict[str, bytes]:
    """Header fields ``name=value`` of one record."""
    out, at = {}, 0
    while at + 4 <= len(raw):
        (size,) = struct.unpack_from("<I", raw, at)
        name, _, value = raw[at + 4 : at + 4 + size].partition(b"=")
        out[name.decode("ascii", "replace")] = value
        at += 4 + size
    return out


def take_connection(bag: Bag, data: NDArray[np.uint8], records: BagRecords, i: int) -> None:
    """Take a connection record; of two copies that differ, the one that its checksum confirms.

    `data` of shape (bytes,).
    """
    head, body, size, number = (int(a[i]) for a in (records.head, records.body, records.size, records.conn))
    raw = data[head : body + min(size, MAX_TEXT)].tobytes()
    if bag.raw.get(number) == raw:
        return
    try:
        topic = fields_of(raw[: body - 4 - head])["topic"].decode("utf-8", "replace")
        inner = fields_of(raw[body - head :])
        text = inner["message_definition"].decode("utf-8", "replace")
        name = inner["type"].decode("ascii", "replace")
        own = inner.get("topic", b"").decode("utf-8", "replace")
        connection = Connection(topic, name, "ros1", "ros1msg", text)
    except DAMAGED as error:
        bag.lost(f"a record of connection {number} is damaged ({type(error).__name__})")
        return
    if own and own != topic:  # tools that rename topics leave the publisher's header as it was; so does damage
        bag.renamed[number] = topic, own
    known = bag.connections.get(number)
    bag.raw.setdefault(number, raw)
    if known is None:
        bag.connections[number] = connection
    elif known != connection:
        bag.lost(f"two records of connection {number} ({known.topic[:80]!r}) differ")
        if not _confirmed(bag.raw[number], known) and _confirmed(raw, connection):
            bag.connections[number], bag.raw[number] = connection, raw


def _confirmed(raw: bytes, connection: Connection) -> bool:
    """Whether the checksum in a connection record is that of its definition."""
    digest = checksum(connection.definition, connection.type_name)
    return bool(digest) and digest.encode() in raw
