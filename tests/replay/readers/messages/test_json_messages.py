"""Columns of JSON messages equal what a plain walk over each message finds."""

from __future__ import annotations

import json
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
from replay.readers.messages import json_messages
from replay.readers.messages.cdr import Outcome
from replay.readers.messages.fields import is_key_list


def flat(value: Any, path: str = "", scopes: tuple[list[str], ...] = ()) -> Iterator[tuple[str, int | float]]:
    """Every number of one value with its path."""
    if isinstance(value, int | float):
        yield path or "value", value
    elif isinstance(value, dict):
        lists = [v for k, v in value.items() if is_key_list(k) and isinstance(v, list)]
        names = [[n.strip() for n in v] for v in lists if all(isinstance(n, str) for n in v)]
        scopes = (*(n for n in names if len(set(n)) == len(n) and all(n)), *scopes)
        for key, item in value.items():
            yield from flat(item, f"{path}.{key}" if path else key, scopes)
    elif isinstance(value, list) and len(value) <= 64:
        labels = next((n for n in scopes if len(n) == len(value)), range(len(value)))
        for label, item in zip(labels, value, strict=True):
            yield from flat(item, f"{path}[{label}]", scopes)


def columns(payloads: list[bytes], outcome: Outcome | None = None) -> dict[str, tuple[list[int], list[Any]]]:
    """Rows and values by path."""
    data = np.frombuffer(b"\0" + b"\0".join(payloads), np.uint8)
    lengths = np.array([len(p) for p in payloads], np.int64)
    starts = np.cumsum(lengths + 1) - lengths
    found: dict[str, list[tuple[int, Any]]] = {}
    for part in json_messages.decode(data, starts, lengths, outcome or Outcome())[1]:
        for path, values in part.columns.items():
            found.setdefault(path, []).extend(zip(part.rows.tolist(), values.tolist(), strict=True))
    return {p: ([r for r, _ in sorted(v)], [x for _, x in sorted(v)]) for p, v in found.items()}


def expected(values: list[Any]) -> dict[str, tuple[list[int], list[Any]]]:
    found: dict[str, tuple[list[int], list[Any]]] = {}
    for row, value in enumerate(values):
        for path, number in flat(value):
            rows, numbers = found.setdefault(path, ([], []))
            rows.append(row)
            numbers.append(number)
    return found


KEYS = st.sampled_from(["a", "b", "name", "joint_names", "position"])
VALUES = st.recursive(
    st.one_of(
        st.none(), st.booleans(), st.integers(-(2**53), 2**53), st.floats(allow_nan=False, allow_infinity=False),
        st.sampled_from(["fl", "fr", "x "]),
    ),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(KEYS, inner, max_size=4)),
    max_leaves=12,
)  # fmt: skip


@given(st.lists(st.dictionaries(KEYS, VALUES, max_size=4), min_size=1, max_size=8))
def test_columns_are_the_plain_walks_numbers(values: list[Any]) -> None:
    assert columns([json.dumps(v).encode() for v in values]) == expected(values)


@given(
    st.lists(
        st.sampled_from(['{"a":[{}', "{}]}", "{},{}", '{"a":1}', "", "1", "[", "]", '{"a":2}', "\xff"]), min_size=1
    )
)
def test_broken_messages_cost_only_themselves(texts: list[str]) -> None:
    outcome = Outcome()
    found = columns([t.encode("latin-1") for t in texts], outcome)
    own = {'{"a":1}': 1, '{"a":2}': 2}
    rows = [i for i, t in enumerate(texts) if t in own]
    assert found.get("a", ([], [])) == (rows, [own[texts[i]] for i in rows])
    assert outcome.bad == sum(t not in (*own, "1") for t in texts)


def test_integers_are_exact_to_64_bits_and_become_fractions_beyond() -> None:
    big = [2**63 - 1, -(2**63), 2**64 - 1]
    assert columns([b'{"a": %d}' % v for v in big[:2]])["a"][1] == big[:2]
    assert columns([b'{"a": %d}' % v for v in (big[2], 5)])["a"][1] == [big[2], 5]
    assert columns([b'{"a": 1}', b'{"a": -1}', b'{"a": %d}' % 2**64])["a"][1] == [1.0, -1.0, 2.0**64]


def test_null_and_text_give_no_sample_and_words_for_no_number_are_understood() -> None:
    outcome = Outcome()
    payloads = [b'{"a": 1.5}', b'{"a": null}', b'{"a": "off"}', b'{"a": NaN}', b'{"a": "-Infinity"}', b'{"a": true}']
    rows, values = columns(payloads, outcome)["a"]
    assert rows == [0, 3, 4, 5]
    assert values[0] == 1.5
    assert np.isnan(values[1])
    assert values[2:] == [-np.inf, 1.0]
    assert (outcome.bad, outcome.slow) == (0, 1)


def test_objects_of_many_shapes_are_counted_as_slow() -> None:
    outcome = Outcome()
    assert len(columns([b'{"a%d": 1, "b": 2}' % i for i in range(40)], outcome)) == 41
    assert outcome.slow == 40


@pytest.mark.parametrize(
    ("head", "stamp"),
    [
        ('"header": {"stamp": {"sec": 7, "nanosec": 5}}', 7_000_000_005),
        ('"header": {"stamp": {"secs": 7, "nsecs": 5}}', 7_000_000_005),
        ('"timestamp": {"sec": 7, "nsec": 5}', 7_000_000_005),
        ('"stamp": {"sec": 99999999999999, "nanosec": 5}', 0),
        ('"stamp": {"sec": 7}', None),
    ],
)
def test_shapes_of_the_header_stamp(head: str, stamp: int | None) -> None:
    payload = b'{%s, "v": 1}' % head.encode()
    path, parts = json_messages.decode(
        np.frombuffer(payload, np.uint8), np.array([0]), np.array([len(payload)]), Outcome()
    )
    found = {p: v[0] for part in parts for p, v in part.columns.items()}
    assert (path is None) == (stamp is None)
    if path is not None:
        assert found[f"{path}.sec"] * 1_000_000_000 + found[f"{path}.nanosec"] == stamp


def test_messages_without_a_stamp_stand_on_the_log_clock(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    messages = [{"v": 0}, {"v": 1, "timestamp": {"sec": 7, "nsec": 0}}, {"v": 2}, {"v": [0] * 65}]
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/v", "json", writer.register_schema("V", "jsonschema", b"{}"))
        for i, message in enumerate(messages):
            writer.add_message(channel, 7_000_000_000 + i, json.dumps(message).encode(), 0)
        writer.finish()
    log = McapReader().read(path, SourceOptions())
    assert log.channels["/v.v"].stamps.tolist() == [7_000_000_000, 7_000_000_000, 7_000_000_002]
    assert any("3 of 4 header stamps are zero" in note for note in log.summary.notes)
    assert any("left out arrays of more than 64 elements: v" in note for note in log.summary.notes)
