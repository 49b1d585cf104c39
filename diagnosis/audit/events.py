"""What happens during an audit, as it happens: one JSON document per line for scripts and dashboards."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, TypedDict

from diagnosis.audit.store.outcome import MissionState
from diagnosis.results.json_text import dump_json
from replay.errors import OutputError

SCHEMA = "mfhca-events/1"


class EventFacts(TypedDict, total=False):
    """Fields of an event, beside its name and time; which of them an event has is in the guide to audits.

    Attributes
    ----------
    name : str
        Of a mission.
    files : list[str]
        Its files.
    state, reason, verdict, title
        As in `diagnosis.audit.endings.Ending`; the reason also of what is no mission's.
    faults : int
        Number of faults.
    report : str or None
        Folder of a report, relative to the output.
    attempt : int
        Number of the attempt.
    wall_s, cpu_s : float
        Time that something took, and time of a processor [s].
    peak_mb : float
        Most memory held at once [MB].
    missions, rest : int
        Number of missions, and of those to do.
    bytes : int
        Size of their files.
    attempts, links, problems
        As in `diagnosis.audit.store.ingest.Ingested`.
    path : str
        Of the fleet page.
    code, failed : int
        Exit code, and missions that failed.
    """

    name: str
    files: list[str]
    state: MissionState
    reason: str
    verdict: str | None
    title: str
    faults: int
    report: str | None
    attempt: int
    wall_s: float
    cpu_s: float
    peak_mb: float
    missions: int
    rest: int
    bytes: int
    attempts: int
    links: int
    problems: list[str]
    path: str
    code: int
    failed: int


#: Takes the name of an event and its fields.
Emit = Callable[[str, EventFacts], None]


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

    def write(self, event: str, facts: EventFacts) -> None:
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
