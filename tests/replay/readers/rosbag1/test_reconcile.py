"""What the parts of a bag say of one another: whichever field is changed, the reader says that they disagree."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from replay.border import UnforeseenContent
from replay.errors import LogError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log
from replay.readers.rosbag1.records_kernel import CHUNK, CONNECTION, INDEX, INFO, MESSAGE, scan_bag

OPTIONS = SourceOptions()
T0 = 1_700_000_000_000_000_000
COUNT = 20


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Three topics in some chunks."""
    path, types = tmp_path_factory.mktemp("bag") / "a.bag", get_typestore(Stores.ROS1_NOETIC)
    kinds = ("std_msgs/msg/Float64", "std_msgs/msg/Int32", "std_msgs/msg/Float64")
    writer = Writer(path)
    writer.chunk_threshold = 500
    with writer:
        known = [writer.add_connection(f"/t{k}", kind, typestore=types) for k, kind in enumerate(kinds)]
        for i in range(COUNT):
            for connection, kind in zip(known, kinds, strict=True):
                writer.write(connection, T0 + i * 10**7, types.serialize_ros1(types.types[kind](i), kind))
    return path.read_bytes()


def content(log: RawLog) -> dict[str, tuple[bytes, bytes]]:
    return {name: (c.stamps.tobytes(), np.asarray(c.values).tobytes()) for name, c in log.channels.items()}


def changed(raw: bytes, at: int, data: bytes) -> bytes:
    return raw[:at] + data + raw[at + len(data) :]


def field(raw: bytes, start: int, name: bytes) -> int:
    """Place of a header field's value behind `start`."""
    return raw.index(name + b"=", start) + len(name) + 1


def first(raw: bytes, op: int) -> int:
    records = scan_bag(np.frombuffer(raw, np.uint8), 13)
    return int(records.head[np.argmax(records.op == op)])


CASES: list[tuple[Callable[[bytes], bytes], str]] = [
    (lambda r: changed(r, first(r, INFO) + 4 + r[first(r, INFO) - 4] + 4, bytes([99])), "the index section counts"),
    (lambda r: changed(r, field(r, first(r, INDEX), b"count"), bytes([9])), "states 9 messages and holds"),
    (lambda r: changed(r, field(r, first(r, INFO), b"start_time"), bytes([9])), "the index section says"),
    (lambda r: changed(r, field(r, first(r, INFO), b"chunk_pos"), bytes([9])), "does not list the chunk at byte"),
    (lambda r: changed(r, field(r, first(r, CHUNK), b"time"), bytes([9])), "not as the index behind it says"),
    (lambda r: changed(r, field(r, first(r, CONNECTION), b"conn"), bytes([9])), "the index section does not list it"),
    (lambda r: changed(r, field(r, 13, b"chunk_count"), bytes([99])), "it should hold 3 connections and 99 chunks"),
    (lambda r: changed(r, field(r, 13, b"conn_count"), bytes([99])), "it should hold 99 connections"),
]


@pytest.mark.parametrize(("change", "said"), CASES)
def test_a_contradiction_is_told(tmp_path: Path, sound: bytes, change: Callable[[bytes], bytes], said: str) -> None:
    path = tmp_path / "a.bag"
    path.write_bytes(change(sound))
    damage = read_log(path, OPTIONS).summary.damage
    assert any(said in text for text in damage), damage


def test_the_quick_list_believes_no_index_that_contradicts_the_chunks(tmp_path: Path, sound: bytes) -> None:
    path, at = tmp_path / "a.bag", first(sound, INFO)
    path.write_bytes(changed(sound, at + 4 + sound[at - 4] + 4, struct.pack("<I", 1000)))
    summary = summarise_log(path, OPTIONS)
    assert [t.count for t in summary.topics] == [COUNT] * 3
    assert any("the index section counts" in text for text in summary.damage)


def test_a_chunk_that_the_index_places_beyond_the_file(tmp_path: Path, sound: bytes) -> None:
    path, at = tmp_path / "a.bag", field(sound, first(sound, INFO), b"chunk_pos")
    for far in (len(sound), 2**31, 2**62, 2**63 - 1, 2**64 - 1):
        path.write_bytes(changed(sound, at, struct.pack("<Q", far)))
        assert summarise_log(path, OPTIONS).damage
        assert any(f"no chunk at byte {far}" in text for text in read_log(path, OPTIONS).summary.damage)


def test_no_changed_bit_outside_of_payloads_changes_what_is_read_in_silence(tmp_path: Path, sound: bytes) -> None:
    path = tmp_path / "a.bag"
    path.write_bytes(sound)
    log = read_log(path, OPTIONS)
    right, topics = content(log), [(t.name, t.count) for t in log.summary.topics]
    assert not log.summary.damage
    payload = set[int]()
    records = scan_bag(np.frombuffer(sound, np.uint8), 13)
    for i in np.flatnonzero(records.op == CHUNK).tolist():
        body = int(records.body[i])
        inner = scan_bag(np.frombuffer(sound[body : body + int(records.size[i])], np.uint8))
        for j in np.flatnonzero(inner.op == MESSAGE).tolist():
            payload.update(range(body + int(inner.body[j]), body + int(inner.body[j] + inner.size[j])))
    rng = np.random.default_rng(11)
    places = [at for at in range(13, len(sound)) if at not in payload and not 150 < at < 4109]
    for at in rng.choice(places, 150, replace=False).tolist():
        path.write_bytes(changed(sound, at, bytes([sound[at] ^ 1 << int(rng.integers(8))])))
        try:
            log, summary = read_log(path, OPTIONS), summarise_log(path, OPTIONS)
        except UnforeseenContent:
            raise
        except LogError:
            continue
        told = [*log.summary.damage, *(t for t in log.summary.notes if "another name" in t)]
        assert told or content(log) == right, f"byte {at}"
        told = [*summary.damage, *(t for t in summary.notes if "another name" in t)]
        assert told or [(t.name, t.count) for t in summary.topics] == topics, f"byte {at}"
