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
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log

OPTIONS = SourceOptions()
STORE = get_typestore(Stores.LATEST)
T0 = 1_700_000_000_000_000_000
FLOAT = "std_msgs/msg/Float64"


def payload(value: float) -> bytes:
    return bytes(STORE.serialize_cdr(STORE.types[FLOAT](value), FLOAT))


@pytest.fixture
def make_bag(tmp_path: Path) -> Callable[..., Path]:
    """Write /speed, counting up at 100 Hz."""

    def make(
        name: str = "bag", storage: StoragePlugin = StoragePlugin.SQLITE3, mode: CompressionMode | None = None
    ) -> Path:
        path = tmp_path / name
        writer = Writer(path, version=9, storage_plugin=storage)
        if mode is not None:
            writer.set_compression(mode, CompressionFormat.ZSTD)
        with writer:
            speed = writer.add_connection("/speed", FLOAT, typestore=STORE)
            for i in range(300):
                writer.write(speed, T0 + i * 10_000_000, payload(float(i)))
        return path

    return make


Make = Callable[..., Path]


def values(path: Path) -> Any:
    return read_log(path, OPTIONS).channels["/speed.data"].values


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_both_storages_give_the_written_values(make_bag: Make, storage: StoragePlugin) -> None:
    path = make_bag(storage=storage)
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels["/speed.data"].values, np.arange(300.0))
    np.testing.assert_array_equal(log.channels["/speed.data"].stamps, T0 + np.arange(300) * 10_000_000)
    assert (log.format, log.summary.damage) == ("rosbag2", ())
    summary = summarise_log(path, OPTIONS)
    assert (summary.topics[0].count, summary.start_ns, summary.stop_ns) == (300, T0, T0 + 2_990_000_000)


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_bags(make_bag: Make, mode: CompressionMode) -> None:
    np.testing.assert_array_equal(values(make_bag(mode=mode)), np.arange(300.0))


def test_a_single_database_is_enough(make_bag: Make) -> None:
    np.testing.assert_array_equal(values(next(make_bag().glob("*.db3"))), np.arange(300.0))


@pytest.mark.parametrize("name", ["bag # ? % ä", "bag&x=1"])
def test_odd_characters_in_the_path(make_bag: Make, name: str) -> None:
    path = make_bag()
    path = path.rename(path.parent / name)
    np.testing.assert_array_equal(values(path), np.arange(300.0))
    file = (path / "bag.db3").rename(path / f"{name}.db3")
    np.testing.assert_array_equal(values(file), np.arange(300.0))
    np.testing.assert_array_equal(values(path), np.arange(300.0))


def test_without_metadata_the_parts_are_read_in_natural_order(make_bag: Make, tmp_path: Path) -> None:
    folder = tmp_path / "split"
    folder.mkdir()
    for number in (10, 9):
        path = make_bag(f"part{number}")
        shutil.copy(next(path.glob("*.db3")), folder / f"part_{number}.db3")
    with closing(sqlite3.connect(folder / "part_10.db3")) as base, base:
        base.execute("update messages set timestamp = timestamp + 10000000000")
    log = read_log(folder, OPTIONS)
    assert len(log.channels["/speed.data"].values) == 600
    assert np.all(np.diff(log.channels["/speed.data"].stamps) > 0)
    assert any("no metadata.yaml" in n for n in log.summary.notes)


def test_a_missing_part_is_damage(make_bag: Make) -> None:
    path = make_bag()
    meta = path / "metadata.yaml"
    listed = next(line for line in meta.read_text().splitlines() if line.strip() == "- bag.db3")
    meta.write_text(meta.read_text().replace(listed, f"{listed}\n{listed.replace('bag.db3', 'bag_1.db3')}", 1))
    log = read_log(path, OPTIONS)
    assert len(log.channels["/speed.data"].values) == 300
    assert any("'bag_1.db3' named in metadata.yaml is missing" in d for d in log.summary.damage)


@pytest.mark.parametrize("name", ["../other/secret.db3", "/etc/passwd"])
def test_parts_outside_the_folder_are_not_opened(make_bag: Make, name: str) -> None:
    path = make_bag()
    make_bag("other").joinpath("other.db3").rename(path.parent / "other" / "secret.db3")
    meta = path / "metadata.yaml"
    meta.write_text(meta.read_text().replace("- bag.db3", f"- {name}"))
    log = read_log(path, OPTIONS)
    assert len(log.channels["/speed.data"].values) == 300
    assert any("outside the folder" in d for d in log.summary.damage)


@pytest.mark.parametrize(
    "text", ["", "a: [", "rosbag2_bagfile_information: 5", "a: &a [1]\nb: [*a, *a]", "\0", "x: " + "[" * 100_000]
)
def test_metadata_that_cannot_be_used_cost_nothing_else(make_bag: Make, text: str) -> None:
    path = make_bag()
    (path / "metadata.yaml").write_text(text)
    log = read_log(path, OPTIONS)
    assert len(log.channels["/speed.data"].values) == 300
    assert any("names no files" in d for d in log.summary.damage)


def test_a_hot_write_ahead_log_is_read_whole_and_left_untouched(make_bag: Make, tmp_path: Path) -> None:
    path = next(make_bag().glob("*.db3"))
    live = tmp_path / "live.db3"
    shutil.copy(path, live)
    with closing(sqlite3.connect(live)) as base:
        base.execute("pragma journal_mode = wal")
        base.execute("pragma wal_autocheckpoint = 0")
        with base:
            rows = [(1, T0 + 3 * 10**9 + i, payload(300.0 + i)) for i in range(300)]
            base.executemany("insert into messages (topic_id, timestamp, data) values (?, ?, ?)", rows)
        copy = tmp_path / "copy"
        copy.mkdir()
        for name in ("live.db3", "live.db3-wal"):
            shutil.copy(tmp_path / name, copy / name)
    before = {p.name: p.read_bytes() for p in copy.iterdir()}
    log = read_log(copy / "live.db3", OPTIONS)
    np.testing.assert_array_equal(log.channels["/speed.data"].values, np.arange(600.0))
    assert any("live.db3-wal" in n for n in log.summary.notes)
    assert {p.name: p.read_bytes() for p in copy.iterdir()} == before


def test_a_database_that_was_cut_off_gives_what_is_left(make_bag: Make) -> None:
    path = next(make_bag().glob("*.db3"))
    raw = path.read_bytes()
    path.write_bytes(raw[: len(raw) * 3 // 4])
    log = read_log(path, OPTIONS)
    found = log.channels["/speed.data"].values
    assert 0 < len(found) < 300
    np.testing.assert_array_equal(found, np.arange(float(len(found))))
    assert any("was cut off" in d for d in log.summary.damage)
    text = f"its metadata count 300 messages on /speed, {len(found)} were found; {300 - len(found)} are missing"
    assert any(text in d for d in log.summary.damage)


def test_rows_without_a_message_are_counted(make_bag: Make) -> None:
    path = next(make_bag().glob("*.db3"))
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("update messages set data = 'text' where id <= 3")
    log = read_log(path, OPTIONS)
    assert len(log.channels["/speed.data"].values) == 297
    assert any("3 rows hold no message" in d for d in log.summary.damage)


def test_another_database_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.db3"
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("create table t (a)")
    with pytest.raises(LogError, match="not a rosbag2 database that can be read"):
        read_log(path, OPTIONS)


def test_a_folder_without_parts_is_refused(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  relative_file_paths: []\n")
    with pytest.raises(LogError, match="no storage file"):
        read_log(tmp_path, OPTIONS)


def test_a_bomb_is_not_expanded(make_bag: Make) -> None:
    path = make_bag(mode=CompressionMode.FILE)
    packed = next(path.glob("*.zstd"))
    packed.write_bytes(zstandard.ZstdCompressor().compress(bytes(200 << 20)))
    with pytest.raises(LogError):
        read_log(path, OPTIONS)


@pytest.mark.parametrize("name", ["bag", "bag2"])
def test_real_bag_without_definitions_decodes_like_rosbags(
    reference_data: Path, flatten: Callable[..., Any], name: str
) -> None:
    path = reference_data / "reference_logs" / "gps_nav_ws" / name
    log = read_log(path, OPTIONS, ["/gps", "/odometry", "/vehicle_command_ackermann"])
    assert any("taken by name" in n for n in log.summary.notes)
    assert any("66.0 days before" in n for n in log.summary.notes)
    assert "/vehicle_command_ackermann.drive.steering_angle" in log.channels
    row = 0
    with Reader(path) as reader:
        for connection, _, raw in reader.messages([c for c in reader.connections if c.topic == "/odometry"]):
            row += 1
            if row % 10:
                continue
            for field, value in flatten(STORE.deserialize_cdr(raw, connection.msgtype)).items():
                if not field.startswith("header.stamp"):
                    np.testing.assert_array_equal(log.channels[f"/odometry.{field}"].values[row - 1], value)
    assert len(log.channels["/odometry.pose.pose.position.x"].values) == row


def test_official_fixtures_are_read_completely(reference_data: Path) -> None:
    folders = sorted(p.parent for p in (reference_data / "reference_logs" / "rosbag2").rglob("metadata.yaml"))
    assert len(folders) > 15
    for folder in folders:
        summary = summarise_log(folder, OPTIONS)
        read_log(folder, OPTIONS)
        if "wrong_rmw" in folder.name:
            continue
        with Reader(folder) as reader:
            counts = {c.topic: c.msgcount for c in reader.connections}
        assert {t.name: t.count for t in summary.topics} == counts, folder
