"""Which files are logs, by their names; light to import."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from replay.errors import LogError
from replay.log.formats import LOG_FORMATS

MESSAGE_ENDINGS = tuple(e for row in LOG_FORMATS if row.kind == "messages" for e in row.endings)
TABLE_ENDINGS = tuple(e for row in LOG_FORMATS if row.kind == "table" for e in row.endings)
LOG_ENDINGS = (*MESSAGE_ENDINGS, *TABLE_ENDINGS)
_PART = re.compile(r"(.+)_(\d{1,9})")


def split_ending(name: str) -> tuple[str, str]:
    """Stem and ending (lower case, with its dots) of a log's name; the ending of no log is empty."""
    low = name.lower()
    ending = max((e for e in LOG_ENDINGS if low.endswith(e)), key=len, default="")
    return name[: len(name) - len(ending)], ending


def part_of(name: str) -> tuple[str, int, str] | None:
    """Recording, number and ending of a name such as recorders give to the parts of one recording (``drive_0.bag``)."""
    stem, ending = split_ending(name)
    found = _PART.fullmatch(stem) if ending in MESSAGE_ENDINGS else None
    return (found[1], int(found[2]), ending) if found else None


def is_result(path: Path) -> bool:
    """Whether a table is the saved result of a diagnosis."""
    return path.name in ("report.parquet", "report.windows.parquet") and path.with_name("report.json").is_file()


def words_of(words: Iterable[str]) -> Iterator[str]:
    """The words of a command line, with the lines of stdin in place of ``-``."""
    for word in words:
        if word == "-":
            yield from (line.rstrip("\r\n") for line in sys.stdin if line.strip())
        else:
            yield word


def check_regular(path: Path) -> None:
    """Raise a `LogError` where a path is there, but neither a file nor a folder: reading it might never end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        kinds = {"a pipe": Path.is_fifo, "a socket": Path.is_socket}
        found = next((name for name, holds in kinds.items() if holds(path)), "a device")
        raise LogError(
            f"{path} is not a regular file (found {found}); a log is read more than once, so save it as a file and give that"
        )
