"""Logs converted as recorded come back the same from their Parquet files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from mcap.writer import Writer

from replay.errors import LogError, OutputError
from replay.export import raw_log
from replay.export.raw_log import INDEX, write_raw
from replay.log.raw_log import Channel, RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log

ODD = [
    (10, {"v": 1, "big": 2**63 - 1, "flag": True}),
    (30, {"v": 2, "big": -(2**63), "flag": False, "rare": 0.5}),
    (20, {"v": 3, "big": 5, "flag": True}),  # goes back
    (20, {"v": 4, "big": 6, "flag": True, "rare": None}),  # repeats
    (40, {"v": 5, "big": 7, "flag": True, "rare": float("nan")}),
]


def write_log(path: Path, topics: dict[str, list[tuple[int, dict[str, Any]]]]) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("V", "jsonschema", b"{}")
        for topic, messages in topics.items():
            channel = writer.register_channel(topic, "json", schema)
            for stamp, message in messages:
                writer.add_message(channel, 1_760_000_000_000_000_000 + stamp, json.dumps(message).encode(), 0)
        writer.finish()
    return path


def back(folder: Path) -> dict[str, Channel]:
    """Channels of all files of a conversion."""
    logs = [read_log(file, SourceOptions()) for file in sorted(folder.glob("*.parquet"))]
    return {name: c for log in logs for name, c in log.channels.items()}


def assert_same(log: RawLog, folder: Path) -> None:
    found = back(folder)
    assert found.keys() == log.channels.keys()
    for name, channel in log.channels.items():
        again = found[name]
        assert (again.topic, again.field, again.unit) == (channel.topic, channel.field, channel.unit)
        assert again.type_name == channel.type_name
        assert again.values.dtype == channel.values.dtype
        np.testing.assert_array_equal(again.stamps, channel.stamps)
        np.testing.assert_array_equal(again.values, channel.values)


def test_odd_stamps_and_numbers_come_back(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", {"/odd": ODD})
    index = write_raw(path, tmp_path / "out", SourceOptions())
    assert_same(read_log(path, SourceOptions()), tmp_path / "out")
    assert [f["file"] for f in index["files"]] == ["odd.parquet", "odd~2.parquet"]
    assert json.loads((tmp_path / "out" / INDEX).read_text()) == index


@pytest.mark.parametrize("name", ["base.mcap", "paper.bag", "paper_twincat.csv", "paper_rosbag2"])
def test_samples_come_back(name: str, tmp_path: Path) -> None:
    path = Path(__file__).resolve().parents[3] / "sample_logs" / name
    write_raw(path, tmp_path / "out", SourceOptions())
    assert_same(read_log(path, SourceOptions()), tmp_path / "out")


def test_long_columns_are_written_in_row_groups(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raw_log, "_GROUP_CELLS", 1)
    path = write_log(tmp_path / "a.mcap", {"/v": [(i, {"v": i}) for i in range(3000)]})
    write_raw(path, tmp_path / "out", SourceOptions())
    assert pq.ParquetFile(tmp_path / "out" / "v.parquet").metadata.num_row_groups == 3
    assert_same(read_log(path, SourceOptions()), tmp_path / "out")


def test_files_say_where_they_come_from(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", {"/odd": ODD})
    index = write_raw(path, tmp_path / "out", SourceOptions())
    schema = pq.read_schema(tmp_path / "out" / "odd.parquet")
    assert schema.metadata[b"mfhca.sha256"].decode() == index["sha256"]
    assert schema.metadata[b"mfhca.source"] == b"a.mcap"
    assert schema.field("/odd.v").metadata == {b"topic": b"/odd", b"field": b"v", b"type": b"V"}
    assert str(tmp_path) not in (tmp_path / "out" / INDEX).read_text()


def test_units_of_a_plc_export_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t [s],speed [mm/s]\n0,1\n0.01,2\n")
    write_raw(path, tmp_path / "out", SourceOptions())
    (file,) = (tmp_path / "out").glob("*.parquet")
    assert pq.read_schema(file).field("speed [mm/s]").metadata[b"unit"] == b"mm/s"


def test_topics_become_names_that_every_system_holds(tmp_path: Path) -> None:
    topics = ["/a/b", "/a.b", "/A.B", "/../x", "/ü", "/" + "long" * 60]
    path = write_log(tmp_path / "a.mcap", {t: [(1, {"v": 1})] for t in topics})
    index = write_raw(path, tmp_path / "out", SourceOptions())
    names = [f["file"] for f in index["files"]]
    assert names[:5] == ["a.b.parquet", "a.b~2.parquet", "A.B~3.parquet", "x.parquet", "topic.parquet"]
    assert max(map(len, names)) < 100
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == sorted([*names, INDEX])


def test_a_part_of_the_log(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", {"/v": [(i * 1_000_000_000, {"v": i}) for i in range(10)]})
    write_raw(path, tmp_path / "out", SourceOptions(), start_s=2.0, stop_s=5.0)
    assert back(tmp_path / "out")["/v.v"].values.tolist() == [2, 3, 4]


def test_an_earlier_conversion_is_replaced_and_nothing_else(tmp_path: Path) -> None:
    out = tmp_path / "out"
    write_raw(write_log(tmp_path / "a.mcap", {"/a": [(1, {"v": 1})]}), out, SourceOptions())
    second = write_log(tmp_path / "b.mcap", {"/b": [(1, {"v": 1})]})
    write_raw(second, out, SourceOptions())
    assert sorted(p.name for p in out.iterdir()) == ["b.parquet", INDEX]
    (out / "mine.txt").write_text("keep")
    with pytest.raises(OutputError, match="holds other files"):
        write_raw(second, out, SourceOptions())
    write_raw(second, out, SourceOptions(), force=True)
    assert sorted(p.name for p in out.iterdir()) == ["b.parquet", INDEX, "mine.txt"]
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]


def test_places_that_do_not_serve_are_refused(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", {"/a": [(1, {"v": 1})]})
    with pytest.raises(OutputError, match="without an ending"):
        write_raw(path, tmp_path / "out.parquet", SourceOptions())
    with pytest.raises(OutputError, match="is a file"):
        write_raw(path, path.rename(tmp_path / "a"), SourceOptions(), force=True)


def test_why_a_topic_stands_in_several_files_is_said(tmp_path: Path) -> None:
    path = write_log(
        tmp_path / "a.mcap",
        {"/a": [(1, {"v": 1}), (2, {"v": 2, "rare": 0.5}), (3, {"v": 3})], "/b": [(1, {"v": 1}), (2, {"v": 2})]},
    )
    (note,) = (n for n in write_raw(path, tmp_path / "out", SourceOptions())["notes"] if "several files" in n)
    assert note.endswith("keeps its own stamp: /a: a.parquet, a~2.parquet")


def test_texts_are_converted_and_come_back(tmp_path: Path) -> None:
    said = ["drive", "", "stop ü"]
    rows = [(i, {"v": i, "mode": text}) for i, text in enumerate(said)]
    index = write_raw(write_log(tmp_path / "a.mcap", {"/a": rows}), tmp_path / "out", SourceOptions())
    assert {c["name"]: c["dtype"] for c in index["files"][0]["columns"]}["/a.mode"] == "text"
    back = read_log(tmp_path / "out" / index["files"][0]["file"], SourceOptions(), texts=True)
    assert back.channels["/a.mode"].values.tolist() == said
    assert back.channels["/a.mode"].topic == "/a"


def test_a_log_without_samples_writes_nothing(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", {"/a": [(1, {"v": None})]})
    with pytest.raises(LogError, match=r"no samples to convert: its topics hold none: /a \(V\)$"):
        write_raw(path, tmp_path / "out", SourceOptions())
    assert not (tmp_path / "out").exists()


def test_an_interrupted_conversion_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*args: object) -> None:
        raise KeyboardInterrupt

    path = write_log(tmp_path / "a.mcap", {"/a": [(1, {"v": 1})]})
    monkeypatch.setattr(raw_log, "_write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_raw(path, tmp_path / "out", SourceOptions())
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]


def test_damage_is_kept_in_the_index(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", {"/v": [(i, {"v": i}) for i in range(10)]})
    path.write_bytes(path.read_bytes()[:-20])
    index = write_raw(path, tmp_path / "out", SourceOptions())
    assert index["status"] == "degraded"
    assert index["damage"]
