from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replay.inspection.inspect_log import inspect_index, inspect_log
from replay.log.source_options import SourceOptions


def test_rates_gaps_and_jitter_of_a_table(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    t = np.concatenate([np.arange(100) * 0.01, 2.0 + np.arange(100) * 0.01])
    t[50] += 0.002
    path.write_text("t,v\n" + "".join(f"{x:.6f},{i}\n" for i, x in enumerate(t)))
    report = inspect_log(path, SourceOptions())
    (topic,) = report.topics
    assert topic.count == 200
    assert topic.rate_hz == pytest.approx(100.0)
    assert (topic.gaps, topic.backwards, topic.duplicates) == (1, 0, 0)
    assert topic.longest_gap_s == pytest.approx(1.01)
    assert topic.jitter_p99_s is not None
    assert 0 < topic.jitter_p99_s <= 0.002
    assert topic.offset_s is None
    assert report.duration_s == pytest.approx(2.99)
    assert report.channels == ("v",)


def test_backwards_and_equal_stamps_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("t,v\n0,1\n1,2\n1,3\n3,4\n2,5\n5,6\n")
    (topic,) = inspect_log(path, SourceOptions(time="t")).topics
    assert (topic.backwards, topic.duplicates) == (1, 1)


def test_real_log_has_rate_and_clock_offset(reference_data: Path) -> None:
    path = reference_data / "reference_logs" / "robot_localization" / "test1.bag"
    topics = {t.name: t for t in inspect_log(path, SourceOptions()).topics}
    assert topics["/imu/data"].rate_hz == pytest.approx(30.0, rel=0.01)
    assert topics["/imu/data"].offset_s == pytest.approx(-0.025, abs=0.001)
    on_log = {t.name: t for t in inspect_log(path, SourceOptions(stamp="log")).topics}
    assert on_log["/imu/data"].offset_s == pytest.approx(-0.025, abs=0.001)


def test_the_index_of_a_table_has_counts_but_no_timing(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("t,v\n" + "".join(f"{i / 100},{i}\n" for i in range(101)))
    report = inspect_index(path, SourceOptions())
    (topic,) = report.topics
    assert (topic.count, topic.gaps, topic.jitter_p99_s, topic.backwards) == (101, None, None, None)
    assert topic.rate_hz == pytest.approx(100.0)
    assert (report.depth, report.status, report.clock, report.size) == ("quick", "index_ok", "own", path.stat().st_size)


def test_empty_cells_are_told_like_gaps(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    rows = [[i / 100, i, 0.5 * i, 1.5, 2.5 * i if i % 5 == 0 else ""] for i in range(1000)]
    for row in rows[200:500]:
        row[1] = row[2] = ""
    path.write_text("t,a,b,c,slow\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    (topic,) = inspect_log(path, SourceOptions()).topics
    assert topic.gaps == 0
    (hole,) = topic.odd_values
    assert (hole.channels, hole.samples, hole.missing) == (("a", "b"), 1000, 300)
    assert (hole.longest_s, hole.longest_at_s) == pytest.approx((3.01, 1.99))


def test_channels_without_a_number_and_values_that_none_can_be(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    rows = [[str(i / 100), "NaN", "0.5", "1.5", f"{1.7e9 + i}.5"] for i in range(100)]
    rows[7][2], rows[8][3] = "inf", "1e300"
    path.write_text("t,none,far,huge,epoch\n" + "".join(",".join(row) + "\n" for row in rows))
    none, far, huge = inspect_log(path, SourceOptions(time="t")).topics[0].odd_values
    assert (none.channels, none.missing, none.samples) == (("none",), 100, 100)
    assert (far.channels, far.infinite, far.missing, far.absurd) == (("far",), 1, 0, 0)
    assert (huge.channels, huge.absurd, huge.largest, huge.infinite) == (("huge",), 1, 1e300, 0)


def test_a_hole_at_the_end_is_as_long_as_the_recording_went_on(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("t,a,b\n" + "".join(f"{i},{i if i < 6 else ''},1\n" for i in range(10)))
    (hole,) = inspect_log(path, SourceOptions(time="t")).topics[0].odd_values
    assert (hole.missing, hole.longest_s, hole.longest_at_s) == (4, 4.0, 5.0)
