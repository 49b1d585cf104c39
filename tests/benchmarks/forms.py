"""CPU time of protobuf and JSON messages into NumPy columns, beside what peers need for the same.

Median of several runs in one process; messages per CPU second. Peers that are not installed are left out with a note.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, text_format, timestamp_pb2
from mcap.reader import make_reader
from mcap.writer import Writer

from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log

NAMES = ["front_left", "front_right", "rear_left", "rear_right", "front_steering", "rear_steering"]
FILE = """
name: "bench.proto" package: "bench" syntax: "proto3" dependency: "google/protobuf/timestamp.proto"
message_type { name: "Vector3"
  field { name: "x" number: 1 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
  field { name: "y" number: 2 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
  field { name: "z" number: 3 type: TYPE_DOUBLE label: LABEL_OPTIONAL } }
message_type { name: "Pose"
  field { name: "timestamp" number: 1 type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" label: LABEL_OPTIONAL }
  field { name: "frame_id" number: 2 type: TYPE_STRING label: LABEL_OPTIONAL }
  field { name: "position" number: 3 type: TYPE_MESSAGE type_name: ".bench.Vector3" label: LABEL_OPTIONAL }
  field { name: "velocity" number: 4 type: TYPE_MESSAGE type_name: ".bench.Vector3" label: LABEL_OPTIONAL } }
message_type { name: "Joints"
  field { name: "timestamp" number: 1 type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" label: LABEL_OPTIONAL }
  field { name: "name" number: 2 type: TYPE_STRING label: LABEL_REPEATED }
  field { name: "position" number: 3 type: TYPE_DOUBLE label: LABEL_REPEATED }
  field { name: "velocity" number: 4 type: TYPE_DOUBLE label: LABEL_REPEATED }
  field { name: "effort" number: 5 type: TYPE_DOUBLE label: LABEL_REPEATED } }
"""


def write(folder: Path, count: int) -> dict[str, Path]:
    """Write the same poses and joint states as protobuf and as JSON."""
    files = descriptor_pb2.FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    text_format.Parse(FILE, files.file.add())
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.AddSerializedFile(file.SerializeToString())
    kinds = {n: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"bench.{n}")) for n in ("Pose", "Joints")}
    rng = np.random.default_rng(1)
    out = {}
    for form in ("protobuf", "json"):
        out[form] = folder / f"{form}.mcap"
        with out[form].open("wb") as handle:
            writer = Writer(handle)
            writer.start()
            channels = {}
            for name in kinds:
                schema = ("protobuf", files.SerializeToString()) if form == "protobuf" else ("jsonschema", b"{}")
                number = writer.register_schema(f"bench.{name}", *schema)
                channels[name] = writer.register_channel(f"/{name.lower()}", form, number)
            for i in range(count):
                t = 1_760_000_000_000_000_000 + i * 1_000_000
                x = rng.normal(size=18)
                vectors = [dict(zip("xyz", x[k : k + 3].tolist(), strict=True)) for k in (0, 3)]
                joints = {k: x[6 * j : 6 * j + 6].tolist() for j, k in enumerate(("position", "velocity", "effort"))}
                for name, fields in (
                    ("Pose", {"frame_id": "map", "position": vectors[0], "velocity": vectors[1]}),
                    ("Joints", {"name": NAMES, **joints}),
                ):
                    if form == "protobuf":
                        stamp = {"seconds": t // 10**9, "nanos": t % 10**9}
                        payload = kinds[name](timestamp=stamp, **fields).SerializeToString()
                    else:
                        stamp = {"sec": t // 10**9, "nsec": t % 10**9}
                        payload = json.dumps({"timestamp": stamp, **fields}).encode()
                    writer.add_message(channels[name], t, payload, t)
            writer.finish()
    return out


def gather(decoded: Any) -> dict[str, np.ndarray[Any, Any]]:
    """Every number of decoded messages, as arrays."""
    lists: dict[str, list[Any]] = {}
    for topic, message in decoded:
        get = message.__getitem__ if isinstance(message, dict) else lambda k, m=message: getattr(m, k)
        if topic == "/pose":
            for field in ("position", "velocity"):
                vector = get(field)
                for axis in "xyz":
                    value = vector[axis] if isinstance(vector, dict) else getattr(vector, axis)
                    lists.setdefault(f"{field}.{axis}", []).append(value)
        else:
            for field in ("position", "velocity", "effort"):
                lists.setdefault(f"joints.{field}", []).append(list(get(field)))
    return {k: np.array(v) for k, v in lists.items()}


def ours(path: Path) -> object:
    """Read with the reader of this project."""
    return read_log(path, SourceOptions())


def mcap_protobuf(path: Path) -> object:
    """Read with mcap-protobuf-support."""
    from mcap_protobuf.decoder import DecoderFactory

    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return gather((c.topic, m) for _, c, _, m in reader.iter_decoded_messages())


def protobuf_alone(path: Path) -> object:
    """Parse payloads that are already in memory with the protobuf package, and look at no field."""
    global _PAYLOADS
    if not _PAYLOADS:
        with path.open("rb") as file:
            _PAYLOADS = [(s, m.data) for s, _, m in make_reader(file).iter_messages()]
    from mcap_protobuf.decoder import DecoderFactory

    factory = DecoderFactory()
    decode = {s.id: factory.decoder_for("protobuf", s) for s in {s.id: s for s, _ in _PAYLOADS}.values()}
    begin = time.process_time()
    for schema, data in _PAYLOADS:
        decode[schema.id](data)
    return time.process_time() - begin


_PAYLOADS: list[tuple[Any, bytes]] = []


def mcap_orjson(path: Path) -> object:
    """Read with the mcap package and orjson."""
    import orjson

    with path.open("rb") as file:
        return gather((c.topic, orjson.loads(m.data)) for _, c, m in make_reader(file).iter_messages())


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=100_000, help="messages in each log (default: %(default)s)")
    parser.add_argument("--runs", type=int, default=5, help="runs of each reader (default: %(default)s)")
    options = parser.parse_args()
    readers: list[tuple[str, str, Callable[[Path], object]]] = [
        ("protobuf", "this project", ours),
        ("protobuf", "mcap-protobuf-support", mcap_protobuf),
        ("protobuf", "protobuf package, parsing alone", protobuf_alone),
        ("json", "this project", ours),
        ("json", "mcap and orjson", mcap_orjson),
    ]
    with tempfile.TemporaryDirectory() as folder:
        logs = write(Path(folder), options.messages // 2)
        for form, name, read in readers:
            try:
                read(logs[form])
            except ImportError as error:
                print(f"{form:9} {name:32} left out: {error}")
                continue
            spent = []
            for _ in range(options.runs):
                begin = time.process_time()
                inner = read(logs[form])
                spent.append(inner if isinstance(inner, float) else time.process_time() - begin)
            median = statistics.median(spent)
            rate = options.messages / median
            print(
                f"{form:9} {name:32} {median:7.3f} CPU s  {rate:12,.0f} messages/s  {logs[form].stat().st_size / 1e6:.1f} MB"
            )


if __name__ == "__main__":
    main()
