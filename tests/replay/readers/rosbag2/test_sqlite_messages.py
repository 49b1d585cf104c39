"""Pages parsed by the compiled walks against the sqlite3 module, on whole and damaged databases."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log
from replay.readers.rosbag2.sqlite_file import open_image
from replay.readers.rosbag2.sqlite_messages import Database
from replay.readers.rosbag2.sqlite_topics import open_database

TABLES = """
create table topics(id integer primary key, name text not null, type text not null, serialization_format text not null);
create table messages(id integer primary key, topic_id integer not null, timestamp integer not null, data blob not null);
create index timestamp_idx on messages (timestamp asc);
insert into topics values (1, '/a', 'std_msgs/msg/Float64', 'cdr'), (2, '/b', 'std_msgs/msg/Float64', 'cdr');
"""
Row = tuple[int, int, bytes]
Make = Callable[..., Path]


def rows_of(count: int, longest: int) -> list[Row]:
    rng = np.random.default_rng(5)
    sizes = np.where(rng.random(count) < 0.2, rng.integers(0, longest, count), rng.integers(0, 90, count))
    return [(1 + i % 2, 10**9 + 10 * i, rng.bytes(int(n))) for i, n in enumerate(sizes)]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    def build(rows: list[Row], *pragmas: str, tables: str = TABLES, name: str = "x.db3") -> Path:
        path = tmp_path / name
        with closing(sqlite3.connect(path)) as base:
            for pragma in pragmas:
                base.execute(f"pragma {pragma}")
            base.executescript(tables)
            with base:
                base.executemany("insert into messages(topic_id, timestamp, data) values (?, ?, ?)", rows)
        return path

    return build


def found(path: Path, window: tuple[int, int] | None = None, topics: Any = None) -> tuple[list[Row], Database, Report]:
    report = Report()
    base = open_database(open_image(path, report), report)
    out = []
    for rows in base.messages(topics, window, payloads=True):
        for topic, stamp, at, size in zip(rows.topic, rows.stamp, rows.start, rows.length, strict=True):
            out.append((int(topic), int(stamp), rows.data[at : at + size].tobytes()))
    return out, base, report


def oracle(path: Path) -> list[Row]:
    with closing(sqlite3.connect(path)) as base:
        return base.execute("select topic_id, timestamp, data from messages order by id").fetchall()


@pytest.mark.parametrize("page", [512, 1024, 4096, 65536])
@pytest.mark.parametrize("longest", [600, 150_000])
def test_rows_are_those_of_sqlite(make: Make, page: int, longest: int) -> None:
    path = make(rows_of(600, longest), f"page_size = {page}")
    rows, base, report = found(path)
    assert rows == oracle(path)
    assert report.damage == []
    assert base.counts == {1: 300, 2: 300}
    assert (min(base.bounds), max(base.bounds)) == (10**9, 10**9 + 5990)
    assert found(path, topics=["/b"])[0] == [r for r in rows if r[0] == 2]


@pytest.mark.parametrize("window", [(10**9 + 1005, 10**9 + 2000), (0, 10**9 + 1), (10**9 + 5990, 2**63 - 1), (5, 6)])
def test_a_window_is_taken_from_the_index_and_is_exact(make: Make, window: tuple[int, int]) -> None:
    rows = rows_of(3000, 5000)
    path = make(rows)
    expected = [r for r in oracle(path) if window[0] <= r[1] < window[1]]
    assert found(path, window)[0] == expected
    for k, text in enumerate(("-- create index", "create unique index")):
        plain = make(rows, tables=TABLES.replace("create index", text), name=f"{k}.db3")
        assert found(plain, window)[0] == expected
    for k, text in enumerate(("(timestamp desc)", "(timestamp) where topic_id = 1", "(topic_id, timestamp)")):
        odd = make(rows, tables=TABLES.replace("(timestamp asc)", text), name=f"odd{k}.db3")
        assert found(odd, window)[0] == expected


@pytest.mark.parametrize("pragma", ["encoding = 'UTF-16le'", "encoding = 'UTF-16be'", "auto_vacuum = full"])
def test_other_encodings_and_vacuum(make: Make, pragma: str) -> None:
    path = make(rows_of(500, 9000), pragma)
    rows, base, _ = found(path)
    assert rows == oracle(path)
    assert base.connections[1].topic == "/a"


@pytest.mark.parametrize(
    "columns",
    [
        "timestamp integer, data blob, topic_id integer",
        "data blob, topic_id integer, timestamp integer",
        "[topic_id] integer, extra text default 'x, (y)', \"timestamp\" integer, data blob, unique(topic_id, timestamp)",
    ],
)
def test_columns_in_any_order(make: Make, columns: str) -> None:
    path = make(rows_of(400, 20_000), tables=TABLES.split("create table messages")[0] + f"""
        create table messages(id integer primary key, {columns});
        insert into topics values (1, '/a', 'std_msgs/msg/Float64', 'cdr'), (2, '/b', 'std_msgs/msg/Float64', 'cdr');
    """)  # fmt: skip
    rows, _, report = found(path)
    assert rows == oracle(path)
    assert report.damage == []


def test_extreme_stamps_and_wrong_types(make: Make) -> None:
    path = make([(1, 2**62, b"far"), (1, -5, b"before"), (1, 0, b"zero"), (1, 1, b"")])
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("insert into messages values (5, 1, 3.5, x'00'), (6, 'word', 7, x'00'), (7, 1, 7, 'text')")
    rows, _, report = found(path)
    assert rows == [(1, 2**62, b"far"), (1, 0, b"zero"), (1, 1, b"")]
    assert report.damage == ["x.db3: 4 rows hold no message with a proper stamp"]


def test_deleted_rows_stay_deleted_and_are_named(make: Make) -> None:
    path = make(rows_of(2000, 300))
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("delete from messages where id between 101 and 400")
    rows, _, report = found(path)
    assert rows == oracle(path)
    assert report.damage == []
    assert any("300 of the row numbers up to 2000 are missing" in n for n in report.notes)


def live(tmp_path: Path, mode: str, change: Callable[[sqlite3.Connection], Any], source: Path) -> Path:
    """Copy of a database and what stands beside it while a connection has just changed it."""
    work, copy = tmp_path / "work.db3", tmp_path / "copy"
    shutil.copy(source, work)
    copy.mkdir()
    with closing(sqlite3.connect(work, isolation_level=None)) as base:
        base.execute(f"pragma journal_mode = {mode}")
        base.execute("pragma wal_autocheckpoint = 0")
        base.execute("pragma cache_size = 2")
        change(base)
        for path in tmp_path.glob("work.db3*"):
            shutil.copy(path, copy / path.name)
    return copy / "work.db3"


def insert(base: sqlite3.Connection, rows: list[Row]) -> None:
    base.executemany("insert into messages(topic_id, timestamp, data) values (?, ?, ?)", rows)


def test_a_write_ahead_log_counts_up_to_its_last_transaction(make: Make, tmp_path: Path) -> None:
    rows = rows_of(900, 9000)

    def change(base: sqlite3.Connection) -> None:
        base.execute("begin")
        insert(base, rows[300:600])
        base.execute("commit")
        base.execute("begin")
        insert(base, rows[600:])  # never committed

    path = live(tmp_path, "wal", change, make(rows[:300]))
    before = {p.name: p.read_bytes() for p in path.parent.iterdir()}
    got, _, report = found(path)
    assert got == rows[:600]
    assert any("read together with work.db3-wal" in n for n in report.notes)
    assert {p.name: p.read_bytes() for p in path.parent.iterdir()} == before


def test_a_damaged_write_ahead_log_counts_as_far_as_its_checksums(make: Make, tmp_path: Path) -> None:
    rows = rows_of(900, 900)

    def change(base: sqlite3.Connection) -> None:
        for k in (300, 600):
            base.execute("begin")
            insert(base, rows[k : k + 300])
            base.execute("commit")

    path = live(tmp_path, "wal", change, make(rows[:300]))
    wal = path.with_name("work.db3-wal")
    raw = bytearray(wal.read_bytes())
    raw[len(raw) - 5000] ^= 1
    wal.write_bytes(raw)
    got, _, report = found(path)
    assert got == oracle(path)[: len(got)] == rows[:600]
    assert any("fail their checksums" in d for d in report.damage)


def test_a_rollback_journal_undoes_the_unfinished_transaction(make: Make, tmp_path: Path) -> None:
    rows = rows_of(900, 9000)

    def change(base: sqlite3.Connection) -> None:
        base.execute("begin")
        base.execute("update messages set timestamp = timestamp + 1, data = x'00'")
        insert(base, rows[300:])

    path = live(tmp_path, "delete", change, make(rows[:300]))
    assert path.with_name("work.db3-journal").stat().st_size > 0
    got, _, report = found(path)
    assert got == rows[:300]
    assert any("undid its last, unfinished transaction" in n for n in report.notes)


def pages_of(path: Path, kind: int) -> list[int]:
    """Starts of the pages of one type."""
    raw = path.read_bytes()
    return [at for at in range(4096, len(raw), 4096) if raw[at] == kind]


def overwrite(path: Path, at: int, content: bytes) -> None:
    raw = bytearray(path.read_bytes())
    raw[at : at + len(content)] = content
    path.write_bytes(raw)


def test_a_lost_inner_page_costs_no_message(make: Make) -> None:
    rows = rows_of(3000, 300)
    path = make(rows)
    for at in pages_of(path, 5):
        overwrite(path, at, bytes(4096))
    got, _, report = found(path)
    assert got == rows
    assert any("pages of messages were found beside it" in d for d in report.damage)


def test_a_lost_leaf_costs_its_messages_and_they_are_counted(make: Make) -> None:
    rows = rows_of(3000, 60)
    path = make(rows)
    overwrite(path, pages_of(path, 13)[-3], bytes(4096))
    got, _, report = found(path)
    assert 0 < 3000 - len(got) < 200
    assert set(got) < set(rows)
    assert any(f"{3000 - len(got)} of the row numbers up to 3000 are missing" in d for d in report.damage)


def test_a_lost_schema_costs_no_message(make: Make) -> None:
    rows = rows_of(2000, 300)
    path = make(rows)
    overwrite(path, 0, bytes(4096))
    got, base, report = found(path)
    assert got == rows
    assert [c.topic for c in base.connections.values()] == ["/a", "/b"]
    assert any("its first page is damaged" in d for d in report.damage)


def test_loops_and_wild_pointers_end(make: Make) -> None:
    path = make(rows_of(1500, 30_000))
    inner = pages_of(path, 5)[0]
    overwrite(path, inner + 8, (inner // 4096 + 1).to_bytes(4, "big"))  # its last child is the page itself
    got, _, report = found(path)
    assert len(got) > 1000
    assert any("named twice" in d for d in report.damage)


def test_random_damage_never_raises_nor_falls_behind_sqlite(make: Make) -> None:
    rows = rows_of(600, 3000)
    path = make(rows)
    raw, whole = path.read_bytes(), set(rows)
    rng = np.random.default_rng(11)
    for i in range(60):
        changed = bytearray(raw)
        place = int(rng.integers(100, len(raw)))
        if i % 3 == 0:
            changed = changed[:place]
        elif i % 3 == 1:
            changed[place] ^= 1 << int(rng.integers(0, 8))
        else:
            changed[place : place + 32] = rng.bytes(32)
        path.write_bytes(changed)
        peer: set[Row] = set()
        try:
            with closing(sqlite3.connect(f"{path.as_uri()}?immutable=1", uri=True)) as base:
                for row in base.execute("select topic_id, timestamp, data from messages"):
                    peer.add(row)
        except sqlite3.Error:
            pass
        got, _, report = found(path)
        assert set(got) & whole >= peer & whole
        assert len(set(got) & whole) == len(whole) or report.damage or len(got) == len(rows)


@pytest.mark.parametrize("seed", range(6))
def test_pages_of_noise_hold_nothing(make: Make, seed: int) -> None:
    path = make([])
    head = path.read_bytes()[:100]
    noise = np.random.default_rng(seed).integers(0, 256, 400 << 10, dtype=np.uint8)
    noise[::4096] = (13, 5, 2, 10)[seed % 4]
    path.write_bytes(head + noise.tobytes())
    assert found(path)[0] == []
    with pytest.raises(LogError, match="can be read"):
        read_log(path, SourceOptions())
