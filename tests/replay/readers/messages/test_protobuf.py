"""Columns of protobuf messages equal what the protobuf package reads, message by message."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer

from replay.log.source_options import SourceOptions
from replay.readers.mcap.reader import McapReader
from replay.readers.messages.cdr import Outcome
from replay.readers.messages.definitions import DefinitionError
from replay.readers.messages.fields import is_key_list
from replay.readers.messages.protobuf import Decoder
from replay.readers.messages.protobuf_schema import schema_of

pytest.importorskip("google.protobuf", reason="the oracle of protobuf decoding is not installed")
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, text_format, timestamp_pb2
from google.protobuf.message import DecodeError

FILES = """
file {
  name: "robot.proto" package: "robot" syntax: "proto3" dependency: "google/protobuf/timestamp.proto"
  enum_type { name: "Mode" value { name: "OFF" number: 0 } value { name: "ON" number: 1 } }
  message_type {
    name: "Wheel"
    field { name: "speed" number: 1 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
    field { name: "ticks" number: 3 type: TYPE_SINT64 label: LABEL_OPTIONAL }
    field { name: "mode" number: 200 type: TYPE_ENUM type_name: ".robot.Mode" label: LABEL_OPTIONAL }
    field { name: "samples" number: 4 type: TYPE_FLOAT label: LABEL_REPEATED }
    field { name: "tyre" number: 2 type: TYPE_MESSAGE type_name: ".robot.Wheel.Tyre" label: LABEL_OPTIONAL }
    nested_type { name: "Tyre" field { name: "bar" number: 1 type: TYPE_FLOAT label: LABEL_OPTIONAL } }
  }
  message_type {
    name: "State"
    field { name: "timestamp" number: 1 type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" label: LABEL_OPTIONAL }
    field { name: "frame" number: 2 type: TYPE_STRING label: LABEL_OPTIONAL }
    field { name: "d" number: 3 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
    field { name: "f" number: 4 type: TYPE_FLOAT label: LABEL_OPTIONAL }
    field { name: "i64" number: 5 type: TYPE_INT64 label: LABEL_OPTIONAL }
    field { name: "u64" number: 6 type: TYPE_UINT64 label: LABEL_OPTIONAL }
    field { name: "i32" number: 7 type: TYPE_INT32 label: LABEL_OPTIONAL }
    field { name: "x64" number: 8 type: TYPE_FIXED64 label: LABEL_OPTIONAL }
    field { name: "x32" number: 9 type: TYPE_FIXED32 label: LABEL_OPTIONAL }
    field { name: "b" number: 10 type: TYPE_BOOL label: LABEL_OPTIONAL }
    field { name: "u32" number: 11 type: TYPE_UINT32 label: LABEL_OPTIONAL }
    field { name: "mode" number: 12 type: TYPE_ENUM type_name: ".robot.Mode" label: LABEL_OPTIONAL }
    field { name: "sx32" number: 13 type: TYPE_SFIXED32 label: LABEL_OPTIONAL }
    field { name: "sx64" number: 14 type: TYPE_SFIXED64 label: LABEL_OPTIONAL }
    field { name: "s32" number: 15 type: TYPE_SINT32 label: LABEL_OPTIONAL }
    field { name: "s64" number: 16 type: TYPE_SINT64 label: LABEL_OPTIONAL }
    field { name: "blob" number: 17 type: TYPE_BYTES label: LABEL_OPTIONAL }
    field { name: "maybe" number: 18 type: TYPE_DOUBLE label: LABEL_OPTIONAL proto3_optional: true oneof_index: 1 }
    field { name: "left" number: 19 type: TYPE_INT32 label: LABEL_OPTIONAL oneof_index: 0 }
    field { name: "wheel" number: 20 type: TYPE_MESSAGE type_name: ".robot.Wheel" label: LABEL_OPTIONAL oneof_index: 0 }
    field { name: "word" number: 21 type: TYPE_STRING label: LABEL_OPTIONAL oneof_index: 0 }
    field { name: "packed" number: 22 type: TYPE_SINT32 label: LABEL_REPEATED }
    field { name: "unpacked" number: 23 type: TYPE_DOUBLE label: LABEL_REPEATED options { packed: false } }
    field { name: "joint_names" number: 24 type: TYPE_STRING label: LABEL_REPEATED }
    field { name: "position" number: 25 type: TYPE_DOUBLE label: LABEL_REPEATED }
    field { name: "wheels" number: 26 type: TYPE_MESSAGE type_name: ".robot.Wheel" label: LABEL_REPEATED }
    field { name: "next" number: 27 type: TYPE_MESSAGE type_name: ".robot.State" label: LABEL_OPTIONAL }
    field { name: "notes" number: 28 type: TYPE_MESSAGE type_name: ".robot.State.NotesEntry" label: LABEL_REPEATED }
    field { name: "flags" number: 29 type: TYPE_BOOL label: LABEL_REPEATED }
    oneof_decl { name: "choice" } oneof_decl { name: "_maybe" }
    nested_type {
      name: "NotesEntry" options { map_entry: true }
      field { name: "key" number: 1 type: TYPE_STRING label: LABEL_OPTIONAL }
      field { name: "value" number: 2 type: TYPE_MESSAGE type_name: ".robot.Wheel" label: LABEL_OPTIONAL }
    }
  }
}
file {
  name: "old.proto" package: "old" syntax: "proto2"
  message_type {
    name: "State"
    field { name: "d" number: 1 type: TYPE_DOUBLE label: LABEL_OPTIONAL default_value: "7" }
    field { name: "n" number: 2 type: TYPE_UINT32 label: LABEL_REPEATED }
    field { name: "text" number: 3 type: TYPE_STRING label: LABEL_OPTIONAL }
    field { name: "inner" number: 4 type: TYPE_MESSAGE type_name: "State" label: LABEL_REPEATED }
  }
}
"""


def _descriptors() -> descriptor_pb2.FileDescriptorSet:
    files = text_format.Parse(FILES, descriptor_pb2.FileDescriptorSet())
    timestamp_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    return files


DESCRIPTORS = _descriptors()
DEFINITION = DESCRIPTORS.SerializeToString().decode("latin-1")
POOL = descriptor_pool.DescriptorPool()
for _file in reversed(DESCRIPTORS.file):
    POOL.AddSerializedFile(_file.SerializeToString())


def message(name: str) -> Any:
    return message_factory.GetMessageClass(POOL.FindMessageTypeByName(name))


STATE, OLD = message("robot.State"), message("old.State")


def numbers(found: Any, scopes: tuple[list[list[str]], ...] = ()) -> Iterator[tuple[str, int | float]]:
    """Every number of a message of the oracle, with its path."""
    fields = found.DESCRIPTOR.fields
    lists = [
        list(getattr(found, f.name))
        for f in fields
        if f.type == f.TYPE_STRING and f.is_repeated and is_key_list(f.name)
    ]
    scopes = ([n for n in lists if len(n) <= 64 and all(x.strip() for x in n)], *scopes)
    for f in fields:
        if f.message_type is not None and f.message_type.GetOptions().map_entry:
            continue
        if f.is_repeated:
            items = list(getattr(found, f.name))
            if len(items) > 64:
                continue
            names = [
                n for scope in scopes for n in scope if len(n) == len(items) and len({x.strip() for x in n}) == len(n)
            ]
            labels = [n.rstrip("\0").strip() for n in names[0]] if names else [str(i) for i in range(len(items))]
            for label, item in zip(labels, items, strict=True):
                yield from entry(f"{f.name}[{label}]", f, item, scopes)
        elif not f.has_presence or found.HasField(f.name):
            yield from entry(f.name, f, getattr(found, f.name), scopes)


def entry(path: str, f: Any, value: Any, scopes: tuple[list[list[str]], ...]) -> Iterator[tuple[str, int | float]]:
    if f.message_type is not None:
        yield from ((f"{path}.{p}", v) for p, v in numbers(value, scopes))
    elif f.type not in (f.TYPE_STRING, f.TYPE_BYTES):
        yield path, value


def columns(name: str, payloads: list[bytes], outcome: Outcome, gap: bytes = b"\xff\xff") -> list[dict[str, Any]]:
    """Decode payloads, and give the numbers of each row."""
    data = np.frombuffer(gap + gap.join(payloads) + gap, np.uint8)
    lengths = np.array([len(p) for p in payloads], np.int64)
    starts = np.cumsum(lengths + len(gap)) - lengths
    rows: list[dict[str, Any]] = [{} for _ in payloads]
    for part in Decoder(schema_of(name, DEFINITION), outcome).decode(data, starts, lengths):
        for path, values in part.columns.items():
            assert len(values) == len(part.rows)
            for row, value in zip(part.rows.tolist(), values.tolist(), strict=True):
                assert path not in rows[row]
                rows[row][path] = value
    return rows


def expected(found: Any) -> dict[str, Any]:
    out = dict(numbers(found))
    if "timestamp" in found.DESCRIPTOR.fields_by_name:
        out["timestamp.sec"] = out.pop("timestamp.seconds", 0)
        out["timestamp.nanosec"] = out.pop("timestamp.nanos", 0)
        if abs(out["timestamp.sec"]) > 9_000_000_000:
            out["timestamp.sec"] = out["timestamp.nanosec"] = 0
    return out


def same(a: dict[str, Any], b: dict[str, Any]) -> bool:
    return a.keys() == b.keys() and all(_bits(a[k]) == _bits(b[k]) for k in a)


def _bits(value: Any) -> bytes | int:
    if isinstance(value, float):
        return struct.pack("<d", value) if value == value else b"NaN"
    return int(value)


INT32, INT64 = st.integers(-(2**31), 2**31 - 1), st.integers(-(2**63), 2**63 - 1)
UINT32, UINT64 = st.integers(0, 2**32 - 1), st.integers(0, 2**64 - 1)
FLOAT, DOUBLE = st.floats(width=32), st.floats()
SCALARS = {
    "d": DOUBLE, "f": FLOAT, "i64": INT64, "u64": UINT64, "i32": INT32, "x64": UINT64, "x32": UINT32, "b": st.booleans(),
    "u32": UINT32, "mode": INT32, "sx32": INT32, "sx64": INT64, "s32": INT32, "s64": INT64, "frame": st.text(max_size=5),
    "blob": st.binary(max_size=5), "maybe": DOUBLE,
}  # fmt: skip
WHEEL = st.fixed_dictionaries(
    {},
    optional={
        "speed": DOUBLE, "ticks": INT64, "mode": INT32, "samples": st.lists(FLOAT, max_size=70),
        "tyre": st.fixed_dictionaries({}, optional={"bar": FLOAT}),
    },
)  # fmt: skip
CHOICE = st.one_of(
    st.just({}), st.fixed_dictionaries({"left": INT32}), st.fixed_dictionaries({"wheel": WHEEL}), st.just({"word": "x"})
)
ARRAYS = {
    "timestamp": st.fixed_dictionaries({}, optional={"seconds": INT64, "nanos": INT32}),
    "packed": st.lists(INT32, max_size=4),
    "unpacked": st.lists(DOUBLE, max_size=4),
    "flags": st.lists(st.booleans(), max_size=4),
    "joint_names": st.lists(st.sampled_from(["fl", "fr", "rl", "ä", "fl "]), max_size=3),
    "position": st.lists(DOUBLE, max_size=3),
    "wheels": st.lists(WHEEL, max_size=4),
    "notes": st.dictionaries(st.text(max_size=3), WHEEL, max_size=2),
}


def _with_choice(plain: st.SearchStrategy[dict[str, Any]]) -> st.SearchStrategy[dict[str, Any]]:
    return st.builds(lambda a, b: a | b, plain, CHOICE)


STATES = st.recursive(
    _with_choice(st.fixed_dictionaries({}, optional=SCALARS | ARRAYS)),
    lambda inner: _with_choice(st.fixed_dictionaries({"next": inner}, optional=SCALARS | ARRAYS)),
    max_leaves=3,
).map(lambda fields: STATE(**fields))


@given(st.lists(STATES, min_size=1, max_size=6))
def test_columns_are_the_oracles_numbers(states: list[Any]) -> None:
    outcome = Outcome()
    rows = columns("robot.State", [s.SerializeToString() for s in states], outcome)
    assert outcome.bad == 0
    for row, state in zip(rows, states, strict=True):
        assert same(row, expected(state))


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """A payload, or two behind one another, with a few bytes replaced, removed or repeated."""
    raw = bytearray(b"".join(s.SerializeToString() for s in draw(st.lists(STATES, min_size=1, max_size=2))))
    for _ in range(draw(st.integers(0, 3))):
        if not raw:
            break
        at = draw(st.integers(0, len(raw) - 1))
        action = draw(st.integers(0, 3))
        if action == 0:
            raw[at] = draw(st.integers(0, 255))
        elif action == 1:
            del raw[at : at + draw(st.integers(1, 4))]
        elif action == 2:
            raw[at:at] = raw[at : at + draw(st.integers(1, 8))]
        else:
            raw[at:at] = draw(st.binary(max_size=4))
    return bytes(raw)


@given(st.lists(damaged(), min_size=1, max_size=4), st.sampled_from(["robot.State", "old.State"]))
def test_damaged_payloads_give_the_oracles_numbers_or_none(payloads: list[bytes], name: str) -> None:
    outcome = Outcome()
    rows = columns(name, payloads, outcome)
    refused = 0
    for row, payload in zip(rows, payloads, strict=True):
        found = message(name)()
        try:
            found.ParseFromString(payload)
        except DecodeError:
            assert row == {}
            refused += 1
            continue
        if row:
            assert same(row, expected(found))
    assert outcome.bad >= refused


@given(st.lists(st.binary(max_size=30), min_size=1, max_size=8))
def test_any_bytes_give_the_oracles_numbers_or_none(payloads: list[bytes]) -> None:
    rows = columns("robot.State", payloads, Outcome())
    for row, payload in zip(rows, payloads, strict=True):
        try:
            found = STATE.FromString(payload)
        except DecodeError:
            assert row == {}
        else:
            assert not row or same(row, expected(found))


def test_names_beside_arrays_become_keys_and_change_with_the_message() -> None:
    first = STATE(joint_names=["fl", "fr"], position=[1, 2], wheels=[{"speed": 3}, {"speed": 4}], packed=[7])
    second = STATE(joint_names=["fr", "fl"], position=[2, 1])
    nameless = STATE(position=[5, 6])
    rows = columns("robot.State", [m.SerializeToString() for m in (first, second, nameless)], Outcome())
    assert {k: v for k, v in rows[0].items() if "[" in k and v} == {
        "position[fl]": 1, "position[fr]": 2, "wheels[fl].speed": 3, "wheels[fr].speed": 4, "packed[0]": 7,
    }  # fmt: skip
    assert (rows[1]["position[fl]"], rows[1]["position[fr]"]) == (1, 2)
    assert (rows[2]["position[0]"], rows[2]["position[1]"]) == (5, 6)


def test_long_arrays_are_left_out_whole_and_named() -> None:
    decoder = Decoder(schema_of("robot.State", DEFINITION), Outcome())
    raw = STATE(packed=range(65), wheels=[{"samples": range(65)}] * 2, unpacked=range(64)).SerializeToString()
    parts = list(decoder.decode(np.frombuffer(raw, np.uint8), np.array([0]), np.array([len(raw)])))
    found = {path for part in parts for path in part.columns}
    assert "unpacked[63]" in found
    assert not any(p == "packed[0]" or "samples" in p for p in found)
    assert {s for part in parts for s in part.skipped} == {"packed", "wheels[0].samples", "wheels[1].samples"}


def test_messages_that_hold_themselves_go_as_deep_as_the_data_and_no_deeper() -> None:
    deep = STATE(d=1.0)
    for _ in range(70):
        deep = STATE(next=deep)
    shallow = STATE(next=STATE(next=STATE(d=2.0)))
    outcome = Outcome()
    rows = columns("robot.State", [deep.SerializeToString(), shallow.SerializeToString()], outcome)
    assert (outcome.bad, outcome.reason) == (1, "it is nested deeper than 64")
    assert rows[0] == {}
    assert rows[1]["next.next.d"] == 2.0


def test_groups_are_refused() -> None:
    outcome = Outcome()
    assert columns("robot.State", [b"\xf3\x07\xf4\x07"], outcome) == [{}]
    assert (outcome.bad, outcome.reason) == (1, "it holds a group, which is not supported")


def test_one_message_with_too_many_numbers_costs_only_itself() -> None:
    greedy = STATE(wheels=[{"samples": range(64)}] * 64)
    for _ in range(40):
        greedy = STATE(next=greedy, wheels=[{"samples": range(64)}] * 64)
    small = STATE(d=4.0)
    outcome = Outcome()
    rows = columns("robot.State", [m.SerializeToString() for m in (small, greedy, small)], outcome)
    assert (outcome.bad, outcome.reason) == (1, "it holds too many numbers")
    assert [r.get("d") for r in rows] == [4.0, None, 4.0]


def _log(path: Path, type_name: str, definition: bytes, payloads: list[bytes], encoding: str = "protobuf") -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(type_name, encoding, definition)
        channel = writer.register_channel("/state", "protobuf", schema)
        for i, payload in enumerate(payloads):
            writer.add_message(channel, 1_000_000_000 * (i + 1), payload, 0)
        writer.finish()
    return path


def test_a_log_has_channels_on_its_own_stamps(tmp_path: Path) -> None:
    states = [STATE(d=i, timestamp={"seconds": 100 + i, "nanos": 5}, notes={"a": {"speed": 1}}) for i in range(3)]
    states.append(STATE(d=3))
    payloads = [s.SerializeToString() for s in states]
    path = _log(tmp_path / "a.mcap", "robot.State", DESCRIPTORS.SerializeToString(), payloads)
    log = McapReader().read(path, SourceOptions())
    channel = log.channels["/state.d"]
    assert channel.values.tolist() == [0, 1, 2, 3]
    assert channel.stamps.tolist()[:3] == [100_000_000_005, 101_000_000_005, 102_000_000_005]
    assert channel.type_name == "robot.State"
    assert "timestamp" not in "".join(log.channels)
    assert any("1 of 4 header stamps are zero" in note for note in log.summary.notes)
    assert "/state: left out maps and groups: notes" in log.summary.notes
    assert log.summary.damage == ()


@pytest.mark.parametrize(
    ("type_name", "definition", "encoding", "words"),
    [
        (
            "robot.Tractor",
            DESCRIPTORS.SerializeToString(),
            "protobuf",
            "does not hold the message type 'robot.Tractor'",
        ),
        ("robot.State", DESCRIPTORS.SerializeToString()[:-30], "protobuf", "is not a FileDescriptorSet"),
        ("robot.State", DESCRIPTORS.file[0].SerializeToString(), "protobuf", "schema"),
        ("robot.State", b"message State {}", "proto", "does not hold the message type"),
    ],
)
def test_schemas_that_do_not_serve_are_told(
    tmp_path: Path, type_name: str, definition: bytes, encoding: str, words: str
) -> None:
    path = _log(tmp_path / "a.mcap", type_name, definition, [b""], encoding)
    (topic,) = McapReader().summarise(path, SourceOptions()).topics
    assert words in topic.note
    log = McapReader().read(path, SourceOptions())
    assert log.channels == {}
    assert any("/state is not decoded" in note for note in log.summary.notes)


@given(st.data())
def test_damaged_schemas_are_refused_or_read_in_bounds(data: st.DataObject) -> None:
    raw = bytearray(DESCRIPTORS.SerializeToString())
    for _ in range(data.draw(st.integers(1, 3))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    payload = STATE(d=1, wheels=[{"speed": 2}], packed=[1, 2], joint_names=["a"]).SerializeToString()
    try:
        schema = schema_of("robot.State", raw.decode("latin-1"))
    except DefinitionError:
        return
    list(Decoder(schema, Outcome()).decode(np.frombuffer(payload, np.uint8), np.array([0]), np.array([len(payload)])))


def test_a_schema_without_its_imports_is_refused() -> None:
    files = descriptor_pb2.FileDescriptorSet(file=[DESCRIPTORS.file[0]])
    with pytest.raises(DefinitionError, match=r"does not hold the message type '\.google\.protobuf\.Timestamp'"):
        schema_of("robot.State", files.SerializeToString().decode("latin-1"))


def test_editions_say_where_absence_is_a_value() -> None:
    files = text_format.Parse(
        'file { name: "e.proto" syntax: "editions" edition: EDITION_2023 '
        "options { features { field_presence: IMPLICIT } } "
        'message_type { name: "E" '
        'field { name: "a" number: 1 type: TYPE_INT32 label: LABEL_OPTIONAL } '
        'field { name: "b" number: 2 type: TYPE_INT32 label: LABEL_OPTIONAL '
        "options { features { field_presence: EXPLICIT } } } } }",
        descriptor_pb2.FileDescriptorSet(),
    )
    schema = schema_of("E", files.SerializeToString().decode("latin-1"))
    (part,) = Decoder(schema, Outcome()).decode(np.empty(0, np.uint8), np.array([0]), np.array([0]))
    assert {k: v.tolist() for k, v in part.columns.items()} == {"a": [0]}


def test_places_outside_the_data_are_refused() -> None:
    outcome, raw = Outcome(), STATE(d=1).SerializeToString()
    decoder = Decoder(schema_of("robot.State", DEFINITION), outcome)
    places = np.array([-1, 0, 3]), np.array([5, len(raw) + 1, -1])
    assert list(decoder.decode(np.frombuffer(raw, np.uint8), *places)) == []
    assert outcome.bad == 3


def test_columns_that_outgrow_memory_are_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    states = [STATE(d=i, position=[i, 2], packed=[1] * (i // 500), maybe=i if i % 3 else None) for i in range(1000)]
    payloads = [s.SerializeToString() for s in states]
    path = _log(tmp_path / "a.mcap", "robot.State", DESCRIPTORS.SerializeToString(), payloads)
    whole = McapReader().read(path, SourceOptions())
    assert whole.channels["/state.maybe"].values.tolist() == [float(i) for i in range(1000) if i % 3]
    assert whole.channels["/state.packed[0]"].stamps.tolist() == whole.channels["/state.d"].stamps.tolist()[500:]
    monkeypatch.setattr("replay.readers.messages.assemble.MEMORY", 0)
    spilled = McapReader().read(path, SourceOptions())
    assert spilled.channels.keys() == whole.channels.keys()
    for name, channel in whole.channels.items():
        np.testing.assert_array_equal(spilled.channels[name].values, channel.values)
        np.testing.assert_array_equal(spilled.channels[name].stamps, channel.stamps)


def test_logs_of_the_usual_writer_are_read(tmp_path: Path) -> None:
    writer = pytest.importorskip("mcap_protobuf.writer", reason="mcap-protobuf-support is not installed")
    path = tmp_path / "a.mcap"
    with path.open("wb") as file, writer.Writer(file) as out:
        for i in range(50):
            stamp = 1_760_000_000_000_000_000 + i * 10_000_000
            message = STATE(
                timestamp={"seconds": stamp // 10**9, "nanos": stamp % 10**9}, wheels=[{"speed": i, "tyre": {"bar": 2}}]
            )
            out.write_message("/wheels", message, log_time=stamp + 5, publish_time=stamp)
    log = McapReader().read(path, SourceOptions())
    assert log.channels["/wheels.wheels[0].speed"].values.tolist() == list(range(50))
    assert log.channels["/wheels.wheels[0].tyre.bar"].stamps[1] == 1_760_000_000_010_000_000
    assert log.channels["/wheels.d"].values.tolist() == [0.0] * 50
    assert log.summary.damage == ()
