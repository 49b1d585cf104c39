"""What every reader offers."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Protocol

from replay.rawlog import Clock, LogSummary, RawLog
from replay.sources import SourceOptions


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
    ) -> RawLog:
        """Decode the numeric fields of the given topics (all where None) into columns.

        Raises
        ------
        LogError
            Where nothing can be read; damage to a part is counted in ``summary.damage`` instead.
        """
        ...
