"""Values of damaged CDR messages as rosbags reads them, beside ours."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from mcap.reader import NonSeekingReader
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from replay.log.raw_log import RawLog
from tests.benchmarks.fuzzing.case import Finding


class Decoder:
    """Decodes messages of two types; only where their definitions are the sound ones.

    Parameters
    ----------
    text, idl : bytes
        Definitions of ``a/msg/J`` and ``a/msg/I``.
    """

    def __init__(self, text: bytes, idl: bytes) -> None:
        self._store = get_typestore(Stores.LATEST)
        self._store.register(get_types_from_msg(text.decode(), "a/msg/J"))
        self._store.register(get_types_from_idl(idl.decode()))
        self._sound = {text: ("a/msg/J", "effort"), idl: ("a/msg/I", "s")}

    def values(self, content: bytes, topic: str) -> np.ndarray[Any, Any] | None:
        """Rows of a topic's array that rosbags can read; None where one topic has several channels or another definition."""
        kinds, rows = set(), []
        for schema, channel, message in NonSeekingReader(io.BytesIO(content)).iter_messages(log_time_order=False):
            if channel.topic != topic:
                continue
            kinds.add(
                (channel.id, channel.message_encoding, schema.data if schema else b"", schema.name if schema else "")
            )
            known = self._sound.get(schema.data) if schema else None
            if (
                known is None
                or len(kinds) > 1
                or channel.message_encoding != "cdr"
                or schema is None
                or schema.name != known[0]
            ):
                return None
            try:
                rows.append(
                    np.asarray(getattr(self._store.deserialize_cdr(message.data, known[0]), known[1]), np.float64)[:4]
                )
            except Exception:  # what it makes of damage is its own
                continue
        whole = [row for row in rows if len(row) == (4 if topic == "/joints" else 2)]
        return np.array(whole) if rows and len(whole) == len(rows) else None


def compare(decoder: Decoder, content: bytes, log: RawLog) -> None:
    """Each value that rosbags reads of ``/joints.effort`` and ``/idl.s`` is among ours, bit for bit.

    Raises
    ------
    Finding
        Where one is not.
    """
    for topic, field in (("/joints", "effort"), ("/idl", "s")):
        theirs = decoder.values(content, topic)
        if theirs is None:
            continue
        for k in range(theirs.shape[1]):
            channel = log.channels.get(f"{topic}.{field}[{k}]")
            ours = (
                np.sort(np.asarray(channel.values, np.float64).view("u8")) if channel is not None else np.empty(0, "u8")
            )
            other = np.sort(theirs[:, k].copy().view("u8"))
            if len(ours) == len(other) and not np.array_equal(ours, other):
                raise Finding(
                    "silent",
                    f"{topic}.{field}[{k}]: {int((ours != other).sum())} of {len(ours)} values differ from those of rosbags",
                )
            if len(ours) < len(other):
                raise Finding("silent", f"{topic}.{field}[{k}]: {len(ours)} values; rosbags reads {len(other)}")
