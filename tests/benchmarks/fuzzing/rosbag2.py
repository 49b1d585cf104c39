"""Recordings of rosbag2: database, write-ahead log, compressed files and metadata.yaml."""

from __future__ import annotations

import random
import shutil
import sqlite3
import tempfile
from contextlib import closing
from pathlib import Path

import numpy as np
import zstandard
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from tests.benchmarks.fuzzing import logs, sqlite_file
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.damage import FAR, blindly, reworded
from tests.benchmarks.fuzzing.sqlite_made import made_up

STORE = get_typestore(Stores.LATEST)
T0, COUNT = 1_700_000_000_000_000_000, 60
FLOAT, ARRAY = "std_msgs/msg/Float64", "std_msgs/msg/Float64MultiArray"
WAYS = ("db3", "wal", "folder", "yaml", "zstd", "messages zstd", "mcap", "mcap yaml")


class Rosbag2:
    """Folders and databases alone."""

    name = "rosbag2"

    def corpus(self, folder: Path) -> list[Sample]:
        """One recording for each way; /speed, and every tenth time the long /scan, which needs overflow pages."""
        return [_sample(way, folder / way.replace(" ", "-")) for way in WAYS]

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Blind damage, damage of the database's structure, rows that no recorder writes, or another text."""
        raw, target = sample.raw, sample.target
        if target.endswith(".db3") and source.random() < 0.3:
            with tempfile.TemporaryDirectory() as folder:
                return made_up(Path(folder), source)
        packed = target.endswith(".zstd")
        content = zstandard.ZstdDecompressor().decompress(raw, 1 << 24) if packed else raw
        if source.random() < 0.2:
            return Case(*blindly(raw, source), {"blind": True})
        if target.endswith(".yaml"):
            return Case(*source.choice((_yaml, _yaml, reworded))(raw, source), {"blind": True})
        if content.startswith(b"SQLite format 3"):
            if source.random() < 0.35:
                with tempfile.TemporaryDirectory() as folder:
                    content, what = sqlite_file.rewritten(content, Path(folder), source)
            else:
                content, what = sqlite_file.damaged(content, source)
        else:
            content, what = blindly(content, source)
        return Case(zstandard.ZstdCompressor().compress(content) if packed else content, what)

    def read(self, path: Path, source: random.Random) -> Reading:
        """As every log."""
        return logs.read(path, source)

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """Metadata counts messages; a sound database gives as many as SQLite reads."""
        if reading.outcome != "whole" or reading.said:
            return
        ours = {k: v for k, v in logs.counts(reading.content).items() if v}
        if path.is_dir() and not sample.target.endswith(".yaml") and sum(ours.values()) != sample.facts["count"]:
            raise Finding("silent", f"messages {ours}, metadata counts {sample.facts['count']}")
        if sample.target.endswith(".db3"):
            theirs = _peer(path if path.is_file() else path / Path(sample.target).name)
            if theirs is not None and theirs != ours:
                raise Finding("silent", f"messages {ours}; SQLite reads {theirs} from a sound database")


def _peer(path: Path) -> dict[str, int] | None:
    """Messages of each topic by SQLite; None where the database is not sound for it."""
    query = "select t.name, count(m.data) from messages m join topics t on t.id = m.topic_id where typeof(m.data) = 'blob' and typeof(m.timestamp) = 'integer' group by t.id"
    try:
        with closing(sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)) as link:
            if link.execute("pragma integrity_check(1)").fetchone()[0] != "ok":
                return None
            out: dict[str, int] = {}
            for name, count in link.execute(query):
                out[str(name)] = out.get(str(name), 0) + count
            return out
    except (sqlite3.Error, UnicodeDecodeError):
        return None


def payload(kind: str, i: int) -> bytes:
    """A message that carries its number."""
    if kind == FLOAT:
        return bytes(STORE.serialize_cdr(STORE.types[FLOAT](float(i)), FLOAT))
    layout = STORE.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    return bytes(STORE.serialize_cdr(STORE.types[ARRAY](layout, np.full(700, float(i))), ARRAY))


def _sample(way: str, folder: Path) -> Sample:
    plugin = StoragePlugin.MCAP if way.startswith("mcap") else StoragePlugin.SQLITE3
    writer = Writer(folder, version=9, storage_plugin=plugin)
    if "zstd" in way:
        writer.set_compression(
            CompressionMode.MESSAGE if "messages" in way else CompressionMode.FILE, CompressionFormat.ZSTD
        )
    with writer:
        links = {kind: writer.add_connection(f"/{k}", kind, typestore=STORE) for k, kind in enumerate((FLOAT, ARRAY))}
        for i in range(COUNT):
            for kind in (FLOAT, ARRAY)[: 2 if i % 10 == 0 else 1]:
                writer.write(links[kind], T0 + i * 10_000_000, payload(kind, i))
    facts = {"count": COUNT + COUNT // 10}
    if way == "wal":
        _move_into_log(folder / f"{folder.name}.db3")
    files = {f"bag/{p.name}": p.read_bytes() for p in folder.iterdir()}
    base = next(name for name in files if not name.endswith(".yaml"))
    if way in ("db3", "wal"):
        files = {name: content for name, content in files.items() if not name.endswith(".yaml")}
        return Sample(
            way, files, f"bag/{folder.name}.db3", f"bag/{folder.name}.db3{'-wal' if way == 'wal' else ''}", facts
        )
    return Sample(way, files, "bag", "bag/metadata.yaml" if "yaml" in way else base, facts)


def _move_into_log(path: Path) -> None:
    """Make the second half of a database stand in its write-ahead log."""
    copies = path.with_name("copies")
    copies.mkdir()
    with closing(sqlite3.connect(path, isolation_level=None)) as link:
        link.execute("pragma journal_mode = wal")
        link.execute("pragma wal_autocheckpoint = 0")
        half = "select topic_id, timestamp, data from messages where timestamp >= ? order by id"
        rows = link.execute(half, (T0 + COUNT // 2 * 10_000_000,)).fetchall()
        link.execute("delete from messages where timestamp >= ?", (rows[0][1],))
        link.execute("pragma wal_checkpoint(truncate)")
        for at in range(0, len(rows), 8):
            link.execute("begin")
            link.executemany("insert into messages(topic_id, timestamp, data) values (?, ?, ?)", rows[at : at + 8])
            link.execute("commit")
        for name in (path.name, f"{path.name}-wal"):
            shutil.copyfile(path.with_name(name), copies / name)
    for name in (path.name, f"{path.name}-wal"):
        shutil.move(copies / name, path.with_name(name))
    shutil.rmtree(copies)
    path.with_name(f"{path.name}-shm").unlink(missing_ok=True)


def _yaml(raw: bytes, source: random.Random) -> tuple[bytes, str]:
    """Another value, a key gone, or what YAML can do."""
    lines = raw.decode().splitlines()
    k = source.randrange(len(lines))
    indent, _, _ = lines[k].partition(lines[k].strip() or "x")
    key = lines[k].partition(":")[0]
    way = source.randrange(5)
    if way == 0:
        lines.pop(k)
    elif way == 1:
        lines.insert(k, lines[source.randrange(len(lines))])
    elif way == 2:
        lines[k] = indent + source.choice(
            ("- " * 60 + "x", "? " * 200, "&a [*a, *a]", "!!python/object/apply:os.getcwd []", "\t", "{" * 500)
        )
    else:
        odd = (*map(str, FAR), "-1", "null", "[]", "{}", "1e400", ".nan", "'x'", "../../etc/passwd", "/dev/zero", "9" * 5000, "2001-01-01",
               "[" * 2000, "{a: " * 500, "|\n  x", "0x7fffffffffffffff", "bag.db3\\0", "1:1:1:1")  # fmt: skip
        lines[k] = f"{key}: {source.choice(odd)}"
    if source.random() < 0.05:
        lines[:0] = [
            "a: &a [1,1,1,1,1,1,1,1,1]",
            *[f"b{n}: &b{n} [{','.join([f'*b{n - 1}' if n else '*a'] * 9)}]" for n in range(9)],
        ]
    return "\n".join(lines).encode(), f"line {k} of the metadata"
