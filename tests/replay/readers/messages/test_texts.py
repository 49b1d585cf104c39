"""Texts come out as they were recorded: each message on its own, in every container and serialisation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from replay.frames import log_frames
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.messages import texts as texts_module
from replay.readers.messages.assemble import Assembler
from replay.readers.messages.connection import Block, Connection
from replay.readers.registry import read_log

SECOND = 1_000_000_000
LINES = ["drive", "a much longer line ü", "", "drive", "stop: front left"] * 8


def write(folder: Path, kind: str) -> Path:
    """A log with /rosout, /tf and /joint_states; every tenth transform has a second frame."""
    one = kind == "bag"
    store = get_typestore(Stores.ROS1_NOETIC if one else Stores.ROS2_HUMBLE)
    if "tf2_msgs/msg/TFMessage" not in store.fielddefs:
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    t = store.types
    log_type = "rosgraph_msgs/msg/Log" if one else "rcl_interfaces/msg/Log"
    path = folder / ("x.bag" if one else "x")
    writer: Any = (
        Writer1(path)
        if one
        else Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3)
    )

    def raw(message: Any, name: str) -> Any:
        return store.serialize_ros1(message, name) if one else store.serialize_cdr(message, name)

    def header(i: int, frame: str) -> Any:
        stamp = t["builtin_interfaces/msg/Time"](100 + i, 0)
        more = {"seq": i} if one else {}
        return t["std_msgs/msg/Header"](stamp=stamp, frame_id=frame, **more)

    with writer:
        kinds = {"/rosout": log_type, "/tf": "tf2_msgs/msg/TFMessage", "/joint_states": "sensor_msgs/msg/JointState"}
        to = {topic: writer.add_connection(topic, name, typestore=store) for topic, name in kinds.items()}
        for i, line in enumerate(LINES):
            stamp = (100 + i) * SECOND
            more = {"topics": ["/a", "/b"], "header": header(i, "")} if one else {"stamp": header(i, "").stamp}
            said = t[log_type](level=4, name="node", msg=line, file="f.cpp", function="run", line=i, **more)
            writer.write(to["/rosout"], stamp, raw(said, log_type))
            zero = t["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0), t["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
            make, frame = t["geometry_msgs/msg/TransformStamped"], t["geometry_msgs/msg/Transform"](*zero)
            some = [make(header(i, "map"), f"wheel_{k}", frame) for k in range(2 if i % 10 == 3 else 1)]
            writer.write(to["/tf"], stamp, raw(t["tf2_msgs/msg/TFMessage"](some), "tf2_msgs/msg/TFMessage"))
            v = np.array([1.0, 2.0])
            joints = t["sensor_msgs/msg/JointState"](header(i, "base"), ["left", "right"], v, v, np.empty(0))
            writer.write(to["/joint_states"], stamp, raw(joints, "sensor_msgs/msg/JointState"))
    return path


@pytest.mark.parametrize("kind", ["bag", "mcap", "sqlite3"])
def test_frame_ids_and_log_messages(tmp_path: Path, kind: str) -> None:
    path = write(tmp_path, kind)
    frames = log_frames(read_log(path, SourceOptions(), texts=True))
    assert frames["/rosout"]["msg"].tolist() == LINES
    assert set(frames["/rosout"]["function"]) == {"run"}
    tf = frames["/tf"]
    assert set(tf["transforms[0].header.frame_id"]) == {"map"}
    assert set(tf["transforms[0].child_frame_id"]) == {"wheel_0"}
    assert np.flatnonzero(tf["transforms[1].child_frame_id"].notna()).tolist() == [3, 13, 23, 33]
    joints = frames["/joint_states"]
    assert set(joints["header.frame_id"]) == {"base"}
    assert [c for c in joints.columns if c.startswith("name")] == []  # they stand in the names of the numbers
    assert joints["velocity[right]"].tolist() == [2.0] * len(LINES)


@pytest.mark.parametrize("kind", ["bag", "mcap"])
def test_without_being_asked_for_there_are_none(tmp_path: Path, kind: str) -> None:
    path = write(tmp_path, kind)
    plain, full = (read_log(path, SourceOptions(), texts=asked) for asked in (False, True))
    assert all(c.values.dtype != object for c in plain.channels.values())
    numbers = {n: c for n, c in full.channels.items() if c.values.dtype != object}
    assert list(numbers) == list(plain.channels)
    assert all(np.array_equal(c.values, plain.channels[n].values, equal_nan=True) for n, c in numbers.items())


def assembled(encoding: str, schema: str, text: str, made: list[bytes], name: str = "x/msg/X") -> dict[str, list[Any]]:
    assembler = Assembler("log", Report(), texts=True)
    one = Connection("/x", name, encoding, schema, text)
    data = np.frombuffer(b"".join(made), np.uint8)
    lengths = np.array([len(m) for m in made])
    stamps = np.arange(len(made), dtype=np.int64) * SECOND + 1
    assembler.add([Block(one, data, np.cumsum(lengths) - lengths, lengths, stamps, stamps)])
    from replay.log.raw_log import LogSummary

    log = assembler.finish(LogSummary("x", "mcap", 0, 0, ()))
    return {c.field: c.values.tolist() for c in log.channels.values()}


def test_json() -> None:
    made = [
        json.dumps({"state": state, "v": v, "axles": [{"name": "front", "mode": "auto"}, {"name": "rear", "mode": m}]})
        for state, v, m in (("a", 1.0, "off"), ("b", "NaN", "off"), ("ü", 2.0, ""))
    ]
    found = assembled("json", "jsonschema", "{}", [m.encode() for m in made])
    assert found["state"] == ["a", "b", "ü"]
    assert found["axles[1].mode"] == ["off", "off", ""]
    assert found["v"][0] == 1.0
    assert "v (text)" not in found


def test_protobuf() -> None:
    pytest.importorskip("google.protobuf")
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    file = descriptor_pb2.FileDescriptorProto(name="x.proto", package="x", syntax="proto3")
    part = file.message_type.add(name="Part")
    part.field.add(name="mode", number=1, type=9, label=1)
    kind = file.message_type.add(name="X")
    kind.field.add(name="state", number=1, type=9, label=1)
    kind.field.add(name="v", number=2, type=1, label=1)
    kind.field.add(name="parts", number=3, type=11, label=3, type_name=".x.Part")
    kind.field.add(name="names", number=4, type=9, label=3)
    kind.field.add(name="speeds", number=5, type=1, label=3)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    make = message_factory.GetMessageClass(pool.FindMessageTypeByName("x.X"))
    part_of = message_factory.GetMessageClass(pool.FindMessageTypeByName("x.Part"))
    made = []
    for state in ("a", "bü"):
        message = make(state=state, v=1.0, names=["l", "r"], speeds=[1.0, 2.0])
        message.parts.append(part_of(mode=f"{state}0"))
        made.append(message.SerializeToString())
    schema = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString().decode("latin-1")
    found = assembled("protobuf", "protobuf", schema, made, "x.X")
    assert found["state"] == ["a", "bü"]
    assert found["parts[0].mode"] == ["a0", "bü0"]
    assert found["speeds[r]"] == [2.0, 2.0]
    assert not any(name.startswith("names") for name in found)


def test_messages_that_do_not_fit_cost_only_their_own_texts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(texts_module, "GIVE_UP", 2)
    good = b"\0\1\0\0" + (3).to_bytes(4, "little") + b"ab\0"
    bad = b"\0\1\0\0" + (99).to_bytes(4, "little") + b"ab\0"
    found = assembled("cdr", "ros2msg", "string data", [good, bad, good])
    assert found["data"] == ["ab", "ab"]


def test_columns_of_text_in_tables(tmp_path: Path) -> None:
    csv = tmp_path / "x.csv"
    csv.write_text(
        'time,v,mode,note\n0.0,1.5,auto,"a, b"\n0.1,2.5,manual,\n0.2,3.5,auto,ü\n0.3,4.5,auto,x\n', encoding="utf-8"
    )
    frame = log_frames(read_log(csv, SourceOptions(), texts=True))["group 1"]
    assert frame["mode"].tolist() == ["auto", "manual", "auto", "auto"]
    assert frame["note"].tolist() == ["a, b", "", "ü", "x"]
    late = log_frames(read_log(csv, SourceOptions(), window=(SECOND // 10, SECOND), texts=True))["group 1"]
    assert late["mode"].tolist() == ["manual", "auto", "auto"]
    table = tmp_path / "x.parquet"
    pd.DataFrame({"time": [0.0, 0.1], "v": [1.0, 2.0], "mode": ["auto", None]}).to_parquet(table)
    back = read_log(table, SourceOptions(), texts=True).channels["mode"].values.tolist()
    assert back == ["auto", None]
    assert "mode" not in read_log(table, SourceOptions()).channels
