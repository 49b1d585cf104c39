from __future__ import annotations

import os
from pathlib import Path

import pytest

from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.registry import READERS, open_log, summarise_log


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


def test_every_reader_has_a_name_of_its_own() -> None:
    assert len({r.format for r in READERS}) == len(READERS)
