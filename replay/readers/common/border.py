"""The border around every reader: whatever a file makes it raise comes out as one stated error.

Readers state what is wrong with a file themselves. Bytes that lead them, or a library below them, to an error which
nobody foresaw are still the file's, not the user's: they end as a `LogError` that names the file and the place in the
program. Tests and the fuzzer tell these from the foreseen ones by their type.
"""

from __future__ import annotations

import traceback
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError, MfhcaError
from replay.log.raw_log import Clock, LogSummary, RawLog, Window
from replay.log.source_options import SourceOptions
from replay.readers.common.protocol import Reader

_LONGEST = 200


class UnforeseenContent(LogError):
    """A file's content made its reader fail in a way that the reader does not know."""


@contextmanager
def bordered(path: Path, name: str) -> Iterator[None]:
    """Turn what a reader raises into stated errors; a lack of memory stays what it is.

    Parameters
    ----------
    path : Path
        The file or folder that is read.
    name : str
        The reader's format.

    Raises
    ------
    LogError
        Where the file cannot be opened or read.
    UnforeseenContent
        Where its content led to an error that the reader does not know.
    """
    try:
        yield
    except (MfhcaError, MemoryError):
        raise
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        text = " ".join(str(error).split())[:_LONGEST]
        raise UnforeseenContent(
            f"{path} cannot be read as {name}: its content led to {type(error).__name__} "
            f"({text}; {Path(last.filename).name}, line {last.lineno}); it is probably damaged: copy or record it again, "
            "and report this with the file"
        ) from error


@dataclass(unsafe_hash=True)
class Bordered:
    """A reader within the border.

    Attributes
    ----------
    inner : Reader
        The reader.
    format : str
        Its format.
    """

    inner: Reader
    format: str = ""

    def __post_init__(self) -> None:
        self.format = self.inner.format

    def matches(self, path: Path) -> bool:
        """Whether the path looks like this format."""
        with bordered(path, self.format):
            return self.inner.matches(path)

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the log's contents, as `Reader.summarise`.

        Raises
        ------
        LogError
            Where nothing in the log can be read.
        """
        with bordered(path, self.format):
            return self.inner.summarise(path, options)

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
        store: ColumnStore | None = None,
        texts: bool = False,
    ) -> RawLog:
        """Decode the log, as `Reader.read`.

        Raises
        ------
        LogError
            Where nothing in the log can be read.
        """
        with bordered(path, self.format):
            return self.inner.read(path, options, topics, clock, window, store, texts)
