"""ROS 1 bags: fields of record headers, chunks, connections and index damaged in their places."""

from __future__ import annotations

import bz2
import random
import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import lz4.frame
import numpy as np
from rosbags.rosbag1 import Reader, Writer
from rosbags.typesys import Stores, get_typestore

from tests.benchmarks.fuzzing import logs
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.damage import Spot, blindly, with_number

STORE = get_typestore(Stores.ROS1_NOETIC)
T0, COUNT, MAGIC = 1_700_000_000_000_000_000, 60, b"#ROSBAG V2.0\n"
FLOAT, TIME, TEXT = "std_msgs/msg/Float64", "geometry_msgs/msg/PointStamped", "std_msgs/msg/String"
PACK: dict[bytes, Callable[[bytes], bytes]] = {b"lz4": lz4.frame.compress, b"bz2": bz2.compress}
UNPACK: dict[bytes, Callable[[bytes], bytes]] = {b"lz4": lz4.frame.decompress, b"bz2": bz2.decompress}


@dataclass
class Record:
    """A record: fields of its header and its data, or the records of a chunk; lengths of their own where they are wrong."""

    head: list[tuple[bytes, bytes]]
    data: bytes = b""
    inner: list[Record] = field(default_factory=list)
    lengths: dict[str, int] = field(default_factory=dict)

    def copy(self) -> Record:
        """One that may be changed apart from this one."""
        return Record(list(self.head), self.data, [r.copy() for r in self.inner], dict(self.lengths))

    def bytes(self) -> bytes:
        """As it stands in the file."""
        head = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k + b"=" + v for k, v in self.head)
        data = self.data
        if self.inner:
            data = b"".join(r.bytes() for r in self.inner)
            data = PACK.get(dict(self.head).get(b"compression", b""), bytes)(data)
        sizes = (self.lengths.get("head", len(head)), self.lengths.get("data", len(data)))
        return struct.pack("<I", sizes[0]) + head + struct.pack("<I", sizes[1]) + data


def split(raw: bytes, at: int = 0) -> list[Record]:
    """Records of sound bytes."""
    out = []
    while at < len(raw):
        (size,) = struct.unpack_from("<I", raw, at)
        head, place, end = [], at + 4, at + 4 + size
        while place < end:
            (length,) = struct.unpack_from("<I", raw, place)
            name, _, value = raw[place + 4 : place + 4 + length].partition(b"=")
            head.append((name, value))
            place += 4 + length
        (size,) = struct.unpack_from("<I", raw, end)
        record = Record(head, raw[end + 4 : end + 4 + size])
        if (b"op", b"\x05") in head:
            record.inner = split(UNPACK.get(dict(head)[b"compression"], bytes)(record.data))
        out.append(record)
        at = end + 4 + size
    return out


class Ros1Bag:
    """Bags of each compression, with and without index."""

    name = "bag"

    def corpus(self, folder: Path) -> list[Sample]:
        """Three topics in several chunks."""
        samples = []
        for compression in ("none", "lz4", "bz2"):
            path = folder / f"{compression}.bag"
            writer = Writer(path)
            writer.chunk_threshold = 800
            if compression != "none":
                writer.set_compression(Writer.CompressionFormat[compression.upper()])
            with writer:
                links = {
                    kind: writer.add_connection(f"/{k}", kind, typestore=STORE)
                    for k, kind in enumerate((FLOAT, TIME, TEXT))
                }
                for i in range(COUNT):
                    for kind in (FLOAT, TIME, TEXT)[: 3 if i % 5 == 0 else 1]:
                        writer.write(links[kind], T0 + i * 10_000_000, _message(kind, i))
            raw = path.read_bytes()
            index = int.from_bytes(dict(split(raw[len(MAGIC) :])[0].head)[b"index_pos"], "little")
            for name, content in ((compression, raw), (f"{compression}, not closed", raw[:index])):
                facts = {"records": split(content, len(MAGIC)), "closed": content is raw}
                facts["sound"] = "whole" if content is raw else "degraded"
                samples.append(Sample(name, {"log.bag": content}, "log.bag", "log.bag", facts))
        for sample in samples:
            sample.facts["others"] = [other.facts["records"] for other in samples if other is not sample]
        return samples

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Made up, blind damage, records of another bag, or one to three damages of records."""
        from tests.benchmarks.fuzzing.bag_made import made_up

        if source.random() < 0.15:
            return made_up(source)
        if source.random() < 0.25:
            content, what = blindly(sample.raw, source)
            return Case(content, what, {"sites": 1})
        records = [r.copy() for r in sample.facts["records"]]
        done = []
        if source.random() < 0.1:
            others = source.choice(sample.facts["others"])
            for _ in range(source.choice((1, 3, 10))):
                records.insert(source.randrange(len(records) + 1), source.choice(others).copy())
            return Case(MAGIC + b"".join(r.bytes() for r in records), "records of another bag", {"sites": 9})
        for _ in range(source.choice((1, 1, 1, 2, 3))):
            chunks = [r for r in records if r.inner]
            inside = bool(chunks) and source.random() < 0.5
            done.append(
                ("in a chunk: " if inside else "") + _among(source.choice(chunks).inner if inside else records, source)
            )
        return Case(MAGIC + b"".join(r.bytes() for r in records), "; ".join(done), {"sites": len(done)})

    def read(self, path: Path, source: random.Random) -> Reading:
        """As every log."""
        return logs.read(path, source)

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """One damage of a closed bag contradicts its index; what rosbags reads whole is read here too, or said."""
        if reading.outcome != "whole" or reading.said:
            return
        ours = {k: v for k, v in logs.counts(reading.content).items() if v}
        whole = {"/0": COUNT, "/1": COUNT // 5, "/2": COUNT // 5}
        if case.facts.get("sites") == 1 and sample.facts["closed"]:
            renamed = sorted(ours.values()) == sorted(whole.values())  # a connection's name has no second witness
            if ours != whole and not renamed:
                raise Finding("silent", f"messages {ours}, written {whole}")
            channel = reading.content.channels.get("/0.data")
            if channel is not None and not np.array_equal(np.sort(channel.stamps), T0 + np.arange(COUNT) * 10_000_000):
                raise Finding("silent", "stamps of /0 differ from those of the index")
        theirs = _peer(path)
        if theirs is not None and sum(theirs.values()) > sum(ours.values()):
            raise Finding("silent", f"messages {ours}; rosbags reads {theirs} without an error")


def _peer(path: Path) -> dict[str, int] | None:
    found: Counter[str] = Counter()
    try:
        with Reader(path) as reader:
            for link, _, _ in reader.messages():
                found[link.topic] += 1
    except Exception:  # what it makes of damage is its own
        return None
    return dict(found)


def _message(kind: str, i: int) -> bytes:
    types = STORE.types
    if kind == FLOAT:
        message = types[FLOAT](float(i))
    elif kind == TEXT:
        message = types[TEXT]("x" * (i % 9))
    else:
        stamp = types["builtin_interfaces/msg/Time"](T0 // 10**9 + i // 100, i % 100 * 10_000_000)
        message = types[TIME](
            types["std_msgs/msg/Header"](i, stamp, "base"), types["geometry_msgs/msg/Point"](1.0, i, 2.0)
        )
    return bytes(STORE.serialize_ros1(message, kind))


def _among(records: list[Record], source: random.Random) -> str:
    """Damage one record of a list, or the list."""
    k, way = source.randrange(len(records)), source.random()
    if way < 0.78:
        return _one(records[k], source)
    if way < 0.86 and len(records) > 1:
        records.pop(k)
        return "record deleted"
    if way < 0.92:
        records.insert(source.randrange(len(records) + 1), records[k].copy())
        return "record repeated"
    if way < 0.96:
        j = source.randrange(len(records))
        records[j], records[k] = records[k], records[j]
        return "records swapped"
    records.insert(k, Record([(b"op", source.randbytes(1)), (b"conn", source.randbytes(4))], source.randbytes(20)))
    return "record made up"


def _one(record: Record, source: random.Random) -> str:
    """Change a field, a length or the data of a record."""
    kind, way = dict(record.head).get(b"op", b"?").hex(), source.random()
    if way < 0.1:
        part = source.choice(("head", "data"))
        near = len(record.bytes())
        record.lengths[part] = source.choice((0, 1, near, near - 9, near + 9, 2**31 - 1, 2**32 - 1))
        return f"length of {part} of record {kind}"
    if way < 0.6 and record.head:
        n = source.randrange(len(record.head))
        name, value = record.head[n]
        if len(value) in (1, 4, 8) and source.random() < 0.8:
            value = with_number(value, Spot(0, len(value), "int"), source)
        else:
            value = blindly(value, source)[0]
        change = source.random()
        if change < 0.8:
            record.head[n] = (name, value)
        elif change < 0.9:
            record.head.pop(n)
        else:
            record.head.insert(n, (source.choice((name, b"x", b"", b"op")), value))
        return f"field {name.decode(errors='replace')} of record {kind}"
    if record.inner:
        raw, record.inner = record.bytes(), []
        head = int.from_bytes(raw[:4], "little")
        record.data = raw[8 + head :]
    if kind in ("04", "06") and len(record.data) >= 4:
        at = source.randrange(len(record.data) // 4) * 4
        record.data = with_number(record.data, Spot(at, 4, "int"), source)
        return f"number {at // 4} of record {kind}"
    record.data, what = blindly(record.data, source)
    return f"{what} in the data of record {kind}"
