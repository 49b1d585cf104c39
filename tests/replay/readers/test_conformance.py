"""Every record of the MCAP conformance files, and of files that the mcap package wrote, comes out of our own walk."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

from replay.log.source_options import SourceOptions
from replay.readers.mcap.records import Message, Record
from replay.readers.registry import read_log, summarise_log
from tests.replay.readers.mcap_records import records_of

OPTIONS = SourceOptions()


def as_text(value: Any) -> Any:
    """Values as the expected files write them: numbers as text, bytes as a list of numbers."""
    if isinstance(value, bytes):
        return [str(b) for b in value]
    if isinstance(value, dict):
        return {str(k): v if isinstance(v, str) else str(v) for k, v in value.items()}
    return str(value)


def as_json(record: Record) -> dict[str, Any]:
    """A record as in the expected files, which name every field but the checksum of an attachment."""
    kind = type(record).__name__
    names = sorted(f.name for f in fields(record) if (kind, f.name) != ("Attachment", "crc"))
    return {"type": kind, "fields": [[n, as_text(getattr(record, n))] for n in names]}


def test_conformance_files_give_the_expected_records(reference_data: Path) -> None:
    paths = sorted((reference_data / "mcap_conformance").rglob("*.mcap"))
    assert len(paths) >= 400
    failed = []
    for path in paths:
        expected = json.loads(path.with_suffix(".json").read_text())["records"]
        if [as_json(r) for r in records_of(path)] != expected:
            failed.append(path.name)
    assert failed == []


def test_conformance_files_are_read_whole_and_without_damage(reference_data: Path) -> None:
    for path in sorted((reference_data / "mcap_conformance").rglob("*.mcap")):
        records = json.loads(path.with_suffix(".json").read_text())["records"]
        stamps = [int(dict(r["fields"])["log_time"]) for r in records if r["type"] == "Message"]
        for summary in (summarise_log(path, OPTIONS), read_log(path, OPTIONS).summary):
            assert sum(t.count for t in summary.topics) == len(stamps), path.name
            assert summary.damage == (), path.name
            if stamps:
                assert (summary.start_ns, summary.stop_ns) == (min(stamps), max(stamps)), path.name
        assert len(summary.attachments) == sum(r["type"] == "Attachment" for r in records), path.name


@pytest.fixture(params=[CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD, None])
def written(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A file with everything in it; None writes no chunks."""
    path = tmp_path / "all.mcap"
    with path.open("wb") as file:
        writer = Writer(
            file, chunk_size=700, compression=request.param or CompressionType.NONE, index_types=IndexType.ALL,
            use_chunking=request.param is not None, enable_data_crcs=True,
        )  # fmt: skip
        writer.start("profile", "library")
        for k in range(3):
            schema = writer.register_schema(f"p/msg/T{k}", "ros2msg", b"float64 data") if k else 0
            channel = writer.register_channel(f"/t{k}", "cdr", schema, {"k": str(k)})
            for i in range(40):
                writer.add_message(channel, 1000 * i + k, bytes([0, 1, 0, 0, *range(8)]), 1000 * i, sequence=i)
        writer.add_attachment(5, 6, "notes.txt", "text/plain", b"hello")
        writer.add_metadata("machine", {"id": "H-7", "site": "Tampere"})
        writer.finish()
    return path


def test_records_are_those_that_the_mcap_package_finds(written: Path) -> None:
    with written.open("rb") as file:
        theirs = [r for r in StreamReader(file).records if type(r).__name__ != "MessageIndex"]
    ours = list(records_of(written))
    assert [type(r).__name__ for r in ours] == [type(r).__name__ for r in theirs]
    for mine, other in zip(ours, theirs, strict=True):
        names = [f.name for f in fields(mine) if f.name != "crc"]
        assert [getattr(mine, n) for n in names] == [getattr(other, n) for n in names]


def test_messages_are_those_that_the_mcap_package_reads(written: Path) -> None:
    with written.open("rb") as file:
        theirs = [m for _, _, m in make_reader(file).iter_messages(log_time_order=False)]
    ours = [r for r in records_of(written) if isinstance(r, Message)]
    assert len(ours) == 120
    assert sorted((m.channel_id, m.sequence, m.log_time, m.publish_time, m.data) for m in ours) == sorted(
        (m.channel_id, m.sequence, m.log_time, m.publish_time, bytes(m.data)) for m in theirs
    )


def test_attachments_and_metadata_are_in_the_summary(written: Path) -> None:
    quick, full = summarise_log(written, OPTIONS), read_log(written, OPTIONS).summary
    assert quick.metadata["machine.id"] == full.metadata["machine.id"] == "H-7"
    (found,) = full.attachments
    assert (found.name, found.media_type, found.size, found.create_ns, found.log_ns) == (
        "notes.txt", "text/plain", 5, 5, 6,
    )  # fmt: skip
    assert found.checksum == "right"
    assert [a.name for a in quick.attachments] == ["notes.txt"]
    assert full.damage == ()
