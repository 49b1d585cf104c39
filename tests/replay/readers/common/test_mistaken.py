"""What is no log is named for what it is."""

from __future__ import annotations

import gzip
import tarfile
import zipfile
from pathlib import Path

import pytest

from replay.errors import LogError
from replay.readers.registry import open_log

POINTER = (
    "version https://git-lfs.github.com/spec/v1\n"
    "oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n"
)


@pytest.mark.parametrize("name", ["drive.mcap", "drive.bag", "drive.csv", "drive.db3", "drive.txt"])
def test_a_pointer_of_git_lfs(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(POINTER, encoding="utf-8")
    with pytest.raises(
        LogError, match=r"is a git-LFS pointer, not the log itself, which has 12345 bytes; .*git lfs pull"
    ):
        open_log(path)


def test_a_recording_whose_parts_are_pointers(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n", encoding="utf-8")
    (tmp_path / "drive_0.mcap").write_text(POINTER, encoding="utf-8")
    with pytest.raises(LogError, match=r"drive_0\.mcap is a git-LFS pointer"):
        open_log(tmp_path)


@pytest.mark.parametrize("name", ["drives.zip", "drive.mcap", "drive.csv"])
def test_a_zip_archive_says_what_is_in_it(tmp_path: Path, name: str) -> None:
    with zipfile.ZipFile(tmp_path / name, "w") as archive:
        archive.mkdir("monday")
        for k in range(7):
            archive.writestr(f"monday/{k}.csv", "t,v\n")
    with pytest.raises(
        LogError, match=r"is a ZIP archive \(holds monday/0.csv, .*monday/4.csv, …\), not a log; unpack it"
    ):
        open_log(tmp_path / name)


def test_a_workbook(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "drive.xlsx", "w") as archive:
        archive.writestr("xl/workbook.xml", "")
    with pytest.raises(LogError, match="is an Excel workbook, not a log; export its sheet as CSV"):
        open_log(tmp_path / "drive.xlsx")


def test_other_archives_and_pages(tmp_path: Path) -> None:
    (tmp_path / "a.mcap.gz").write_bytes(gzip.compress(b"x"))
    with tarfile.open(tmp_path / "b.tar", "w") as archive:
        archive.add(tmp_path / "a.mcap.gz", "a")
    (tmp_path / "c.bag").write_bytes(b"\n<!DOCTYPE html><html>sign in</html>")
    for name, what in (("a.mcap.gz", "a gzip archive"), ("b.tar", "a tar archive"), ("c.bag", "a web page")):
        with pytest.raises(LogError, match=f"is {what}, not a log"):
            open_log(tmp_path / name)


def test_anything_else_is_told_by_its_first_bytes(tmp_path: Path) -> None:
    (tmp_path / "x.mcap").write_bytes(b"\x00\x01\x02 nothing known")
    with pytest.raises(LogError, match="the first bytes"):
        open_log(tmp_path / "x.mcap")


def test_a_damaged_zip_is_a_zip_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "x.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.csv", "t,v\n" * 100)
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(LogError, match="ZIP archive"):
        open_log(path)


@pytest.mark.parametrize("text", ["speed\n0.1\n-0.25\n3e-2\n0\n", "time\n0\n1\n2\n3\n", "1\n2\n3\n4\n"])
def test_a_table_of_one_column(tmp_path: Path, text: str) -> None:
    (tmp_path / "run.csv").write_text(text, encoding="utf-8")
    with pytest.raises(
        LogError, match=r"run\.csv is a table of one column \(first line .*expected a time and at least one signal"
    ):
        open_log(tmp_path / "run.csv")


@pytest.mark.parametrize("extra", ["", ".bag", ".tar.gz"])
@pytest.mark.parametrize("before", ["/", "../.git/"])
def test_a_pointer_of_git_annex(tmp_path: Path, extra: str, before: str) -> None:
    key = f"SHA256E-s31390--f50d7ac4c6b9031379986bc362fcefb65f1e52621ce1708d537e740fefc59cc0{extra}"
    path = tmp_path / "drive.bag"
    words = (
        r"drive\.bag is a git-annex pointer, not the log itself, which has 31390 bytes; .*`git annex get drive\.bag`"
    )
    path.write_text(f"{before}annex/objects/{key}\n", encoding="utf-8")
    with pytest.raises(LogError, match=words):
        open_log(path)
    path.unlink()
    path.symlink_to(f"{before}annex/objects/J9/p1/{key}/{key}")
    with pytest.raises(LogError, match=words):
        open_log(path)


def test_a_link_that_leads_nowhere_else_does_not_exist(tmp_path: Path) -> None:
    (tmp_path / "drive.bag").symlink_to(tmp_path / "gone.bag")
    with pytest.raises(LogError, match="does not exist"):
        open_log(tmp_path / "drive.bag")


def test_the_description_of_a_recording_is_not_the_recording(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 5\n", encoding="utf-8")
    with pytest.raises(LogError, match=r"metadata\.yaml describes a rosbag2 recording .*give the folder") as caught:
        open_log(tmp_path / "metadata.yaml")
    assert str(caught.value).endswith(str(tmp_path))
