"""Columns against rosbags, message by message: random definitions, random payloads, and payloads that were damaged."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from replay.readers.messages.cdr import Decoder, Outcome
from replay.readers.messages.definitions import resolve
from replay.readers.messages.topic_store import Store

INTEGERS = tuple(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
NUMBERS = ("bool", "byte", "char", *INTEGERS, "float32", "float64")
SUFFIXES = ("", "", "[]", "[3]", "[<=5]", "[70]")
NAME = "test_pkg/msg/Outer"
BAR = "=" * 80
TIME = "int32 sec\nuint32 nanosec"
KEY = re.compile("^(names?|.*_names)$")
LONGEST = 64
PHASES = (Phase.explicit, Phase.reuse, Phase.generate)  # definitions hardly shrink, and slowly


@st.composite
def definitions(draw: st.DrawFn) -> str:
    """Definition of three levels; some fields are arrays of names, which key the arrays beside them."""

    def fields(kinds: tuple[str, ...], most: int) -> str:
        lines = [
            f"{draw(st.sampled_from(kinds))}{draw(st.sampled_from(SUFFIXES))} f{k}"
            for k in range(draw(st.integers(1, most)))
        ]
        if draw(st.integers(0, 2)) == 0:
            lines.insert(draw(st.integers(0, len(lines))), "string[] joint_names")
        return "\n".join(lines)

    deep = fields((*NUMBERS, "string"), 3)
    inner = fields((*NUMBERS, "string", "test_pkg/Deep", "builtin_interfaces/Time"), 4)
    outer = fields((*NUMBERS, "string", "test_pkg/Inner", "test_pkg/Deep", "builtin_interfaces/Time"), 6)
    parts = {"test_pkg/Inner": inner, "test_pkg/Deep": deep, "builtin_interfaces/Time": TIME}
    return outer + "".join(f"\n{BAR}\nMSG: {name}\n{text}" for name, text in parts.items())


def numbers(name: str, count: int, rng: np.random.Generator) -> Any:
    """Random bits, NaN and infinity among them."""
    if name == "bool":
        return rng.integers(0, 2, count).astype(np.bool_)
    dtype = np.dtype({"byte": "i1", "char": "u1"}.get(name, name))
    return rng.integers(0, 256, count * dtype.itemsize, np.uint8).view(dtype)


def random_value(store: Typestore, field: str, desc: Any, rng: np.random.Generator, width: int) -> Any:
    """One field's value; `width` bounds the length of sequences and strings."""
    kind, value = desc
    if kind == Nodetype.NAME:
        fields = store.fielddefs[value][1]
        values = [random_value(store, n, d, rng, width) for n, d in fields]
        if value == "builtin_interfaces/msg/Time":
            values = [int(rng.integers(0, 2**31)), int(rng.integers(0, 10**9))]
        return store.types[value](*values)
    if kind == Nodetype.BASE:
        return "é" * int(rng.integers(0, width + 1)) if value[0] == "string" else numbers(value[0], 1, rng)[0].item()
    sub, count = value
    if kind == Nodetype.SEQUENCE:
        count = int(rng.integers(0, min(count or 99, width) + 1))
        if field == "joint_names":
            return [("a", "b", "c", "d")[(k + count) % 4] for k in range(count)]
        if count and sub[0] == Nodetype.BASE and sub[1][0] != "string" and rng.integers(0, 8) == 0 and not value[1]:
            count = 66
    if sub[0] == Nodetype.BASE and sub[1][0] != "string":
        return numbers(sub[1][0], count, rng)
    return [random_value(store, "", sub, rng, width) for _ in range(count)]


def flatten(store: Typestore, kind: str, message: Any, scopes: tuple[Any, ...] = ()) -> dict[str, Any]:
    """Numbers of a decoded message by path; elements of sequences as long as a list of names are called by name."""
    out: dict[str, Any] = {}
    fields = store.fielddefs[kind][1]
    own = [getattr(message, n) for n, (k, _) in fields if KEY.match(n) and k == Nodetype.SEQUENCE]
    own = [[n.rstrip("\0").strip() for n in names] for names in own]
    scopes = (*[names for names in own if names and all(names)], *scopes)

    def walk(path: str, desc: Any, value: Any) -> None:
        if desc[0] == Nodetype.NAME:
            out.update({f"{path}.{p}": v for p, v in flatten(store, desc[1], value, scopes).items()})
        elif desc[0] == Nodetype.BASE:
            if desc[1][0] != "string":
                out[path] = value
        elif len(value) <= LONGEST:
            keys = [n for n in scopes if len(n) == len(value) == len(set(n)) and desc[0] == Nodetype.SEQUENCE]
            for i, item in enumerate(value):
                walk(f"{path}[{keys[0][i] if keys else i}]", desc[1][0], item)

    for name, desc in fields:
        walk(name, desc, getattr(message, name))
    return out


def decode(kind: Any, payloads: list[bytes], cut: int) -> tuple[list[dict[str, Any]], Outcome]:
    """Decode payloads in two batches, and sort the numbers by row."""
    outcome, store = Outcome(), Store()
    decoder = Decoder(kind, outcome, store)
    for batch in (payloads[:cut], payloads[cut:]):
        data = np.frombuffer(b"".join(batch) or b"\0", np.uint8)
        lengths = np.array([len(p) for p in batch], np.int64)
        store.begin(len(batch))
        decoder.decode(data, np.cumsum(lengths) - lengths, lengths)
        store.end()
    rows: list[dict[str, Any]] = [{} for _ in payloads]
    for path, (numbered, values) in store.finish().items():
        which = list(range(len(payloads))) if numbered is None else numbered.tolist()
        assert which == sorted(set(which))
        assert len(which) == len(values)
        for row, value in zip(which, values, strict=True):
            rows[row][path] = value
    return rows, outcome


def same(got: dict[str, Any], want: dict[str, Any]) -> None:
    """Compare the numbers of one message bit by bit; all NaN are alike."""
    assert got.keys() == want.keys()
    for path, value in got.items():
        expected = want[path]
        if value.dtype.kind == "u" and expected < 0:  # rosbags gives bytes and ROS 1 seconds a sign
            expected = int(expected) + (1 << 8 * value.dtype.itemsize)
        if value != value:
            assert expected != expected, path
        else:
            with np.errstate(invalid="ignore"):
                assert np.array(expected, value.dtype).tobytes() == value.tobytes(), path


class Case:
    """A definition, and rosbags for one dialect."""

    def __init__(self, text: str, dialect: str) -> None:
        self.ros1, self.dialect = dialect == "ros1", dialect
        self.store = get_typestore(Stores.EMPTY)
        types = get_types_from_msg(text, NAME)
        self.store.register({k: v for k, v in types.items() if k.startswith("test_pkg")})
        self.kind = resolve(NAME, "ros1msg" if self.ros1 else "ros2msg", text, self.ros1)

    def payload(self, rng: np.random.Generator, width: int) -> bytes:
        message = random_value(self.store, "", (Nodetype.NAME, NAME), rng, width)
        if self.ros1:
            return bytes(self.store.serialize_ros1(message, NAME))
        return bytes(self.store.serialize_cdr(message, NAME, little_endian=self.dialect == "little"))

    def oracle(self, payload: bytes) -> dict[str, Any]:
        read = self.store.deserialize_ros1 if self.ros1 else self.store.deserialize_cdr
        return flatten(self.store, NAME, read(payload, NAME))


@pytest.mark.parametrize("dialect", ["little", "big", "ros1"])
@settings(max_examples=30, deadline=None, phases=PHASES)
@given(text=definitions(), seed=st.integers(0, 2**32 - 1), width=st.integers(0, 7))
def test_every_number_equals_rosbags(dialect: str, text: str, seed: int, width: int) -> None:
    case, rng = Case(text, dialect), np.random.default_rng(seed)
    made = [case.payload(rng, width) for _ in range(8)]
    payloads = [made[i] for i in rng.integers(0, 8, 20)]
    rows, outcome = decode(case.kind, payloads, int(rng.integers(0, 20)))
    assert outcome.bad == 0, outcome.reason
    for payload, got in zip(payloads, rows, strict=True):
        same(got, case.oracle(payload))


def damaged(payload: bytes, rng: np.random.Generator) -> bytes:
    """Change bytes or words behind the encapsulation, cut or lengthen."""
    raw = bytearray(payload)
    how = int(rng.integers(0, 5))
    if how == 0:
        return bytes(raw[: int(rng.integers(0, len(raw) + 1))])
    if how == 1:
        return bytes(raw) + bytes(int(rng.integers(1, 9)))
    for _ in range(int(rng.integers(1, 4))):
        if len(raw) > 8:
            at = int(rng.integers(4, len(raw) - 3))
            if how == 2:
                raw[at] ^= 1 << int(rng.integers(0, 8))
            else:
                at = at // 4 * 4 if how == 3 else at
                word = int(rng.choice([0, 1, 2, 5, 65, 2**16, 2**31 - 1, 2**32 - 1, len(raw)]))
                raw[at : at + 4] = word.to_bytes(4, "little" if rng.integers(0, 2) else "big")
    return bytes(raw)


@pytest.mark.parametrize("dialect", ["little", "big", "ros1"])
@settings(max_examples=30, deadline=None, phases=PHASES)
@given(text=definitions(), seed=st.integers(0, 2**32 - 1), width=st.integers(0, 5))
def test_damaged_payloads_give_what_rosbags_gives_or_nothing(dialect: str, text: str, seed: int, width: int) -> None:
    case, rng = Case(text, dialect), np.random.default_rng(seed)
    made = [case.payload(rng, width) for _ in range(3)]
    payloads = [made[i % 3] if i % 3 == 0 else damaged(made[int(rng.integers(0, 3))], rng) for i in range(24)]
    rows, outcome = decode(case.kind, payloads, 12)
    refused = 0
    for payload, got in zip(payloads, rows, strict=True):
        try:
            want = case.oracle(payload)
        except SerdeError as error:
            if "codec can't decode" in str(error):  # broken text is no reason to lose the numbers beside it
                continue
            assert not got
            refused += 1
            continue
        same(got, want)
    assert outcome.bad >= refused
