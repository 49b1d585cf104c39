"""The one text of a log that is more than a signal: the description of the robot that it was recorded on."""

from __future__ import annotations

from collections.abc import Sequence

from replay.readers.messages.connection import Block, Connection

_LARGEST = 16 << 20
_HEAD = 4  # of a CDR payload


def is_description(topic: str, type_name: str) -> bool:
    """Whether a topic holds the description of a robot (URDF) as text."""
    return topic.rstrip("/").rpartition("/")[2] == "robot_description" and type_name.rpartition("/")[2] == "String"


def description_in(blocks: Sequence[Block]) -> str:
    """Text of the last message of blocks of one topic; empty where they hold none.

    Parameters
    ----------
    blocks : Sequence[Block]
        Of one topic and type.
    """
    for block in reversed(blocks):
        if not is_description(block.connection.topic, block.connection.type_name) or not len(block.starts):
            continue
        start, length = int(block.starts[-1]), int(block.lengths[-1])
        text = _text(block.data[start : start + min(length, _LARGEST)].tobytes(), block.connection)
        if text:
            return text
    return ""


def _text(payload: bytes, connection: Connection) -> str:
    """The string of a ``std_msgs/String``."""
    at = 0 if connection.encoding == "ros1" else _HEAD
    if connection.encoding not in ("ros1", "cdr") or len(payload) < at + 4:
        return ""
    little = connection.encoding == "ros1" or bool(payload[1] & 1)
    length = int.from_bytes(payload[at : at + 4], "little" if little else "big")
    return payload[at + 4 : at + 4 + length].rstrip(b"\0").decode("utf-8", "replace")
