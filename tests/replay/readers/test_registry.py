from __future__ import annotations

import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

from replay.errors import LogError
from replay.log.file_types import LOG_ENDINGS
from replay.log.formats import LOG_FORMATS, LogFormatRow
from replay.log.source_options import SourceOptions
from replay.readers.registry import open_log, reader_of, readers, summarise_log
from replay.readers.tables.csv_reader import CsvReader


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"\x7fELF\2\1\1\0rest", r"extension \.dat and the first bytes b'\\x7fELF"),
        (b"just some prose\nwithout numbers\n", "first bytes b'just some pr'"),
    ],
)
def test_unknown_content_names_what_was_found_and_what_is_read(tmp_path: Path, content: bytes, found: str) -> None:
    path = tmp_path / "log.dat"
    path.write_bytes(content)
    with pytest.raises(LogError, match=found) as caught:
        open_log(path)
    assert "expected MCAP, ROS 1 bag, rosbag2" in str(caught.value)


@pytest.mark.parametrize(
    ("size", "rest", "says"),
    [
        (5000, b"", "holds nothing but zeros (5000 bytes)"),
        (3_000_000, b"", "holds nothing but zeros (3000000 bytes)"),
        (4096, b"rest of a log", "begins with 4096 zeros in place of a log's header (4109 bytes)"),
    ],
)
def test_a_file_of_zeros_is_said_to_be_one_and_what_to_do(tmp_path: Path, size: int, rest: bytes, says: str) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(bytes(size) + rest)
    with pytest.raises(LogError) as caught:
        open_log(path)
    assert f"{path} {says}: it was never written out, or overwritten, so copy it from the recorder once more" in str(
        caught.value
    )


def test_a_folder_without_a_log_names_its_files(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("x")
    with pytest.raises(LogError, match=r"a folder with notes\.txt"):
        open_log(tmp_path)


@pytest.mark.parametrize("name", ["a.mcap", "b.bag", "c.db3", "d.csv", "e.parquet"])
def test_an_empty_file_of_any_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).touch()
    with pytest.raises(LogError, match="is empty"):
        summarise_log(tmp_path / name, SourceOptions())


def test_a_path_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="does not exist"):
        open_log(tmp_path / "nothing.mcap")


def test_a_pipe_or_a_device_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.mcap"
    os.mkfifo(pipe)
    for path, found in ((pipe, "a pipe"), (Path(os.devnull), "a device")):
        with pytest.raises(LogError, match=rf"is not a regular file \(found {found}\)"):
            open_log(path)


def test_every_format_has_a_row_and_a_reader_of_its_name() -> None:
    assert all(reader_of(row).format == row.name for row in LOG_FORMATS)
    assert len({row.name for row in LOG_FORMATS}) == len({*readers()}) == len(LOG_FORMATS)


def test_an_ending_belongs_to_one_format() -> None:
    endings = [ending for row in LOG_FORMATS for ending in row.endings]
    assert len(set(endings)) == len(endings)
    assert LOG_ENDINGS == (
        ".mcap", ".bag", ".bag.active", ".db3", ".mcap.zstd", ".db3.zstd", ".csv", ".csv.gz", ".csv.zst", ".txt", ".parquet", ".svdx",
        ".tdms",
    )  # fmt: skip


def test_a_format_takes_a_row_and_a_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What `docs/developing.md` says about a new format, with one that reads what CSV does behind a first line."""
    module = ModuleType("foo_reader")

    class FooReader(CsvReader):
        format = "foo"

        def matches(self, path: Path) -> bool:
            return path.read_bytes().startswith(b"#FOO")

    module.FooReader = FooReader  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "foo_reader", module)
    row = LogFormatRow("foo", "Foo", "foo_reader:FooReader", "table", (".foo",))
    monkeypatch.setattr("replay.readers.registry.LOG_FORMATS", (*LOG_FORMATS, row))
    (tmp_path / "a.foo").write_text("#FOO\ntime,v\n0,1\n1,2\n2,3\n")
    assert summarise_log(tmp_path / "a.foo", SourceOptions()).format == "foo"
    (tmp_path / "b.foo").write_bytes(b"\0\1\2")
    with pytest.raises(LogError, match=r"TDMS or Foo$"):
        open_log(tmp_path / "b.foo")
