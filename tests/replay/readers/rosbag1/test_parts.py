from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.registry import open_log, read_log, summarise_log

STORE = get_typestore(Stores.ROS1_NOETIC)
OPTIONS = SourceOptions()
T0 = 1_700_000_000_000_000_000


def write(path: Path, first: int, count: int) -> None:
    number = STORE.types["std_msgs/msg/Float64"]
    with Writer(path) as writer:
        speed = writer.add_connection("/speed", "std_msgs/msg/Float64", typestore=STORE)
        for i in range(first, first + count):
            raw = bytes(STORE.serialize_ros1(number(float(i)), "std_msgs/msg/Float64"))
            writer.write(speed, T0 + i * 10_000_000, raw)


@pytest.fixture
def split(tmp_path: Path) -> Path:
    """Twelve parts of ten messages: part 10 comes after part 9."""
    folder = tmp_path / "drive"
    folder.mkdir()
    for part in range(12):
        write(folder / f"drive_{part}.bag", 10 * part, 10)
    return folder


def test_parts_are_read_as_one_bag(split: Path, tmp_path: Path) -> None:
    write(tmp_path / "whole.bag", 0, 120)
    whole, parts = (read_log(p, OPTIONS, clock="log") for p in (tmp_path / "whole.bag", split))
    assert parts.format == "bag"
    channel, expected = parts.channels["/speed.data"], whole.channels["/speed.data"]
    np.testing.assert_array_equal(channel.values, expected.values)
    np.testing.assert_array_equal(channel.stamps, expected.stamps)
    summary = summarise_log(split, OPTIONS)
    assert (summary.start_ns, summary.stop_ns) == (T0, T0 + 119 * 10_000_000)
    assert [(t.name, t.count) for t in summary.topics] == [("/speed", 120)]
    assert summary.damage == ()


def test_missing_and_unreadable_parts_are_told(split: Path) -> None:
    (split / "drive_4.bag").unlink()
    (split / "drive_7.bag").write_bytes(b"")
    log = read_log(split, OPTIONS)
    assert len(log.channels["/speed.data"].values) == 100
    assert any("part 4 of the split bag is missing" in text for text in log.summary.damage)
    assert any("drive_7.bag" in text for text in log.summary.damage)


def test_no_part_can_be_read(tmp_path: Path) -> None:
    (tmp_path / "a_0.bag").write_bytes(b"nothing")
    with pytest.raises(LogError, match="holds no part that can be read"):
        read_log(tmp_path, OPTIONS)


def test_folder_of_several_bags_is_no_split_bag(split: Path) -> None:
    write(split / "other_0.bag", 0, 2)
    with pytest.raises(LogError, match="is not a log"):
        open_log(split)


def test_a_number_of_a_part_may_be_absurd(split: Path) -> None:
    last = max(split.glob("*.bag"))
    last.rename(last.with_name("drive_999999999.bag"))
    damage = summarise_log(split, OPTIONS).damage
    assert 0 < sum("of the split bag is missing" in text for text in damage) <= 5
