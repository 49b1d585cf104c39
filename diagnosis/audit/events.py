"""What happens during an audit, as it happens: one JSON document per line for scripts and dashboards."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

from diagnosis.results.json_text import dump_json
from replay.errors import OutputError

SCHEMA = "mfhca-events/1"
Tell = Callable[[str, dict[str, Any]], None]


class EventLog:
    """A stream of events, each written as a whole line at once.

    Parameters
    ----------
    path : Path or None
        File that lines are added to; None: standard output.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        try:
            self._file: IO[bytes] = os.fdopen(os.dup(1), "wb", 0) if path is None else path.open("ab", 0)
        except OSError as error:
            raise OutputError(f"{path}: events cannot be written ({error.strerror or error}); see --events") from error

    def tell(self, event: str, facts: dict[str, Any]) -> None:
        """Write one event; a reader that has gone is no error.

        Raises
        ------
        OutputError
            Where the file cannot be written.
        """
        at = datetime.fromtimestamp(time.time(), UTC).isoformat(timespec="milliseconds")
        line = dump_json({"event": event, "time": at, **facts}) + b"\n"
        try:
            self._file.write(line)
        except BrokenPipeError:
            with suppress(OSError):
                self._file.close()
            self._file = Path(os.devnull).open("wb", 0)  # noqa: SIM115 - for the rest of the run
        except OSError as error:
            raise OutputError(
                f"{self._path}: events cannot be written ({error.strerror or error}); see --events"
            ) from error

    def close(self) -> None:
        """Close the stream."""
        self._file.close()
