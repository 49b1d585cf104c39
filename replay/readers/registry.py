"""Readers of the table of formats (`replay.log.formats`), and the pick among them by a log's content."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.file_types import check_regular
from replay.log.formats import LOG_FORMATS, LogFormatRow
from replay.log.raw_log import Clock, LogSummary, RawLog, Window
from replay.log.source_options import SourceOptions
from replay.readers.common.border import Bordered
from replay.readers.common.mistaken import mistaken, pointer
from replay.readers.common.protocol import Reader

_BLOCK, _FEW = 1 << 24, 16  # bytes that are looked at, at most, and fewer than which tell nothing


@cache
def reader_of(row: LogFormatRow) -> Reader:
    """Load the reader of a format, within its border."""
    module, name = row.reader.split(":")
    return Bordered(getattr(import_module(module), name)())


def readers() -> Iterator[Reader]:
    """Readers in order of certainty, each loaded when its turn comes: first bytes first, text tables last."""
    return map(reader_of, sorted(LOG_FORMATS, key=lambda row: -row.certainty))


def load_readers() -> None:
    """Load the readers of all formats, for processes that others are forked from."""
    for row in LOG_FORMATS:
        reader_of(row)


def open_log(path: Path) -> Reader:
    """Pick the reader of a log by its content.

    Parameters
    ----------
    path : Path
        File or rosbag2 folder.

    Raises
    ------
    LogError
        Where the path does not exist, is empty, is neither file nor folder, or no reader knows its content.
    """
    try:
        if not path.exists():
            gone = pointer(path) if path.is_symlink() else ""
            raise LogError(gone or f"{path} does not exist; expected a log file or a rosbag2 folder")
        if path.is_file() and path.stat().st_size == 0:
            raise LogError(f"{path} is empty (0 bytes); the recording was not written, copy or record it again")
        check_regular(path)
        if points := pointer(path):
            raise LogError(points)
        for reader in readers():
            if reader.matches(path):
                return reader
        if zeros := _zeros(path):
            raise LogError(zeros)
        if other := mistaken(path):
            raise LogError(other)
        raise LogError(f"{path} is not a log that can be read: found {_found(path)}; expected {_expected()}")
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error


def _expected() -> str:
    *words, last = (row.words for row in LOG_FORMATS)
    return f"{', '.join(words)} or {last}"


def _zeros(path: Path) -> str:
    """What is wrong with a file that begins with zeros, as none that was written does; empty for any other."""
    if not path.is_file():
        return ""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_FEW)
        if head.strip(b"\0") or len(head) < _FEW:
            return ""
        block = head + file.read(_BLOCK)
    found = len(block) - len(block.lstrip(b"\0"))
    least = "at least " if found == len(block) else ""
    much = (
        "holds nothing but zeros" if found >= size else f"begins with {least}{found} zeros in place of a log's header"
    )
    return f"{path} {much} ({size} bytes): it was never written out, or overwritten, so copy it from the recorder once more, or leave it out"


def _found(path: Path) -> str:
    if path.is_dir():
        names = sorted(p.name for p in path.iterdir())
        return f"a folder with {', '.join(names[:5]) if names else 'nothing in it'}"
    with path.open("rb") as file:
        head = file.read(12)
    return f"the extension {path.suffix or '(none)'} and the first bytes {head!r}"


def summarise_log(path: Path, options: SourceOptions) -> LogSummary:
    """List a log's contents from its index.

    Raises
    ------
    LogError
        Where nothing in the log can be read.
    """
    return open_log(path).summarise(path, options)


def read_log(
    path: Path,
    options: SourceOptions,
    topics: Collection[str] | None = None,
    clock: Clock | None = None,
    window: Window | None = None,
    store: ColumnStore | None = None,
    texts: bool = False,
) -> RawLog:
    """Decode a log, or the given topics and time of it, with its long columns in the store (None: one of its own).

    The clock is that of the options unless given. Fields of text become channels where `texts` says so.

    Raises
    ------
    LogError
        Where nothing in the log can be read.
    """
    return open_log(path).read(path, options, topics, clock or options.stamp, window, store, texts)
