"""MCAP: records, chunks, summary and messages damaged in their places, with checksums made right again or not."""

from __future__ import annotations

import io
import json
import random
import struct
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, IndexType, Writer

from tests.benchmarks.fuzzing import logs, mcap_file
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.damage import Spot, blindly, reworded, spliced, with_number
from tests.benchmarks.fuzzing.mcap_file import CHUNK, Record
from tests.benchmarks.fuzzing.mcap_made import made_up
from tests.benchmarks.fuzzing.mcap_values import Decoder, compare

T0, COUNT = 1_760_000_000_000_000_000, 40
JOINTS = "builtin_interfaces/Time stamp\nstring frame\nstring[] name\nfloat64[] velocity\nfloat32[4] effort\nuint8[<=8] mode\na/E[] e\n"
JOINTS += (
    "=" * 80
    + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    + "=" * 80
    + "\nMSG: a/E\nbool on\nstring w\n"
)
IDL = "module a { module msg { @appendable struct I { double v; sequence<short, 5> s; string<9> t; }; }; };"
OPTIONS: dict[str, dict[str, Any]] = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "none": {"compression": CompressionType.NONE},
    "unindexed": {"compression": CompressionType.ZSTD, "index_types": IndexType.NONE, "use_statistics": False},
    "without checksums": {"compression": CompressionType.NONE, "enable_crcs": False},
    "unchunked": {"use_chunking": False, "enable_data_crcs": True},
}


def _text(value: str) -> bytes:
    raw = value.encode() + b"\0"
    return struct.pack("<I", len(raw)) + raw + bytes(-len(raw) % 4)


def _joints(i: int) -> bytes:
    body = struct.pack("<iI", T0 // 10**9 + i // 100, i % 100 * 10**7) + _text("base")
    names = [_text("fr"), _text("fl" * (i % 3))]
    body += struct.pack("<I", 2) + b"".join(names) + struct.pack("<I", 2)
    body += bytes(-len(body) % 8) + struct.pack("<dd4fI", i, -i, 1, 2, 3, 4, i % 4) + bytes(range(i % 4))
    body += (
        bytes(-len(body) % 4)
        + struct.pack("<I", i % 2)
        + (b"\1" + bytes(3) + struct.pack("<I", 1) + bytes(1)) * (i % 2)
    )
    return b"\0\1\0\0" + body


def _idl(i: int) -> bytes:
    return b"\0\1\0\0" + struct.pack("<dIhh", i, 2, i, -i) + _text("on")


def _descriptor() -> bytes:
    kind, files = descriptor_pb2.FieldDescriptorProto, descriptor_pb2.FileDescriptorSet()
    file = files.file.add(name="a.proto", package="a", syntax="proto3")
    inner = file.message_type.add(name="In")
    inner.field.add(name="x", number=1, type=kind.TYPE_DOUBLE, label=kind.LABEL_OPTIONAL)
    whole = file.message_type.add(name="P")
    for number, (name, letter) in enumerate([("d", "DOUBLE"), ("z", "SINT64"), ("t", "STRING"), ("u", "UINT32")], 1):
        whole.field.add(name=name, number=number, type=getattr(kind, f"TYPE_{letter}"), label=kind.LABEL_OPTIONAL)
    whole.field.add(name="f", number=5, type=kind.TYPE_FLOAT, label=kind.LABEL_REPEATED)
    whole.field.add(name="i", number=6, type=kind.TYPE_MESSAGE, type_name=".a.In", label=kind.LABEL_REPEATED)
    return bytes(files.SerializeToString(deterministic=True))


def _protobuf(i: int) -> bytes:
    floats = struct.pack("<3f", 1, i, 2)
    inner = b"\x09" + struct.pack("<d", i)
    head = b"\x09" + struct.pack("<d", i) + b"\x10" + bytes([2 * (i % 60)]) + b"\x1a\x02ab"
    return head + b"\x20\x05" + b"\x2a\x0c" + floats + b"\x32\x09" + inner


def _json(i: int) -> bytes:
    return json.dumps(
        {"stamp": {"sec": T0 // 10**9 + i, "nsec": 5}, "v": [i, i / 7], "on": True, "s": "é\n", "o": None}
    ).encode()


TOPICS = (
    ("/f", "cdr", "std_msgs/msg/Float64", "ros2msg", b"float64 data", lambda i: b"\0\1\0\0" + struct.pack("<d", i)),
    ("/joints", "cdr", "a/msg/J", "ros2msg", JOINTS.encode(), _joints),
    ("/idl", "cdr", "a/msg/I", "ros2idl", IDL.encode(), _idl),
    ("/ros1", "ros1", "a/R", "ros1msg", b"float64 data\nstring s\nint16[] k", lambda i: struct.pack("<dI2sIh", i, 2, b"hi", 1, i)),
    ("/proto", "protobuf", "a.P", "protobuf", None, _protobuf),
    ("/json", "json", "J", "jsonschema", b'{"type":"object"}', _json),
)  # fmt: skip


@cache
def _decoder() -> Decoder:
    return Decoder(JOINTS.encode(), IDL.encode())


class Mcap:
    """MCAP files of all encodings, with and without compression, chunks, index and checksums."""

    name = "mcap"

    def corpus(self, folder: Path) -> list[Sample]:
        """One file for each way of writing; each encoding alone, and all together."""
        samples = []
        for name, options in OPTIONS.items():
            alone = [[k] for k in range(1, 6)] if name == "none" else []  # definitions in IDL take long to parse
            for topics in ([0], [0, 1, 3, 4, 5], *alone):
                raw = _written(options, topics)
                facts = {"counts": {TOPICS[k][0]: COUNT for k in topics}, "records": mcap_file.split(raw)}
                facts["checked"] = name not in ("without checksums",)
                samples.append(Sample(f"{name} {topics}", {"log.mcap": raw}, "log.mcap", "log.mcap", facts))
        for k, sample in enumerate(samples):
            sample.facts["other"] = samples[k - 1]
        return samples

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Made up, blind damage, spliced, or one to three damages of records, sealed or not."""
        way, other = source.random(), sample.facts["other"]
        if way < 0.15:
            return made_up(source)
        if way < 0.2:
            return Case(*spliced(sample.raw, other.raw, source), {"sealed": True})
        if source.random() < 0.25:
            content, what = blindly(sample.raw, source)
            return Case(content, what, {"sealed": False})
        records: list[Record] = [r.copy() for r in sample.facts["records"]]
        if way < 0.3:
            return _mixed(records, other.facts["records"], source)
        seal, places = source.random() < 0.7, source.random() < 0.6
        done = []
        for _ in range(source.choice((1, 1, 1, 2, 3))):
            chunks = [r for r in records if r.op == CHUNK and r.inner]
            if chunks and source.random() < 0.15:
                done.append(_redefined(chunks, source, seal))
            elif chunks and source.random() < 0.25:
                done.append(_other_payload(chunks, source, seal))
            elif chunks and source.random() < 0.5:
                chunk = source.choice(chunks)
                done.append("in a chunk: " + _among(chunk.inner, source))
                if seal:
                    mcap_file.seal_chunk(chunk)
            elif records:
                done.append(_among(records, source))
        content = mcap_file.join(records, places=places, checksums=seal)
        return Case(content, "; ".join(done) + (", sealed" if seal else ""), {"sealed": seal})

    def read(self, path: Path, source: random.Random) -> Reading:
        """As every log."""
        return logs.read(path, source)

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """What holds its checksums is as it was; what the mcap package reads whole is read here too, or said."""
        if reading.outcome != "whole" or reading.said:
            return
        log = reading.content
        unsure = log.summary.metadata.get("integrity") == "unverifiable"
        if not case.facts.get("sealed") and sample.facts["checked"] and not unsure:
            _as_it_was(sample, reading)
        theirs = _peer(case.content)
        if theirs is not None:
            ours = {k: v for k, v in logs.counts(log).items() if v}
            if ours != theirs and not (ours == sample.facts["counts"] and _behind_data(case.content)):
                raise Finding("silent", f"messages {ours}; the mcap package reads {theirs} without an error")
            if not reading.said and ours == theirs:
                compare(_decoder(), case.content, log)


def _mixed(records: list[Record], others: list[Record], source: random.Random) -> Case:
    """Records of another sound file among those of this one, in the file and in its chunks; checksums are right."""
    chunks = [[r for r in part if r.op == CHUNK and r.inner] for part in (records, others)]
    for _ in range(source.choice((1, 3, 10))):
        if all(chunks) and source.random() < 0.6:
            ours, theirs = (source.choice(part) for part in chunks)
            ours.inner.insert(source.randrange(len(ours.inner) + 1), source.choice(theirs.inner).copy())
            mcap_file.seal_chunk(ours)
        else:
            records.insert(source.randrange(len(records) + 1), source.choice(others).copy())
    return Case(mcap_file.join(records, places=True, checksums=True), "records of another file", {"sealed": True})


def _redefined(chunks: list[Record], source: random.Random, seal: bool) -> str:
    """Another text of a definition, in a chunk."""
    held = [(chunk, r) for chunk in chunks for r in chunk.inner if r.op == mcap_file.SCHEMA]
    if not held:
        return "nothing"
    chunk, record = source.choice(held)
    parts = mcap_file.spots(record.op, record.body)
    if len(parts) < 2 or parts[-1].kind != "bytes":
        return "nothing"
    text, what = reworded(record.body[parts[-1].at :], source)
    record.body = record.body[: parts[-2].at] + struct.pack("<I", len(text)) + text
    if seal:
        mcap_file.seal_chunk(chunk)
    return f"{what} definition"


def _other_payload(chunks: list[Record], source: random.Random, seal: bool) -> str:
    """Another number in messages of one chunk."""
    chunk = source.choice(chunks)
    for record in source.sample(chunk.inner, min(len(chunk.inner), source.choice((1, 3, 20)))):
        if record.op == 5 and len(record.body) > 30:
            at = 22 + 4 * source.randrange((len(record.body) - 22) // 4)
            record.body = with_number(record.body, Spot(at, 4, "int"), source)
    if seal:
        mcap_file.seal_chunk(chunk)
    return "numbers of messages"


def _as_it_was(sample: Sample, reading: Reading) -> None:
    ours = {k: v for k, v in logs.counts(reading.content).items() if v}
    if ours != sample.facts["counts"]:
        raise Finding("silent", f"checksums were said to hold, messages {ours}, written {sample.facts['counts']}")
    values = reading.content.channels.get("/f.data")
    if "/f" in ours and (values is None or not np.array_equal(np.sort(values.values), np.arange(COUNT))):
        raise Finding("silent", "checksums were said to hold, values of /f differ")


def _behind_data(content: bytes) -> bool:
    """Whether chunks or messages stand in the summary, where they are no data; the mcap package reads them."""
    kinds = [record.op for record in mcap_file.split(content)]
    return mcap_file.DATA_END in kinds and bool({5, CHUNK} & set(kinds[kinds.index(mcap_file.DATA_END) :]))


def _peer(content: bytes) -> dict[str, int] | None:
    """Messages of each topic that the mcap package gives with checksums on; None where it gives up."""
    found: Counter[str] = Counter()
    try:
        for _, channel, _ in NonSeekingReader(io.BytesIO(content), validate_crcs=True).iter_messages(
            log_time_order=False
        ):
            found[channel.topic] += 1
    except (McapError, Exception):  # what it makes of damage is its own
        return None
    return dict(found)


def _among(records: list[Record], source: random.Random) -> str:
    """Damage one record of a list, or the list."""
    k = source.randrange(len(records))
    way = source.random()
    if way < 0.75:
        return mcap_file.damage_record(records[k], source)
    if way < 0.82:
        return f"record {records.pop(k).op} deleted"
    if way < 0.9:
        records.insert(source.randrange(len(records) + 1), records[k].copy())
        return f"record {records[k].op} repeated"
    if way < 0.95:
        j = source.randrange(len(records))
        records[j], records[k] = records[k], records[j]
        return "records swapped"
    records.insert(k, Record(source.choice((0, 3, 4, 5, 16, 0x90)), source.randbytes(source.randrange(60))))
    return "record made up"


def _written(options: dict[str, Any], topics: list[int]) -> bytes:
    out = io.BytesIO()
    writer = Writer(out, **{"chunk_size": 1200, **options})
    writer.start("ros2", "fuzz")
    channels = {}
    for k in topics:
        topic, encoding, kind, language, text, _ = TOPICS[k]
        schema = writer.register_schema(kind, language, _descriptor() if text is None else text)
        channels[k] = writer.register_channel(topic, encoding, schema)
    for i in range(COUNT):
        for k in topics:
            stamp = T0 + i * 10_000_000
            writer.add_message(channels[k], stamp, TOPICS[k][5](i), stamp - 1000, sequence=i)
    writer.add_metadata("machine", {"id": "H-7"})
    writer.add_attachment(T0, T0, "a.bin", "application/octet-stream", bytes(range(50)))
    writer.finish()
    return out.getvalue()
