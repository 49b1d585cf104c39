"""Parts of MCAP logs, copied as they are and read back by another reader."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from replay.export.clips.mcap import Definitions, batch_records, write_clip
from replay.export.clips.source import ClipSource
from replay.export.clips.topics import columns_topic
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def recorded(path: Path, **options: Any) -> Path:
    """10 s of two topics: 20 Hz of odd sizes with a schema, and one large message a second without one."""
    stream = io.BytesIO()
    writer = Writer(stream, **options)
    writer.start(profile="x", library="y")
    schema = writer.register_schema("pkg/Thing", "ros2msg", b"uint8[] data\n\xff")
    small = writer.register_channel("/small", "cdr", schema, {"qos": "1"})
    large = writer.register_channel("/large", "raw", 0)
    for i in range(200):
        at = START + i * SECOND // 20
        writer.add_message(small, at, bytes([i]) * (i % 7), at - 5, sequence=i)
        if i % 20 == 0:
            writer.add_message(large, at + 1, bytes(50_000 + i), at + 1)
    writer.finish()
    path.write_bytes(stream.getvalue())
    return path


def messages(path: Path, first: int = 0, last: int = 2**62) -> Iterator[tuple[Any, ...]]:
    with path.open("rb") as file:
        for schema, channel, m in make_reader(file, validate_crcs=True).iter_messages():
            if first <= m.log_time < last:
                kind = None if schema is None else (schema.name, schema.encoding, schema.data)
                names = (channel.topic, channel.message_encoding, tuple(channel.metadata.items()))
                yield (*names, kind, m.log_time, m.publish_time, m.sequence, m.data)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"chunk_size": 1000, "compression": CompressionType.LZ4},
        {"use_chunking": False},
        {"enable_crcs": False, "compression": CompressionType.NONE},
    ],
)
def test_messages_of_a_part_are_those_of_the_log(options: dict[str, Any], tmp_path: Path) -> None:
    log = recorded(tmp_path / "log.mcap", **options)
    source, definitions = ClipSource(log, "/small"), Definitions()
    assert source.log_stamps.tolist() == [START + i * SECOND // 20 for i in range(200)]
    first, last = START + 2 * SECOND, START + 7 * SECOND
    numbers = source.define(definitions)
    count = write_clip(tmp_path / "clip.mcap", definitions, source.messages(first, last, numbers), {"a": "b"})
    kept = list(messages(tmp_path / "clip.mcap"))
    assert sorted(kept, key=repr) == sorted(messages(log, first, last), key=repr)
    assert count == len(kept) == 105
    with (tmp_path / "clip.mcap").open("rb") as file:
        reader = make_reader(file)
        assert [(m.name, m.metadata) for m in reader.iter_metadata()] == [("mfhca_clip", {"a": "b"})]
        summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 105
    assert not read_log(tmp_path / "clip.mcap", SourceOptions()).summary.damage


def test_names_that_stand_among_the_messages_alone_are_found(tmp_path: Path) -> None:
    plain, bare = (
        recorded(tmp_path / f"{word}.mcap", repeat_channels=word, repeat_schemas=word) for word in (True, False)
    )
    clips = []
    for log in (plain, bare):
        source, definitions = ClipSource(log, ""), Definitions()
        numbers = source.define(definitions)
        clips.append(log.with_suffix(".clip"))
        write_clip(clips[-1], definitions, source.messages(START, START + SECOND, numbers), {})
    assert clips[0].read_bytes() == clips[1].read_bytes()


def test_two_logs_with_equal_channel_numbers_stand_side_by_side(tmp_path: Path) -> None:
    logs = [recorded(tmp_path / f"{name}.mcap") for name in "ab"]
    definitions = Definitions()
    parts = []
    for log in logs:
        source = ClipSource(log, "")
        parts += source.messages(START, START + SECOND, source.define(definitions))
    batch = columns_topic("/own", {"x": np.arange(3.0)}, START + np.arange(3))
    own = batch_records(batch, definitions)
    write_clip(tmp_path / "clip.mcap", definitions, [own, *parts], {})
    kept = list(messages(tmp_path / "clip.mcap"))
    assert len(kept) == 3 + 2 * 21
    assert sorted(k for k in kept if k[0] == "/small")[::2] == sorted(
        m for m in messages(logs[0], START, START + SECOND) if m[0] == "/small"
    )
    assert [c.topic for c in definitions.channels] == ["/small", "/large", "/small", "/large", "/own"]


def test_a_cut_off_log_gives_the_messages_that_it_still_holds(tmp_path: Path) -> None:
    log = recorded(tmp_path / "log.mcap", chunk_size=1000)
    octets = log.read_bytes()
    log.write_bytes(octets[: len(octets) // 2])
    source, definitions = ClipSource(log, "/small"), Definitions()
    numbers = source.define(definitions)
    count = write_clip(tmp_path / "clip.mcap", definitions, source.messages(START, START + 10 * SECOND, numbers), {})
    assert 0 < count < 210
    assert len(list(messages(tmp_path / "clip.mcap"))) == count


def test_a_part_without_messages_is_a_whole_file(tmp_path: Path) -> None:
    source, definitions = ClipSource(recorded(tmp_path / "log.mcap"), "/small"), Definitions()
    numbers = source.define(definitions)
    assert write_clip(tmp_path / "clip.mcap", definitions, source.messages(0, 5, numbers), {}) == 0
    assert list(messages(tmp_path / "clip.mcap")) == []
