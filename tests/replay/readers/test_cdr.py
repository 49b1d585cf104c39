from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from replay.readers.cdr import MAX_PROGRAMS, Decoder, Outcome
from replay.readers.definitions import DefinitionError, resolve
from replay.readers.growing import Store

Flatten = Callable[..., dict[str, Any]]


def columns(kind: Any, payloads: list[bytes]) -> tuple[dict[str, dict[int, Any]], Outcome]:
    """Decode payloads into path → row → value."""
    data = np.frombuffer(b"".join(payloads) or b"\0", np.uint8)
    lengths = np.array([len(p) for p in payloads], np.int64)
    outcome, store = Outcome(), Store()
    store.begin(len(payloads))
    Decoder(kind, outcome, store).decode(data, np.cumsum(lengths) - lengths, lengths)
    store.end()
    found: dict[str, dict[int, Any]] = {}
    for path, (rows, values) in store.finish().items():
        numbers = list(range(len(payloads))) if rows is None else rows.tolist()
        assert numbers == sorted(set(numbers))
        found[path] = dict(zip(numbers, values.tolist(), strict=True))
    return found, outcome


def same(found: dict[str, dict[int, Any]], expected: list[dict[str, Any]]) -> None:
    """Compare row by row with the oracle, NaN equal to NaN."""
    rows: list[dict[str, Any]] = [{} for _ in expected]
    for path, values in found.items():
        for row, value in values.items():
            rows[row][path] = value
    for got, want in zip(rows, expected, strict=True):
        assert got.keys() == want.keys()
        np.testing.assert_array_equal(list(got.values()), [want[k] for k in got])


BASE = (
    "bool",
    "int8",
    "uint8",
    "int16",
    "uint16",
    "int32",
    "uint32",
    "int64",
    "uint64",
    "float32",
    "float64",
    "string",
)
SUFFIX = ("", "[]", "[3]", "[<=4]")


@st.composite
def definitions(draw: st.DrawFn) -> str:
    """Text of a message with nested types; no name arrays, so that every index is a number."""
    inner = "\n".join(
        f"{draw(st.sampled_from(BASE))}{draw(st.sampled_from(SUFFIX))} i{k}" for k in range(draw(st.integers(1, 4)))
    )
    kinds = (*BASE, "test_pkg/Inner", "builtin_interfaces/Time")
    outer = "\n".join(
        f"{draw(st.sampled_from(kinds))}{draw(st.sampled_from(SUFFIX))} f{k}" for k in range(draw(st.integers(1, 6)))
    )
    time = "int32 sec\nuint32 nanosec"
    bar = "=" * 80
    return f"{outer}\n{bar}\nMSG: test_pkg/Inner\n{inner}\n{bar}\nMSG: builtin_interfaces/Time\n{time}"


def random_value(store: Typestore, desc: Any, rng: np.random.Generator) -> Any:
    kind, value = desc
    if kind == Nodetype.NAME:
        fields = store.fielddefs[value][1]
        return store.types[value](*[random_value(store, d, rng) for _, d in fields])
    if kind == Nodetype.BASE:
        if value[0] == "string":
            return "x" * int(rng.integers(0, 6))
        if value[0] == "bool":
            return bool(rng.integers(0, 2))
        return random_array(value[0], 1, rng)[0].item()
    sub, count = value
    if kind == Nodetype.SEQUENCE:
        count = int(rng.integers(0, 4))
    if sub[0] == Nodetype.BASE and sub[1][0] != "string":
        return random_array(sub[1][0], count, rng)
    return [random_value(store, sub, rng) for _ in range(count)]


def random_array(name: str, count: int, rng: np.random.Generator) -> Any:
    if name == "bool":
        return rng.integers(0, 2, count).astype(np.bool_)
    if name.startswith("float"):
        return rng.normal(size=count).astype(name)
    info = np.iinfo(name)
    return rng.integers(info.min, info.max, count, dtype=name, endpoint=True)


@pytest.mark.parametrize("dialect", ["little", "big", "ros1"])
@settings(max_examples=40, deadline=None)
@given(text=definitions(), seed=st.integers(0, 2**32 - 1))
def test_random_definitions_decode_like_rosbags(dialect: str, flatten: Flatten, text: str, seed: int) -> None:
    ros1 = dialect == "ros1"
    store = get_typestore(Stores.EMPTY)
    types = get_types_from_msg(text, "test_pkg/msg/Outer")
    store.register({k: v for k, v in types.items() if k.startswith("test_pkg")})
    rng = np.random.default_rng(seed)
    name = "test_pkg/msg/Outer"
    messages = [random_value(store, (Nodetype.NAME, name), rng) for _ in range(6)]
    if ros1:
        for m in messages:  # ROS 1 times count from 1970
            for path in vars(m):
                if hasattr(getattr(m, path), "sec"):
                    getattr(m, path).sec &= 0x7FFFFFFF
        payloads = [bytes(store.serialize_ros1(m, name)) for m in messages]
        messages = [store.deserialize_ros1(p, name) for p in payloads]
    else:
        payloads = [bytes(store.serialize_cdr(m, name, little_endian=dialect == "little")) for m in messages]
    order = rng.permutation(12) % 6
    kind = resolve(name, "ros1msg" if ros1 else "ros2msg", text, ros1)
    found, outcome = columns(kind, [payloads[i] for i in order])
    assert outcome.bad == 0
    expected = [flatten(messages[i]) for i in order]
    if ros1:
        unsigned = [{k: v & 0xFFFFFFFF if k.endswith(".sec") else v for k, v in e.items()} for e in expected]
        expected = unsigned
    same(found, expected)


def test_arrays_beside_names_are_keyed_by_name_and_follow_a_change_of_order() -> None:
    kind = resolve("p/msg/J", "ros2msg", "string[] name\nfloat64[] velocity", False)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("string[] name\nfloat64[] velocity", "p/msg/J"))
    make = store.types["p/msg/J"]
    rows = [(["fl", "fr"], [1.0, 2.0]), (["fr", "fl"], [3.0, 4.0]), (["fl", "fr"], [5.0, 6.0])]
    payloads = [bytes(store.serialize_cdr(make(n, np.array(v)), "p/msg/J")) for n, v in rows]
    found, _ = columns(kind, payloads)
    assert found == {"velocity[fl]": {0: 1.0, 1: 4.0, 2: 5.0}, "velocity[fr]": {0: 2.0, 1: 3.0, 2: 6.0}}


def test_repeated_or_empty_names_leave_numbers() -> None:
    kind = resolve("p/msg/J", "ros2msg", "string[] name\nfloat64[] v", False)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("string[] name\nfloat64[] v", "p/msg/J"))
    payload = bytes(store.serialize_cdr(store.types["p/msg/J"](["a", "a"], np.array([1.0, 2.0])), "p/msg/J"))
    assert set(columns(kind, [payload])[0]) == {"v[0]", "v[1]"}


def test_names_of_the_outer_message_key_arrays_of_inner_messages() -> None:
    text = (
        "string[] joint_names\np/Values[] interface_values\n" + "=" * 80 + "\nMSG: p/Values\nstring[] interface_names\n"
        "float64[] values"
    )
    kind = resolve("p/msg/D", "ros2msg", text, False)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, "p/msg/D"))
    inner = store.types["p/msg/Values"]
    message = store.types["p/msg/D"](
        ["a", "b"], [inner(["pos", "vel", "eff"], np.array([1.0, 2.0, 3.0])), inner(["vel"], np.array([4.0]))]
    )
    found, _ = columns(kind, [bytes(store.serialize_cdr(message, "p/msg/D"))])
    assert found["interface_values[a].values[vel]"] == {0: 2.0}
    assert found["interface_values[b].values[vel]"] == {0: 4.0}


def test_integers_keep_their_type() -> None:
    kind = resolve("p/msg/U", "ros2msg", "uint64 u", False)
    data = np.frombuffer(b"\0\1\0\0" + (2**64 - 1).to_bytes(8, "little"), np.uint8)
    store = Store()
    store.begin(1)
    Decoder(kind, Outcome(), store).decode(data, np.array([0]), np.array([12]))
    store.end()
    rows, values = store.finish()["u"]
    assert rows is None
    assert values.dtype == np.uint64
    assert values[0] == 2**64 - 1


def test_strings_that_change_their_length_all_the_time_need_no_slow_way() -> None:
    kind = resolve("p/msg/S", "ros2msg", "string[] note\nfloat64 v", False)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("string[] note\nfloat64 v", "p/msg/S"))
    make = store.types["p/msg/S"]
    cuts = [(a, b) for a in range(9) for b in range(9) if a + b <= 16][:60]
    payloads = [
        bytes(store.serialize_cdr(make(["x" * a, "y" * b, "z" * (16 - a - b)], float(i)), "p/msg/S"))
        for i, (a, b) in enumerate(cuts)
    ]
    found, outcome = columns(kind, payloads)
    assert found == {"v": {i: float(i) for i in range(len(cuts))}}
    assert outcome.slow == 0


def test_names_that_change_all_the_time_are_decoded_one_by_one_and_counted() -> None:
    kind = resolve("p/msg/S", "ros2msg", "string[] name\nfloat64[] v", False)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("string[] name\nfloat64[] v", "p/msg/S"))
    make = store.types["p/msg/S"]
    count = MAX_PROGRAMS + 10
    payloads = [bytes(store.serialize_cdr(make([f"n{i:03}"], np.array([float(i)])), "p/msg/S")) for i in range(count)]
    found, outcome = columns(kind, payloads)
    assert found == {f"v[n{i:03}]": {i: float(i)} for i in range(count)}
    assert outcome.slow > 0


def payload_errors() -> Iterator[tuple[str, bytes, str]]:
    yield "float64[] v", b"\0\1\0\0" + (5).to_bytes(4, "little"), "ends inside a field"
    yield "float64 v", b"\0\1\0\0" + bytes(16), "follow the last field"
    yield "float64 v", b"\0\3\0\0" + bytes(8), "not plain CDR"
    yield "float64 v", b"\0", "no encapsulation"
    yield "int8[] v", b"\0\1\0\0" + (2**32 - 1).to_bytes(4, "little"), "ends inside a field"


@pytest.mark.parametrize(("text", "payload", "reason"), list(payload_errors()))
def test_payloads_that_do_not_fit_are_counted_with_the_reason(text: str, payload: bytes, reason: str) -> None:
    found, outcome = columns(resolve("p/msg/T", "ros2msg", text, False), [payload])
    assert not found
    assert outcome.bad == 1
    assert reason in outcome.reason


def test_a_definition_of_another_message_is_given_up_and_every_message_counted() -> None:
    _, outcome = columns(resolve("p/msg/T", "ros2msg", "float64 v", False), [b"\0\1\0\0" + bytes(20)] * 3000)
    assert outcome.bad == 3000


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("p/T self", "without end"),
        ("p/Missing a", "lacks the type"),
        ("}{", "cannot be parsed"),
        ("\n".join(f"float64 f{i}" for i in range(100_000)), "at most"),
    ],
)
def test_hostile_definitions_are_refused(text: str, reason: str) -> None:
    with pytest.raises(DefinitionError, match=reason):
        resolve("p/msg/T", "ros2msg", text, False)
