"""What every reader offers."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Protocol

from replay.arrays.column_store import ColumnStore
from replay.log.raw_log import Clock, LogSummary, RawLog, Window
from replay.log.source_options import SourceOptions


class Reader(Protocol):
    """Reads one container format."""

    format: str

    def matches(self, path: Path) -> bool:
        """Whether the path looks like this format, by its first bytes rather than its name."""
        ...

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the log's contents from its index alone.

        Raises
        ------
        LogError
            Where the file is not of this format or nothing in it can be read.
        """
        ...

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
        """Decode the numeric fields of the given topics (all where None) into columns.

        Parameters
        ----------
        path : Path
            File or folder.
        options : SourceOptions
            How it is read.
        topics : Collection[str] or None
            Topics to decode; tables have none and ignore it.
        clock : str
            Clock of the stamps of a message log.
        window : tuple[int, int] or None
            Only messages with first ≤ log stamp < second [ns] (tables: their own stamps); None: all. What the index
            places outside is not opened.
        store : ColumnStore or None
            Where long columns stand; None: one of the log's own.
        texts : bool
            Whether fields of text become channels too, arrays of text objects, shape (n,).

        Raises
        ------
        LogError
            Where nothing can be read; damage to a part is counted in ``summary.damage`` instead.
        """
        ...
