"""Damage ROS 1 bags and rosbag2 recordings at random and count what comes back, here and with rosbags.

Files: bags of each compression, a database alone (db3), the write-ahead log of an open one (wal), a compressed database
(zstd), and metadata.yaml of a folder (yaml).

Every file holds counting values, so that a message that comes back intact is recognised. Each mutation must end in a
log or in a `LogError`; fewer intact messages than rosbags gives is a failure. Losses that no sentence tells are counted:
they are changed values, which no checksum of these formats could show. Both are printed with their seeds.
"""

from __future__ import annotations

import argparse
import shutil
import sqlite3
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Reader as Reader2
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.LATEST)
T0 = 1_700_000_000_000_000_000
FLOAT, ARRAY = "std_msgs/msg/Float64", "std_msgs/msg/Float64MultiArray"
KINDS = ("none", "lz4", "bz2", "db3", "wal", "zstd", "yaml")
ROSBAG2 = KINDS[3:]
LONG = 700


def build(kind: str, folder: Path, count: int) -> tuple[Path, Path]:
    """Write /speed and, every tenth message, the long /scan; return the file to damage and the log to read."""
    if kind in ROSBAG2:
        writer = Writer2(folder / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3)
        if kind == "zstd":
            writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
        with writer:
            speed = writer.add_connection("/speed", FLOAT, typestore=ROS2)
            scan = writer.add_connection("/scan", ARRAY, typestore=ROS2)
            for i in range(count):
                writer.write(speed, T0 + i * 10_000_000, payload(i))
                if i % 10 == 0:
                    writer.write(scan, T0 + i * 10_000_000, payload(i, LONG))
        base = folder / "bag" / "bag.db3"
        if kind == "wal":
            return hot(base, folder / "hot", count), folder / "hot" / "bag.db3"
        if kind == "db3":
            return base, base
        return folder / "bag" / ("bag.db3.zstd" if kind == "zstd" else "metadata.yaml"), folder / "bag"
    path = folder / "log.bag"
    old = Writer1(path)
    old.chunk_threshold = 2048
    if kind != "none":
        old.set_compression(Writer1.CompressionFormat[kind.upper()])
    with old:
        first = old.add_connection("/speed", FLOAT, typestore=ROS1)
        second = old.add_connection("/scan", ARRAY, typestore=ROS1)
        for i in range(count):
            old.write(first, T0 + i * 10_000_000, payload(i)[4:])
            if i % 10 == 0:
                old.write(second, T0 + i * 10_000_000, payload(i, 40, ros1=True))
    return path, path


def hot(base: Path, folder: Path, count: int) -> Path:
    """Copy a database whose second half is still in its write-ahead log, transaction by transaction; return the log."""
    folder.mkdir()
    with closing(sqlite3.connect(base, isolation_level=None)) as connection:
        connection.execute("pragma journal_mode = wal")
        connection.execute("pragma wal_autocheckpoint = 0")
        half = "select topic_id, timestamp, data from messages where timestamp >= ? order by id"
        rows = connection.execute(half, (T0 + count // 2 * 10_000_000,)).fetchall()
        connection.execute("delete from messages where timestamp >= ?", (rows[0][1],))
        connection.execute("pragma wal_checkpoint(truncate)")
        for at in range(0, len(rows), 20):
            connection.execute("begin")
            text = "insert into messages(topic_id, timestamp, data) values (?, ?, ?)"
            connection.executemany(text, rows[at : at + 20])
            connection.execute("commit")
        for name in ("bag.db3", "bag.db3-wal"):
            shutil.copyfile(base.with_name(name), folder / name)
    return folder / "bag.db3-wal"


def payload(i: int, long: int = 0, ros1: bool = False) -> bytes:
    """One message that carries its number."""
    store = ROS1 if ros1 else ROS2
    if not long:
        return bytes(ROS2.serialize_cdr(ROS2.types[FLOAT](float(i)), FLOAT))
    layout = store.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    message = store.types[ARRAY](layout, np.full(long, float(i)))
    return bytes((store.serialize_ros1 if ros1 else store.serialize_cdr)(message, ARRAY))


def mutate(raw: bytes, seed: int) -> bytes:
    """Cut, flip one bit, overwrite, insert, remove, or zero a page."""
    rng = np.random.default_rng(seed)
    place, width = int(rng.integers(16, len(raw))), int(rng.integers(1, 64))
    changed, kind = bytearray(raw), seed % 6
    if kind == 0:
        return raw[:place]
    if kind == 1:
        changed[place] ^= 1 << int(rng.integers(0, 8))
    elif kind == 2:
        changed[place : place + width] = rng.integers(0, 256, width, dtype=np.uint8).tobytes()
    elif kind == 3:
        changed[place:place] = rng.integers(0, 256, width, dtype=np.uint8).tobytes()
    elif kind == 4:
        del changed[place : place + width]
    else:
        start = place // 4096 * 4096
        changed[start : start + 4096] = bytes(len(changed[start : start + 4096]))
    return bytes(changed)


def here(path: Path) -> tuple[int, bool, str]:
    """Intact messages of /speed, whether damage was told, and the error."""
    try:
        summarise_log(path, SourceOptions())
        log = read_log(path, SourceOptions())
    except LogError as error:
        return 0, True, str(error)
    return sum(intact(log.channels["/speed.data"].values) if "/speed.data" in log.channels else ()), bool(
        log.summary.damage
    ), ""  # fmt: skip


def intact(values: object) -> Iterator[int]:
    """One per value that was written."""
    whole = np.asarray(values, np.float64)
    seen = np.unique(whole[(whole >= 0) & (whole < 1e6) & (whole == np.floor(whole))])
    yield len(seen)


def peer(path: Path, kind: str) -> int:
    """Intact messages of /speed that rosbags gives before it stops."""
    values: list[float] = []
    try:
        if kind in ROSBAG2:
            with Reader2(path if kind in ("zstd", "yaml") else path.parent) as reader:
                for connection, _, raw in reader.messages():
                    if connection.topic == "/speed" and len(raw) == 12 and raw[:4] == b"\0\1\0\0":
                        values.append(float(np.frombuffer(raw[4:], "<f8")[0]))
        else:
            with Reader1(path) as old:
                for link, _, raw in old.messages():
                    if link.topic == "/speed" and len(raw) == 8:
                        values.append(float(np.frombuffer(raw, "<f8")[0]))
    except Exception:  # the peer fails in any way
        pass
    return sum(intact(values))


def main() -> None:
    """Run the campaign and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="*", default=KINDS, choices=KINDS)
    parser.add_argument("--seeds", type=int, nargs=2, default=(2000, 2300), metavar=("FIRST", "STOP"))
    parser.add_argument("--count", type=int, default=400, help="messages of /speed per file")
    options = parser.parse_args()
    print(f"{'file':5} {'mutations':>9} {'intact here':>11} {'rosbags':>8} {'fewer':>6} {'untold':>7} {'refused':>8}")
    for kind in options.kinds:
        totals: Counter[str] = Counter()
        with tempfile.TemporaryDirectory() as folder:
            target, path = build(kind, Path(folder), options.count)
            raw = target.read_bytes()
            for seed in range(*options.seeds):
                target.write_bytes(mutate(raw, seed))
                mine, told, error = here(path)
                theirs = peer(path, kind)
                totals.update(mine=mine, theirs=theirs, refused=bool(error))
                if mine < theirs:
                    totals["fewer"] += 1
                    print(f"  {kind} seed {seed}: {mine} intact messages, rosbags gives {theirs}; {error}")
                if mine < options.count and not told:
                    totals["untold"] += 1
                    print(f"  {kind} seed {seed}: {mine} of {options.count} intact messages, and no sentence says so")
        n = options.seeds[1] - options.seeds[0]
        print(
            f"{kind:5} {n:9} {totals['mine']:11} {totals['theirs']:8} {totals['fewer']:6} {totals['untold']:7} "
            f"{totals['refused']:8}"
        )


if __name__ == "__main__":
    main()
