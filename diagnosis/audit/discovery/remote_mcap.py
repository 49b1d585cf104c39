"""MCAP files behind URLs, of which only the index is fetched."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from diagnosis.audit.discovery.apart import HELPER, Span
from replay.errors import LogError

_AHEAD = 1 << 20
_BEFORE_SUMMARY = 1 << 16
_FOOTER = 37  # footer record and magic of an MCAP file
_MOST_RECORDS = 16


@contextmanager
def fetched_index(system: Any, path: str, size: int) -> Iterator[Path]:
    """Give a local file of the same name and size that holds an MCAP file's index and has holes elsewhere.

    It takes a few requests, whatever the file's size.

    Parameters
    ----------
    system : fsspec.AbstractFileSystem
        The file system.
    path : str
        The object in it.
    size : int
        Its size [bytes].

    Raises
    ------
    LogError
        Where it cannot be read.
    """
    with tempfile.TemporaryDirectory(prefix="mfhca-") as folder:
        local = Path(folder) / (re.sub(r"[^\w.-]", "_", path.rpartition("/")[2]) or "log.mcap")
        try:
            with local.open("wb") as file:
                file.truncate(size)

                def take(start: int, stop: int) -> bytes:
                    start, stop = max(start, 0), min(stop, size)
                    raw: bytes = system.cat_file(path, start=start, end=stop)
                    file.seek(start)
                    file.write(raw)
                    return raw

                tail = take(size - _AHEAD, size)
                if size > _AHEAD:
                    take(0, _BEFORE_SUMMARY)
                start = int.from_bytes(tail[-_FOOTER + 9 : -_FOOTER + 17], "little")
                if 0 < start < size - _AHEAD + _BEFORE_SUMMARY:
                    take(start - _BEFORE_SUMMARY, size - _AHEAD)
                file.flush()
                for offset, length in _metadata_places(local)[:_MOST_RECORDS]:
                    take(offset, offset + length)
        except LogError:
            raise
        except Exception as error:  # each package raises its own kinds
            raise LogError(f"{path}: cannot be read ({why(error)})") from error
        yield local


def span_behind(system: Any, path: str, size: int) -> Span:
    """Span of an MCAP file by its index, read in a process of its own; see `fetched_index`.

    Raises
    ------
    LogError
        Where it cannot be read, is no MCAP file, its index does not account for the whole file, or reading it took that
        process down.
    """
    with fetched_index(system, path, size) as local:
        span = HELPER.span(str(local))
    if span.format != "mcap" or not span.clean:
        raise LogError(f"{path}: its index does not account for the whole file; read it whole")
    return span


def _metadata_places(local: Path) -> list[tuple[int, int]]:
    """Offset and length of the metadata records that the summary lists."""
    from replay.readers.mcap.file import mapped_bytes
    from replay.readers.mcap.summary import read_summary

    data = mapped_bytes(local)
    summary = read_summary(data, len(data) - _FOOTER)
    return [(m.offset, m.length) for m in summary.metadata] if summary is not None else []


def why(error: Exception) -> str:
    """Reason of an error of a file system, in one line."""
    text = " ".join(str(getattr(error, "strerror", None) or error).split())
    return text[:300] or type(error).__name__
