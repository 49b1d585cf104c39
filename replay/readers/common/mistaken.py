"""What people give in place of a log: pointers, archives, workbooks, web pages; named for what they are."""

from __future__ import annotations

import os
import re
import zipfile
from pathlib import Path

_POINTER = b"version https://git-lfs.github.com/spec/"
# What git-annex leaves in place of a file's content, in a file that is unlocked or as the end of a link.
_ANNEX = re.compile(rb"(?:[^\s]*/)?annex/objects/(?:[^\s/]+/)*([A-Z0-9_]+(?:-[sSmC]\d+)*--[^\s/]+)\s*\Z")
_ANNEX_SIZE = re.compile(r"-s(\d+)(?=-)")
_MOST_POINTER = 1024
_HEAD = 512
_NAMED = 5
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
_LEAST_LINES = 4  # of a table of one column
_PAGE = re.compile(rb"\s*(<!doctype html|<html)", re.IGNORECASE)
_DESCRIPTION = re.compile(rb"\s*rosbag2_bagfile_information:")
#: First bytes, what they are of, and what to do.
_KINDS = (
    (b"\x1f\x8b", "a gzip archive", "unpack it and give what is in it"),
    (b"BZh", "a bzip2 archive", "unpack it and give what is in it"),
    (b"\xfd7zXZ\x00", "an xz archive", "unpack it and give what is in it"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive", "unpack it and give what is in it"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it and give what is in it"),
    (b"Rar!\x1a\x07", "a RAR archive", "unpack it and give what is in it"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "a file of Microsoft Office", "export its table as CSV and give that"),
    (b"%PDF-", "a PDF document", "give the log that it tells of"),
)


def pointer(path: Path) -> str:
    """Sentence on a pointer of git-LFS or git-annex that stands where a log belongs, in a recording's folder too; else empty.

    git-annex leaves a file with the path of the content, or a link to it that leads nowhere.

    Parameters
    ----------
    path : Path
        File or folder.
    """
    if path.is_dir():
        return next(
            (found for child in sorted(path.iterdir()) if not child.is_dir() and (found := _pointer(child))), ""
        )
    return _pointer(path)


def _pointer(path: Path) -> str:
    if path.is_symlink() and not path.exists():
        return _annexed(path, os.fsencode(path.readlink()))
    if not path.is_file() or path.stat().st_size > _MOST_POINTER:
        return ""
    text = path.read_bytes()
    if not text.startswith(_POINTER):
        return _annexed(path, text)
    size = re.search(rb"^size (\d+)", text, re.MULTILINE)
    whole = f", which has {int(size[1])} bytes" if size else ""
    return f"{path} is a git-LFS pointer, not the log itself{whole}; fetch the log with `git lfs pull`"


def _annexed(path: Path, text: bytes) -> str:
    """Sentence on the text of a git-annex pointer; else empty."""
    found = _ANNEX.match(text)
    if found is None:
        return ""
    size = _ANNEX_SIZE.search(found[1].decode("utf-8", "replace").partition("--")[0] + "-")
    whole = f", which has {int(size[1])} bytes" if size else ""
    return f"{path} is a git-annex pointer, not the log itself{whole}; fetch the log with `git annex get {path.name}`"


def mistaken(path: Path) -> str:
    """Sentence on a file that is known to be something else than a log; else empty."""
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if head.startswith(b"PK\x03\x04"):
        return _zip(path)
    for first, what, remedy in _KINDS:
        if head.startswith(first):
            return f"{path} is {what}, not a log; {remedy}"
    if head[257:262] == b"ustar":
        return f"{path} is a tar archive, not a log; unpack it and give what is in it"
    if _PAGE.match(head):
        return f"{path} is a web page, not a log: the download gave a page in its place; download the file itself"
    if _DESCRIPTION.match(head):
        return f"{path} describes a rosbag2 recording and holds none of its messages; give the folder that it stands in: {path.parent}"
    return _one_column(path, head)


def _one_column(path: Path, head: bytes) -> str:
    """Sentence on a table whose lines hold one number each, below a name or not; else empty."""
    first, *rest = head.decode("utf-8", "replace").split("\n")[:-1] or [""]
    if len(rest) < _LEAST_LINES - 1 or not all(_NUMBER.fullmatch(line.strip()) for line in rest):
        return ""
    return (
        f"{path} is a table of one column (first line {first.strip()[:40]!r}); expected a time and at least one signal side by "
        "side: export them together, separated by commas, semicolons or tabs"
    )


def _zip(path: Path) -> str:
    try:
        with zipfile.ZipFile(path) as archive:
            names = [name for name in archive.namelist() if not name.endswith("/")]
    except (zipfile.BadZipFile, OSError, NotImplementedError, UnicodeDecodeError):
        names = []
    if "xl/workbook.xml" in names:
        return f"{path} is an Excel workbook, not a log; export its sheet as CSV and give that"
    more = ", …" if len(names) > _NAMED else ""
    holds = f" (holds {', '.join(names[:_NAMED])}{more})" if names else ""
    return f"{path} is a ZIP archive{holds}, not a log; unpack it and give what is in it"
