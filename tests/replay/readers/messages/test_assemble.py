from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from replay.errors import LogError
from replay.log.raw_log import LogSummary, RawLog
from replay.log.reading_notes import Report
from replay.readers.messages import assemble
from replay.readers.messages.assemble import Assembler
from replay.readers.messages.connection import Block, Connection

STORE = get_typestore(Stores.LATEST)
KIND = "sensor_msgs/msg/JointState"
TEXT = STORE.generate_msgdef(KIND, ros_version=2)[0]
ONE = Connection("/joints", KIND, "cdr", "ros2msg", TEXT)
TWO = Connection("/joints", KIND, "cdr", "ros2msg", TEXT + "\n# from another recorder\n")
SECOND = 1_000_000_000


def joint_state(i: int, names: list[str], frame: str) -> bytes:
    types = STORE.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](100 + i, 7), frame)
    speeds = np.array([i + 0.25 * k for k in range(len(names))])
    return bytes(STORE.serialize_cdr(types[KIND](header, names, speeds, -speeds, np.empty(0)), KIND))


def payloads(n: int) -> list[bytes]:
    """Messages of a changing frame, two orders of joints, and some joint missing now and then."""
    orders = (["a", "b"], ["b", "a"], ["a"])
    return [joint_state(i, orders[2 if i % 7 == 3 else i // 10 % 2], "f" * (i // 4 % 5)) for i in range(n)]


def block(connection: Connection, data: Any, starts: Any, lengths: Any, rows: Any) -> Block:
    rows = np.asarray(rows)
    stamps = (100 + rows) * SECOND
    return Block(connection, data, np.asarray(starts)[rows], np.asarray(lengths)[rows], stamps, stamps + 5)


def assembled(made: list[bytes], size: int, clock: Any = "header", two: bool = False, expect: int = 0) -> RawLog:
    """Assemble messages in batches of one reused buffer; with `two`, connections take turns in it."""
    report = Report()
    assembler = Assembler(clock, report)
    if expect:
        assembler.expect(ONE, expect)
    buffer = np.empty(1 << 16, np.uint8)
    lengths = np.array([len(p) for p in made])
    for first in range(0, len(made), size):
        some = np.arange(first, min(first + size, len(made)))
        ends = np.cumsum(lengths[some])
        buffer[: ends[-1]] = np.frombuffer(b"".join(made[i] for i in some), np.uint8)
        starts = np.zeros(len(made), np.int64)
        starts[some] = ends - lengths[some]
        blocks = [block(ONE, buffer, starts, lengths, some)]
        if two:
            blocks = [block(c, buffer, starts, lengths, some[k::2]) for k, c in ((1, TWO), (0, ONE)) if len(some) > k]
        assembler.add(blocks)
        buffer[:] = 255
    return assembler.finish(LogSummary("x", "test", 0, 0, ()))


def contents(log: RawLog) -> dict[str, tuple[list[int], list[Any]]]:
    return {name: (c.stamps.tolist(), c.values.tolist()) for name, c in sorted(log.channels.items())}


def wanted(n: int) -> dict[str, tuple[list[int], list[Any]]]:
    """Make the same by hand."""
    out: dict[str, tuple[list[int], list[Any]]] = {}
    for i in range(n):
        for k, name in enumerate((["a", "b"], ["b", "a"], ["a"])[2 if i % 7 == 3 else i // 10 % 2]):
            for field, sign in (("position", 1), ("velocity", -1)):
                stamps, values = out.setdefault(f"/joints.{field}[{name}]", ([], []))
                stamps.append((100 + i) * SECOND + 7)
                values.append(sign * (i + 0.25 * k))
    return dict(sorted(out.items()))


@pytest.mark.parametrize("two", [False, True])
@pytest.mark.parametrize("size", [1, 3, 17, 100])
def test_batches_change_nothing_and_rows_stand_in_recorded_order(size: int, two: bool) -> None:
    log = assembled(payloads(60), size, two=two)
    assert contents(log) == wanted(60)
    assert not log.summary.damage


@pytest.mark.parametrize("expect", [1, 59, 61, 10_000, 2**62])
def test_what_is_foretold_need_not_be_true(expect: int) -> None:
    assert contents(assembled(payloads(60), 13, expect=expect)) == wanted(60)


def test_a_log_that_outgrows_memory_goes_to_files_and_comes_back_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assemble, "MEMORY", 1000)
    monkeypatch.setattr(assemble, "_LOOK_EVERY", 1)
    for two in (False, True):
        assert contents(assembled(payloads(60), 7, two=two)) == wanted(60)


def test_a_temporary_folder_that_takes_nothing_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(assemble, "MEMORY", 1000)
    monkeypatch.setattr(assemble, "_LOOK_EVERY", 1)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "absent"))
    with pytest.raises(LogError, match=r"the temporary folder .*absent cannot take .*set TMPDIR"):
        assembled(payloads(60), 7)


def test_long_blocks_are_taken_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assemble, "_MOST_ROWS", 8)
    assert contents(assembled(payloads(60), 60)) == wanted(60)


def test_publish_stamps_are_those_of_the_container() -> None:
    log = assembled(payloads(20), 6, clock="publish")
    assert log.channels["/joints.position[a]"].stamps.tolist() == [(100 + i) * SECOND + 5 for i in range(20)]


def test_columns_of_one_layout_share_their_stamps() -> None:
    log = assembled([joint_state(i, ["a", "b"], "base") for i in range(40)], 9)
    assert len({id(c.stamps) for c in log.channels.values()}) == 1


def test_damaged_messages_are_counted_and_cost_no_others() -> None:
    made = payloads(60)
    for i in range(20, 40):
        made[i] = made[i][:-9] if i % 2 else made[i][:12] + b"\xff\xff\xff\x7f" + made[i][16:]
    log = assembled(made, 16)
    (damage,) = log.summary.damage
    assert "20 of 60 messages cannot be decoded" in damage
    good = {}
    for name, (stamps, values) in wanted(60).items():
        kept = [k for k, s in enumerate(stamps) if not 120 <= s // SECOND < 140]
        good[name] = [stamps[k] for k in kept], [values[k] for k in kept]
    assert contents(log) == good


def test_a_text_without_numbers_gives_no_channel_and_no_damage() -> None:
    kind = "std_msgs/msg/String"
    connection = Connection("/text", kind, "cdr", "ros2msg", "string data")
    raw = [bytes(STORE.serialize_cdr(STORE.types[kind]("x" * n), kind)) for n in (0, 3, 9, 3)]
    lengths = np.array([len(r) for r in raw])
    assembler = Assembler("header", Report())
    data = np.frombuffer(b"".join(raw), np.uint8)
    assembler.add([Block(connection, data, np.cumsum(lengths) - lengths, lengths, np.arange(4))])
    log = assembler.finish(LogSummary("x", "test", 0, 0, ()))
    assert not log.channels
    assert not log.summary.damage


def test_places_outside_the_buffer_are_damage() -> None:
    raw = joint_state(0, ["a"], "base")
    data = np.frombuffer(raw, np.uint8)
    assembler = Assembler("header", Report())
    starts, lengths = np.array([0, 8, -4, 2**40]), np.array([len(raw)] * 4)
    assembler.add([Block(ONE, data, np.sort(starts), lengths, np.arange(4))])
    log = assembler.finish(LogSummary("x", "test", 0, 0, ()))
    assert log.channels["/joints.position[a]"].values.tolist() == [0.0]
    assert "3 of 4 messages" in log.summary.damage[0]
