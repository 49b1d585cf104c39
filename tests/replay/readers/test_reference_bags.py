"""Every recorded bag gives the messages and numbers that rosbags gives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag2 import Reader as Reader2
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log

OPTIONS = SourceOptions()
EVERY = 31
CALLS = "/_service_event"


def logs(folder: Path) -> list[Path]:
    bags = [p for p in folder.rglob("*.bag") if p.stat().st_size]
    folders = [p.parent for p in folder.rglob("metadata.yaml") if "wrong_rmw" not in str(p)]
    return sorted([*bags, *folders])


def deserialiser(connection: Any, ros1: bool) -> Callable[[bytes], Any] | None:
    """Build rosbags' own decoding of one connection, or None where it knows no definition."""
    store = get_typestore(Stores.EMPTY if connection.msgdef.data else Stores.LATEST)
    name = connection.msgtype
    try:
        if connection.msgdef.format == MessageDefinitionFormat.IDL:
            store.register(get_types_from_idl(connection.msgdef.data))
        elif connection.msgdef.data:
            store.register(get_types_from_msg(connection.msgdef.data, name))
        if name not in store.types:
            return None
    except Exception:  # a definition that rosbags cannot read
        return None
    decode = store.deserialize_ros1 if ros1 else store.deserialize_cdr
    return lambda raw: decode(raw, name)


def test_every_log_gives_the_messages_of_rosbags(reference_data: Path, flatten: Callable[..., dict[str, Any]]) -> None:
    compared: Counter[str] = Counter()
    found = logs(reference_data / "reference_logs")
    assert len(found) > 25
    for path in found:
        ros1 = path.suffix == ".bag"
        log = read_log(path, OPTIONS, clock="log")
        topics = {t.name: t.count for t in log.summary.topics}
        assert {t.name: t.count for t in summarise_log(path, OPTIONS).topics} == topics
        order = {c.topic: np.argsort(c.stamps, kind="stable") for c in log.channels.values()}
        rows: Counter[str] = Counter()
        decoders: dict[Any, Any] = {}
        with (Reader1 if ros1 else Reader2)(path) as reader:
            for connection, stamp, raw in reader.messages():
                topic, row = connection.topic, rows[connection.topic]
                rows[topic] += 1
                if row % EVERY or topic not in order or topic.endswith(CALLS):
                    continue
                if connection.id not in decoders:
                    decoders[connection.id] = deserialiser(connection, ros1)
                decode = decoders[connection.id]
                if decode is None:
                    continue
                for field, theirs in flatten(decode(raw)).items():
                    channel = log.channels.get(f"{topic}.{field}")
                    if channel is not None and len(channel.values) == topics[topic]:
                        mine = channel.values[order[topic][row]]
                        # arrays of byte are signed in rosbags
                        value = theirs.astype(mine.dtype) if isinstance(theirs, np.int8) else theirs
                        np.testing.assert_array_equal(mine, value)
                        assert channel.stamps[order[topic][row]] == stamp
                        compared[topic] += 1
            stated: Counter[str] = Counter()
            for connection in reader.connections:
                stated[connection.topic] += connection.msgcount
        assert topics == stated, path
        assert all(topics[t] >= n for t, n in rows.items())  # rosbags gives nothing of MCAP without message index
    assert sum(compared.values()) > 10_000
    assert {"/odometry", "/gps", "/turtle1/pose", "/imu/data"} <= compared.keys()
