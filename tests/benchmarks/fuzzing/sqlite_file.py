"""Damage of SQLite files: header, pages, cells and records in their places, and rows that no recorder writes."""

from __future__ import annotations

import random
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

from tests.benchmarks.fuzzing.damage import Spot, with_number

# Places and lengths of the numbers of the file header, and of a page's header
HEADER = ((16, 2), (18, 1), (19, 1), (20, 1), (21, 1), (22, 1), (23, 1), (24, 4), (28, 4), (32, 4), (36, 4), (40, 4), (44, 4),
          (48, 4), (52, 4), (56, 4), (60, 4), (64, 4), (68, 4), (92, 4), (96, 4))  # fmt: skip
PAGE = ((0, 1), (1, 2), (3, 2), (5, 2), (7, 1), (8, 4))
ODD = ("NULL", "-1", "9223372036854775807", "1e300", "'text'", "''", "x''", "x'00'", "zeroblob(100000)", "cast(x'ff' as text)", "1.5",
       "-9223372036854775808", "'<script>'")  # fmt: skip


def damaged(raw: bytes, source: random.Random) -> tuple[bytes, str]:
    """Change one number of a database's structure."""
    size = int.from_bytes(raw[16:18], "big") or 4096
    size = 65536 if size == 1 else size
    if source.random() < 0.15:
        at, length = source.choice(HEADER)
        return with_number(raw, Spot(at, length, "int"), source, "big"), f"header at {at}"
    page = source.randrange(max(len(raw) // size, 1))
    start = page * size + (100 if page == 0 else 0)
    leaf = raw[start] in (10, 13)
    count = int.from_bytes(raw[start + 3 : start + 5], "big")
    pointers = start + (8 if leaf else 12)
    way = source.random()
    if way < 0.3 or not count or raw[start] not in (2, 5, 10, 13):
        at, length = source.choice(PAGE)
        return with_number(raw, Spot(start + at, length, "int"), source, "big"), f"head of page {page + 1} at {at}"
    at = pointers + 2 * source.randrange(min(count, 400))
    if way < 0.5:
        return with_number(raw, Spot(at, 2, "int"), source, "big"), f"pointer of page {page + 1}"
    cell = page * size + int.from_bytes(raw[at : at + 2], "big")
    place = min(cell + source.randrange(source.choice((3, 12, 40))), len(raw) - 1)
    return with_number(raw, Spot(place, 1, "int"), source, "big"), f"cell of page {page + 1}, byte {place - cell}"


def rewritten(raw: bytes, folder: Path, source: random.Random) -> tuple[bytes, str]:
    """Change values, rows, columns or tables by SQL, with the library itself."""
    path = folder / "rewritten.db"
    path.write_bytes(raw)
    done = []
    with closing(sqlite3.connect(path, isolation_level=None)) as link:
        link.execute("pragma writable_schema = on")
        for _ in range(source.choice((1, 1, 2))):
            with suppress(sqlite3.Error, OverflowError):
                done.append(_statement(link, source))
                link.execute(done[-1])
        with suppress(sqlite3.Error):
            link.execute("pragma wal_checkpoint(truncate)")
    content = path.read_bytes()
    for left in folder.glob("rewritten.db*"):
        left.unlink()
    return content, "; ".join(done)[:200]


def _statement(link: sqlite3.Connection, source: random.Random) -> str:
    link.text_factory = lambda raw: raw.decode(errors="replace")
    tables = [
        row[0]
        for row in link.execute("select name from sqlite_schema where type = 'table' and name not like 'sqlite%'")
    ]
    if not tables:
        return "vacuum"
    table = source.choice(tables)
    columns = [row[1] for row in link.execute(f'pragma table_info("{table}")')]
    column, value = source.choice(columns or ["rowid"]), source.choice(ODD)
    some = source.choice(("1", "rowid % 7 = 3", "rowid = (select max(rowid) from " + f'"{table}")'))
    renamed = f'alter table "{table}" rename to "old {table}"'
    statements = (
        f'update "{table}" set "{column}" = {value} where {some}',
        f'update "{table}" set "{column}" = {value} where {some}',
        f'update "{table}" set "{column}" = "{column}" {source.choice(("+ 1", "* 1000", "|| x", ""))} where {some}',
        f'delete from "{table}" where {some}',
        f'insert into "{table}" select * from "{table}" where {some}',
        f'alter table "{table}" drop column "{column}"',
        f'alter table "{table}" rename column "{column}" to "z{column}"',
        f'alter table "{table}" add column "extra" default {value}',
        f'drop table "{table}"',
        renamed,
        f"update sqlite_schema set sql = replace(sql, '{column}', '{source.choice(('x', 'id', ''))}') where name = '{table}'",
        f"update sqlite_schema set rootpage = {source.choice((0, 1, 2, 3, 999999, -1))} where name = '{table}'",
        f"update sqlite_schema set type = 'view', rootpage = 0, sql = 'create view \"{table}\" as select 1' where name = '{table}'",
        f"pragma {source.choice(('user_version', 'application_id', 'schema_version'))} = {source.getrandbits(31)}",
        "vacuum",
    )
    return source.choice(statements)
