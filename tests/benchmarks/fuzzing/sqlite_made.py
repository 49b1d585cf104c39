"""Recordings in SQLite that SQLite itself wrote, and that no recorder would: other pages, encodings, views, triggers, types, rows."""

from __future__ import annotations

import random
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

from tests.benchmarks.fuzzing import bombs
from tests.benchmarks.fuzzing.case import Case

T0 = 1_700_000_000_000_000_000
PAYLOADS = ("x'0001000000000000000000f03f'", "zeroblob({n})", "'text'", "NULL", "5", "1.5", "x''", "randomblob({n})")
STAMPS = (
    "{t}",
    "{t}",
    "{t}",
    "0",
    "-1",
    "9223372036854775807",
    "-9223372036854775808",
    "1.5e18",
    "'{t}'",
    "NULL",
    "x'00'",
    "cast({t} as real)",
)
TABLES = (
    "create table messages(id integer primary key, topic_id integer not null, timestamp integer not null, data blob not null)",
    "create table messages(id integer primary key, topic_id integer not null, timestamp integer not null, data blob not null)",
    "create table messages(topic_id integer, timestamp integer, data blob)",
    "create table messages(data blob, timestamp integer, topic_id integer, id integer primary key)",
    "create table messages(id integer primary key, topic_id integer, timestamp integer, data blob) without rowid",
    "create table messages(topic_id integer, timestamp integer, data blob, primary key(topic_id, timestamp)) without rowid",
    "create table messages(id integer primary key, topic_id integer, timestamp integer, data blob) strict",
    "create table messages(id integer primary key, topic_id integer, timestamp integer, data blob, more text default 'x', twice integer generated always as (topic_id * 2))",
    "create table messages(id integer primary key desc, topic_id, timestamp, data)",
    "create table Messages('id' integer primary key, [topic_id] integer, `timestamp` integer, \"data\" blob, check (1), foreign key (topic_id) references topics(id))",
    "create table m2(id integer primary key, topic_id integer, timestamp integer, data blob); create view messages as select * from m2",
    "create virtual table messages using fts4(topic_id, timestamp, data)",
    "create table messages(id integer primary key, "
    + ", ".join(f"c{k}" for k in range(1900))
    + ", topic_id integer, timestamp integer, data blob)",
    "create table messages(id integer primary key, topic_id integer, timestamp integer, data blob /* ' \" ( */ -- )\n)",
)
TOPICS = (
    "create table topics(id integer primary key, name text not null, type text not null, serialization_format text not null, offered_qos_profiles text not null)",
    "create table topics(id integer primary key, name text not null, type text not null, serialization_format text not null, offered_qos_profiles text not null, type_description_hash text)",
    "create table topics(id, name, type)",
    "create view topics as select 1 id, '/a' name, 'std_msgs/msg/Float64' type, 'cdr' serialization_format",
    "create table topics(id text, name blob, type text, serialization_format text, offered_qos_profiles text) strict",
)
PRAGMAS = ("auto_vacuum = full", "auto_vacuum = incremental", "encoding = 'UTF-16le'", "encoding = 'UTF-16be'", "secure_delete = on", "journal_mode = wal", "application_id = 5")  # fmt: skip


def made_up(folder: Path, source: random.Random) -> Case:
    """One database; `folder` is used and emptied."""
    path, done = folder / "made.db3", []
    with closing(sqlite3.connect(path, isolation_level=None)) as link:
        done.append(size := source.choice((512, 1024, 4096, 8192, 65536)))
        link.execute(f"pragma page_size = {size}")
        for pragma in source.sample(PRAGMAS, source.choice((0, 0, 1, 2))):
            link.execute(f"pragma {pragma}")
        table, topics = source.choice(TABLES), source.choice(TOPICS[:1] * 4 + TOPICS)
        done.append(table[:40])
        with suppress(sqlite3.Error):
            link.executescript(f"{topics}; {table};")
        if source.random() < 0.3:
            with suppress(sqlite3.Error):
                definition = bombs.text_definition(source).decode("latin-1")
                link.execute(
                    "create table message_definitions(id integer primary key, topic_type text, encoding text, encoded_message_definition text, type_description_hash text)"
                )
                link.execute("insert into message_definitions values (1, 'a/msg/B', 'ros2msg', ?, '')", (definition,))
        _rows(link, source)
        for statement in source.sample((
            "create index timestamp_idx on messages(timestamp)", "create trigger a after insert on messages begin delete from messages where id % 3 = 0; end",
            "delete from messages where rowid % 3 = 1", "vacuum", "create table schema(schema_version integer, ros_distro text)",
            "insert into messages(topic_id, timestamp, data) select topic_id, timestamp + 1, data from messages", "drop table topics",
            "update messages set rowid = -9223372036854775808 + rowid", "update messages set rowid = rowid + 9223372036854775000",
            "alter table messages add column late integer default 7", "alter table messages rename column data to Data",
            "create table metadata(id integer primary key, metadata_version integer, metadata text)",
        ), source.choice((0, 1, 2))):  # fmt: skip
            with suppress(sqlite3.Error):
                link.execute(statement)
        with suppress(sqlite3.Error):
            link.execute("pragma wal_checkpoint(truncate)")
    content = path.read_bytes()
    for left in folder.glob("made.db3*"):
        left.unlink()
    if content and source.random() < 0.1:
        content = (
            content[:20] + bytes([source.choice((1, 8, 255))]) + content[21:]
        )  # bytes kept free at the end of pages
    return Case(content, f"made up: {done}")


def _rows(link: sqlite3.Connection, source: random.Random) -> None:
    for k in range(source.choice((1, 2, 3))):
        name = source.choice(("'/a'", "'/a'", "''", "NULL", "x'ff'", "'../x'", "printf('%.*c', 70000, 'x')", "5"))
        kind = source.choice(("'std_msgs/msg/Float64'", "'std_msgs/msg/Float64'", "'a/msg/B'", "''", "NULL", "'a'"))
        number = source.choice((k + 1, k + 1, 0, -1, 2**31, 2**63 - 1))
        with suppress(sqlite3.Error):
            link.execute(
                f"insert into topics(id, name, type, serialization_format, offered_qos_profiles) values ({number}, {name}, {kind}, 'cdr', '')"
            )
    link.execute("begin")
    with suppress(sqlite3.Error):
        for i in range(source.choice((0, 1, 30, 400))):
            payload = source.choice(PAYLOADS[:1] * 6 + PAYLOADS).format(n=source.choice((0, 12, 400, 5000)))
            stamp = source.choice(STAMPS[:1] * 20 + STAMPS).format(t=T0 + i * 10**7)
            with suppress(sqlite3.IntegrityError):
                link.execute(
                    f"insert into messages(topic_id, timestamp, data) values ({source.choice((1, 1, 1, 2, 0, 'NULL', 2**63 - 1))}, {stamp}, {payload})"
                )
    link.execute("commit")
