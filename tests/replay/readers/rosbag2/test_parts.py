"""Parts and metadata of rosbag2 recordings: which files are read, in which order, and what is told about the rest."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from replay.errors import LogError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log
from replay.readers.rosbag2 import parts
from replay.readers.rosbag2.metadata import parse_metadata

OPTIONS = SourceOptions()
T0, STEP = 1_700_000_000_000_000_000, 10_000_000
TABLES = """
create table topics(id integer primary key, name text not null, type text not null, serialization_format text not null,
                    offered_qos_profiles text not null);
create table messages(id integer primary key, topic_id integer not null, timestamp integer not null, data blob not null);
create index timestamp_idx on messages (timestamp asc);
insert into topics values (1, '/speed', 'std_msgs/msg/Float64', 'cdr', '');
"""


def part(path: Path, first: int, count: int = 100, shift: int = 0) -> Path:
    """Database with /speed from `first`, one step apart."""
    rows = [
        (T0 + (i - shift) * STEP, b"\0\1\0\0" + np.float64(i).tobytes()) for i in range(first, first + count)
    ]  # fmt: skip
    with closing(sqlite3.connect(path)) as base:
        base.executescript(TABLES)
        with base:
            base.executemany("insert into messages(topic_id, timestamp, data) values (1, ?, ?)", rows)
    return path


def metadata(files: list[str], count: int, version: int = 5, counts: list[int] | None = None, more: str = "") -> str:
    listed = "".join(f"    - {f}\n" for f in files)
    held = "".join(
        f"    - path: {f}\n      starting_time:\n        nanoseconds_since_epoch: {T0}\n      message_count: {n}\n"
        for f, n in zip(files, counts or [], strict=False)
    )
    qos = '        offered_qos_profiles: "- history: 3\\n  depth: 0"\n' if version > 3 else ""
    return (
        f"rosbag2_bagfile_information:\n  version: {version}\n  storage_identifier: sqlite3\n  relative_file_paths:\n"
        f"{listed}  duration:\n    nanoseconds: 1\n  message_count: {count}\n  topics_with_message_count:\n"
        "    - topic_metadata:\n        name: /speed\n        type: std_msgs/msg/Float64\n"
        f"        serialization_format: cdr\n{qos}      message_count: {count}\n"
        + ('  compression_format: ""\n  compression_mode: ""\n' if version > 2 else "")
        + (f"  files:\n{held}" if held else "")
        + more
    )


@pytest.fixture
def split(tmp_path: Path) -> Path:
    """Three parts of 100 messages each with metadata."""
    folder = tmp_path / "bag"
    folder.mkdir()
    names = [f"bag_{k}.db3" for k in range(3)]
    for k, name in enumerate(names):
        part(folder / name, 100 * k)
    (folder / "metadata.yaml").write_text(metadata(names, 300, counts=[100, 100, 100]))
    return folder


def speed(log: RawLog) -> Any:
    return log.channels["/speed.data"].values


def relist(folder: Path, old: str, new: str) -> None:
    path = folder / "metadata.yaml"
    path.write_text(path.read_text().replace(old, new))


def test_parts_are_one_log(split: Path) -> None:
    log = read_log(split, OPTIONS)
    np.testing.assert_array_equal(speed(log), np.arange(300.0))
    assert log.summary.damage == ()
    assert summarise_log(split, OPTIONS).topics[0].count == 300


def test_a_window_over_parts_counts_the_whole_recording(split: Path) -> None:
    log = read_log(split, OPTIONS, window=(T0 + 90 * STEP, T0 + 110 * STEP))
    np.testing.assert_array_equal(speed(log), np.arange(90.0, 110.0))
    assert (log.summary.topics[0].count, log.summary.damage) == (300, ())
    (split / "metadata.yaml").unlink()
    assert read_log(split, OPTIONS, window=(T0, T0 + STEP)).summary.topics[0].count == 300


def test_a_missing_part_is_told_with_its_count(split: Path) -> None:
    (split / "bag_1.db3").unlink()
    log = read_log(split, OPTIONS)
    np.testing.assert_array_equal(speed(log), np.r_[0.0:100.0, 200.0:300.0])
    assert any("'bag_1.db3' named in metadata.yaml is missing; its 100 messages" in d for d in log.summary.damage)
    assert any("metadata.yaml counts 300 messages, 200 were found; 100 are missing" in d for d in log.summary.damage)


def test_fewer_messages_than_the_metadata_count_are_told(split: Path) -> None:
    with closing(sqlite3.connect(split / "bag_2.db3")) as base, base:
        base.execute("delete from messages where id > 93")
    log = read_log(split, OPTIONS)
    assert any("/speed: metadata.yaml counts 300 messages, 293 were found" in d for d in log.summary.damage)


def test_parts_that_overlap_are_read_whole(split: Path) -> None:
    (split / "bag_1.db3").unlink()
    part(split / "bag_1.db3", 100, shift=25)
    log = read_log(split, OPTIONS)
    np.testing.assert_array_equal(speed(log), np.arange(300.0))
    assert any("bag_1.db3 starts 0.240 s before bag_0.db3 ends" in n for n in log.summary.notes)


@pytest.mark.parametrize(
    "name", ["bag/bag_0.db3", "/home/robot/bags/bag/bag_0.db3", "C:\\\\bags\\\\bag_0.db3", "./bag_0.db3"]
)
def test_names_with_folders_are_found_beside_the_metadata(split: Path, name: str) -> None:
    relist(split, "    - bag_0.db3", f"    - {name}")
    log = read_log(split, OPTIONS)
    np.testing.assert_array_equal(speed(log), np.arange(300.0))
    assert log.summary.damage == ()


def test_a_link_out_of_the_folder_is_not_followed(split: Path) -> None:
    (split / "bag_1.db3").rename(split.parent / "other.db3")
    (split / "bag_1.db3").symlink_to(split.parent / "other.db3")
    log = read_log(split, OPTIONS)
    assert len(speed(log)) == 200
    assert any("'bag_1.db3' outside the folder" in d for d in log.summary.damage)


def test_a_link_to_the_folder_is_followed(split: Path) -> None:
    link = split.parent / "link"
    link.symlink_to(split)
    assert len(speed(read_log(link, OPTIONS))) == 300


def test_a_part_listed_twice_is_read_once(split: Path) -> None:
    relist(split, "    - bag_0.db3", "    - bag_0.db3\n    - ./bag_0.db3")
    log = read_log(split, OPTIONS)
    assert len(speed(log)) == 300
    assert any("lists 'bag_0.db3' twice" in n for n in log.summary.notes)


def test_parts_that_the_metadata_do_not_list_are_named(split: Path) -> None:
    part(split / "old_0.db3", 7)
    log = read_log(split, OPTIONS)
    assert len(speed(log)) == 300
    assert any("does not list old_0.db3; left out" in n for n in log.summary.notes)
    for k in range(3):
        (split / f"bag_{k}.db3").unlink()
    log = read_log(split, OPTIONS)
    assert len(speed(log)) == 100
    assert log.summary.damage


@pytest.mark.parametrize("version", range(1, 10))
def test_every_version_of_the_metadata(tmp_path: Path, version: int) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    part(folder / "bag_0.db3", 0)
    name = "bag/bag_0.db3" if version < 4 else "bag_0.db3"
    text = metadata([name], 100, version)
    if version == 9:
        text = text.replace('"- history: 3\\n  depth: 0"', "\n          - history: keep_last\n            depth: 1")
    (folder / "metadata.yaml").write_text(text)
    log = read_log(folder, OPTIONS)
    assert (len(speed(log)), log.summary.damage) == (100, ())
    assert parse_metadata(text).counts == {"/speed": 100}


@pytest.mark.parametrize("head", ["a: &a [x, x]\n" + "".join(f"k{i}: &k{i} [*a, *a]\n" for i in range(500)), "? ["])
def test_metadata_with_anchors_are_read_like_any_other(split: Path, head: str) -> None:
    path = split / "metadata.yaml"
    path.write_text(head + "\n" + path.read_text())
    assert len(speed(read_log(split, OPTIONS))) == 300


def test_metadata_of_fifty_megabytes_are_left_out(split: Path) -> None:
    path = split / "metadata.yaml"
    path.write_bytes(path.read_bytes() + b"#" * (50 << 20))
    log = read_log(split, OPTIONS)
    assert len(speed(log)) == 300
    assert any("at most 4194304 are read" in d for d in log.summary.damage)


def compress(path: Path) -> Path:
    packed = path.with_name(path.name + ".zstd")
    packed.write_bytes(zstandard.compress(path.read_bytes()))
    path.unlink()
    return packed


def test_compressed_parts_alone_and_beside_their_originals(split: Path) -> None:
    copy = split / "bag_1.db3.copy"
    shutil.copy(split / "bag_1.db3", copy)
    packed = compress(split / "bag_1.db3")
    assert len(speed(read_log(packed, OPTIONS))) == 100
    (split / "metadata.yaml").unlink()
    assert len(speed(read_log(split, OPTIONS))) == 300
    copy.rename(split / "bag_1.db3")
    assert len(speed(read_log(split, OPTIONS))) == 300


def test_a_compressed_part_that_was_cut_off_is_told(tmp_path: Path) -> None:
    path = part(tmp_path / "x.db3", 0, 20_000)
    rng = np.random.default_rng(1)
    with closing(sqlite3.connect(path)) as base, base:  # so that it does not compress to a few blocks
        base.executemany(
            "update messages set data = data || ? where id = ?", [(rng.bytes(90), i) for i in range(9000, 20_000)]
        )
    packed = compress(path)
    packed.write_bytes(packed.read_bytes()[: packed.stat().st_size // 2])
    log = read_log(packed, OPTIONS)
    assert 5000 < log.summary.topics[0].count < 20_000
    assert any("was cut off while it was compressed" in d for d in log.summary.damage)


def test_a_bomb_and_a_full_temporary_folder(split: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    packed = split / "bag_1.db3.zstd"
    packed.write_bytes(zstandard.compress(bytes(100 << 20)))
    relist(split, "bag_1.db3", "bag_1.db3.zstd")
    log = read_log(split, OPTIONS)
    assert len(speed(log)) == 200
    assert any("200 times its size; it was left out" in d for d in log.summary.damage)
    packed.write_bytes(zstandard.compress((split / "bag_0.db3").read_bytes()))
    full = shutil.disk_usage(split)._replace(free=(256 << 20) + 4096)
    monkeypatch.setattr(parts.shutil, "disk_usage", lambda _: full)
    with pytest.raises(
        LogError, match=r"cannot take bag_1.db3.zstd, which expands to more than 4096 bytes; set TMPDIR"
    ) as no:
        read_log(split, OPTIONS)  # not the rest alone: nothing is wrong with the log
    assert isinstance(no.value.__cause__, OSError)


def test_messages_compressed_one_by_one_with_a_damaged_one(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    path = part(folder / "bag_0.db3", 0)
    with closing(sqlite3.connect(path)) as base, base:
        rows = base.execute("select data, id from messages").fetchall()
        base.executemany("update messages set data = ? where id = ?", [(zstandard.compress(d), i) for d, i in rows])
        base.execute("update messages set data = x'0000' where id = 9")
    text = metadata(["bag_0.db3"], 100).replace('mode: ""', "mode: MESSAGE").replace('format: ""', "format: zstd")
    (folder / "metadata.yaml").write_text(text)
    log = read_log(folder, OPTIONS)
    np.testing.assert_array_equal(speed(log), np.delete(np.arange(100.0), 8))
    assert any("1 compressed messages are damaged" in d for d in log.summary.damage)


def test_an_empty_recording_says_so(tmp_path: Path) -> None:
    log = read_log(part(tmp_path / "x.db3", 0, 0), OPTIONS)
    assert (log.channels, log.summary.start_ns, log.summary.stop_ns) == ({}, 0, 0)
    assert any("holds no messages" in n for n in log.summary.notes)
    assert log.summary.damage == ()


def test_missing_tables_are_named(tmp_path: Path) -> None:
    path = part(tmp_path / "x.db3", 0)
    with closing(sqlite3.connect(path)) as base:
        base.execute("drop table topics")
    log = read_log(path, OPTIONS)
    assert any("100 messages belong to topic 1, which is not named" in d for d in log.summary.damage)
    with closing(sqlite3.connect(path)) as base:
        base.execute("drop table messages")
    with pytest.raises(LogError, match="holds no table of messages; found no table"):
        read_log(path, OPTIONS)


def test_definitions_of_the_database_are_used(tmp_path: Path) -> None:
    path = part(tmp_path / "x.db3", 0)
    with closing(sqlite3.connect(path)) as base, base:
        base.executescript(
            "create table message_definitions(id integer primary key, topic_type text, encoding text, "
            "encoded_message_definition text, type_description_hash text);"
            "insert into message_definitions values (1, 'my_msgs/msg/Speed', 'ros2msg', 'float64 data', '');"
            "update topics set type = 'my_msgs/msg/Speed'"
        )
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(speed(log), np.arange(100.0))
    assert log.channels["/speed.data"].type_name == "my_msgs/msg/Speed"


Check = Callable[[str], bool]
SENTENCES: dict[str, Check] = {
    "rosbag2_tests/resources/sqlite3/wrong_rmw_test": lambda s: (
        "wrong_format serialisation" in s or "no definition" in s
    ),
    "ros2bag/test/resources/empty_bag": lambda s: "holds no messages" in s,
    "rosbag2_tests/resources/sqlite3/bag_with_topics_and_service_events": lambda s: (
        "calls of services and actions are not signals" in s and "is not decoded" not in s
    ),
    "rosbag2_tests/resources/mcap/bag_with_topics_and_service_events": lambda s: "calls of services" in s,
}


@pytest.mark.parametrize("name", SENTENCES)
def test_official_oddities_end_in_sentences(reference_data: Path, name: str) -> None:
    log = read_log(reference_data / "reference_logs" / "rosbag2" / name, OPTIONS)
    assert SENTENCES[name](" ".join(log.summary.notes))
    assert log.summary.damage == ()


def test_mcap_messages_compressed_one_by_one(tmp_path: Path) -> None:
    writer = Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    store = get_typestore(Stores.LATEST)
    with writer:
        speeds = [writer.add_connection(n, "std_msgs/msg/Float64", typestore=store) for n in ("/speed", "/other")]
        for i in range(300):
            writer.write(speeds[i % 2], T0 + i * STEP, b"\0\1\0\0" + np.float64(i).tobytes())
    log = read_log(tmp_path / "bag", OPTIONS)
    np.testing.assert_array_equal(speed(log), np.arange(0.0, 300.0, 2))
    np.testing.assert_array_equal(log.channels["/other.data"].values, np.arange(1.0, 300.0, 2))
    assert log.summary.damage == ()
