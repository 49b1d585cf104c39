"""The border around every reader (`replay.border`)."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from replay.arrays.column_store import ColumnStore
from replay.border import bordered
from replay.log.raw_log import Clock, LogSummary, RawLog, Window
from replay.log.source_options import SourceOptions
from replay.readers.common.protocol import Reader


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
