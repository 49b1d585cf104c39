from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from replay.readers.messages.cdr import MAX_PROGRAMS, Decoder, Outcome
from replay.readers.messages.definitions import DefinitionError, resolve
from replay.readers.messages.topic_store import Store

BAR = "=" * 80


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


@pytest.mark.parametrize(("order", "head"), [("<", b"\0\7\0\0"), (">", b"\0\6\0\0")])
def test_plain_cdr2_aligns_to_four_bytes_and_states_the_size_of_collections_of_text(order: str, head: bytes) -> None:
    def pack(form: str, *values: Any) -> bytes:
        return struct.pack(order + form, *values)

    words = pack("I", 2) + pack("I", 2) + b"a\0\0\0" + pack("I", 4) + b"bcd\0"
    payload = head + pack("B3x", 7) + pack("d", 2.5) + pack("I", len(words)) + words + pack("I", 2) + pack("2d", 1, -3)
    kind = resolve("p/msg/T", "ros2msg", "uint8 a\nfloat64 d\nstring[] words\nfloat64[] v", False)
    found, outcome = columns(kind, [payload, payload.replace(b"bcd", b"b\0d")])
    assert outcome.bad == 0
    assert found == {"a": {0: 7, 1: 7}, "d": {0: 2.5, 1: 2.5}, "v[0]": {0: 1.0, 1: 1.0}, "v[1]": {0: -3.0, 1: -3.0}}
    wrong = payload.replace(pack("I", len(words)) + words, pack("I", len(words) - 4) + words)
    found, outcome = columns(kind, [wrong, payload])
    assert outcome.bad == 1
    assert set(found["a"]) == {1}


def test_long_arrays_of_messages_are_passed_over_and_named() -> None:
    text = f"float64 a\np/Inner[] path\np/Plain[] cloud\nfloat64 b\n{BAR}\nMSG: p/Inner\nstring frame\nfloat64 x"
    text += f"\n{BAR}\nMSG: p/Plain\nfloat32 x\nuint8 y\nfloat64 z\nuint8 w"
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, "p/msg/T"))
    inner, plain, outer = (store.types[f"p/msg/{name}"] for name in ("Inner", "Plain", "T"))
    kind = resolve("p/msg/T", "ros2msg", text, False)
    counts = [(5000, 40_003), (66, 65), (5001, 40_000), (65, 70)]
    payloads = [
        bytes(
            store.serialize_cdr(
                outer(i, [inner("f" * (k % 3), 0.5) for k in range(m)], [plain(0.5, 1, 2.5, 3)] * n, -i), "p/msg/T"
            )
        )
        for i, (m, n) in enumerate(counts)
    ]
    found, outcome = columns(kind, payloads)
    assert outcome.bad == outcome.slow == 0
    assert found == {"a": {i: float(i) for i in range(4)}, "b": {i: float(-i) for i in range(4)}}


def test_endless_sequences_of_nothing_are_refused() -> None:
    kind = resolve("p/Outer", "ros1msg", f"float64 a\np/Nothing[] b\n{BAR}\nMSG: p/Nothing\n", True)
    good, endless = struct.pack("<dI", 2.5, 3), struct.pack("<dI", 2.5, 2**32 - 1)
    found, outcome = columns(kind, [good, *[endless] * 20, good])
    assert found == {"a": {0: 2.5, 21: 2.5}}
    assert outcome.bad == 20
    assert "parts" in outcome.reason


IDL = f"""{BAR}
IDL: p/msg/Outer
// generated from rosidl_adapter/resource/msg.idl.em
#include "builtin_interfaces/msg/Time.idl"
#include "p/msg/Inner.idl"

module p {{
  module msg {{
    typedef double double__2[2];
    @verbatim (language="comment", text=
      "Two lines" "\\n"
      "# of comment")
    struct Outer {{
      builtin_interfaces::msg::Time stamp;
      boolean ready;
      sequence<p::msg::Inner> many;
      @unit (value="m/s")
      double__2 speeds;
    }};
  }};
}};

{BAR}
IDL: p/msg/Inner
module p {{
  module msg {{
    module Inner_Constants {{
      const uint8 LEFT = 1;
    }};
    struct Inner {{
      string<10> label;
      octet side;
      unsigned long long ticks;
    }};
  }};
}};

{BAR}
IDL: builtin_interfaces/msg/Time
module builtin_interfaces {{
  module msg {{
    struct Time {{
      long sec;
      unsigned long nanosec;
    }};
  }};
}};
"""


@pytest.mark.parametrize("encoding", ["ros2idl", "omgidl"])
def test_definitions_in_idl_decode_like_the_same_in_msg(encoding: str) -> None:
    text = f"builtin_interfaces/Time stamp\nbool ready\np/Inner[] many\nfloat64[2] speeds\n{BAR}\nMSG: p/Inner\n"
    text += f"string<=10 label\nbyte side\nuint64 ticks\n{BAR}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec"
    inner = b"\3\0\0\0ab\0\1" + struct.pack("<Q", 2**60), b"\1\0\0\0\0\2\0\0" + struct.pack("<Q", 7)
    payload = b"\0\1\0\0" + struct.pack("<iIB3xI", -1, 5, 1, 2) + b"".join(inner) + struct.pack("<2d", 0.5, -2)
    idl, outcome = columns(resolve("p/msg/Outer", encoding, IDL, False), [payload])
    assert outcome.bad == 0, outcome.reason
    assert idl == columns(resolve("p/msg/Outer", "ros2msg", text, False), [payload])[0]
    assert (idl["stamp.sec"], idl["many[0].ticks"], idl["speeds[1]"]) == ({0: -1}, {0: 2**60}, {0: -2.0})
