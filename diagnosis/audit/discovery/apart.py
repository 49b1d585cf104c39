"""Indexes of logs read in a process of their own: a file that breaks its reader breaks no audit.

One helper process serves a whole search. It is given the path of a log, and answers with its span and topics. Where it
dies, takes too long or too much memory, this log counts as not read, and the next one gets a new helper.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import select
import subprocess
import sys
import threading
from contextlib import suppress
from typing import IO, NamedTuple

from replay.errors import LogError
from replay.log.raw_log import LogSummary

WAIT_S = 120.0
_MEMORY = 4 << 30
_CALL = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from diagnosis.audit.discovery.apart import serve; serve()"
)


_Answer = tuple[int, int, list[str], bool, str, list[str]]


class Span(NamedTuple):
    """What of a log's index tells whether another goes on where it ended.

    Attributes
    ----------
    start_ns, stop_ns : int
        First and last stamp [ns].
    topics : frozenset[str]
        Names of its topics.
    clean : bool
        Whether its index accounts for the whole file.
    format : str
        Format of its reader.
    columns : frozenset[str]
        Names of a table's columns; none of a message log.
    """

    start_ns: int
    stop_ns: int
    topics: frozenset[str]
    clean: bool = True
    format: str = ""
    columns: frozenset[str] = frozenset()


def span_of(summary: LogSummary) -> Span:
    """Span of a summarised log."""
    names = frozenset(t.name for t in summary.topics)
    columns = frozenset(f for t in summary.topics if t.encoding == "table" for f in t.fields)
    return Span(summary.start_ns, summary.stop_ns, names, not summary.damage, summary.format, columns)


class Helper:
    """The process that reads indexes; started with the first question, and again after one that it did not survive.

    Parameters
    ----------
    wait_s : float
        How long one question may take [s].
    """

    def __init__(self, wait_s: float = WAIT_S) -> None:
        self._wait_s = wait_s
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        atexit.register(self.close)

    def span(self, path: str) -> Span:
        """Span of a log.

        Raises
        ------
        LogError
            Where it cannot be read, or reading it took the helper down.
        """
        with self._lock:
            answer = self._ask(path)
        if isinstance(answer, str):
            raise LogError(answer)
        start, stop, topics, clean, kind, columns = answer
        return Span(start, stop, frozenset(topics), clean, kind, frozenset(columns))

    def _ask(self, path: str) -> _Answer | str:
        if self._process is not None and self._process.poll() is not None:
            self.close()
        process = self._process = self._process or self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        with suppress(OSError):
            process.stdin.write(json.dumps(path).encode() + b"\n")
            process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], self._wait_s)
        line = process.stdout.readline() if ready else b""
        if line.endswith(b"\n"):
            found: _Answer | str = json.loads(line)
            return found
        self.close()
        why = f"ended with code {process.returncode}" if ready else f"took longer than {self._wait_s:g} s"
        return f"{path}: the process that reads the index {why}"

    @staticmethod
    def _started() -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-P", "-c", _CALL, json.dumps([p for p in sys.path if p])],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()


HELPER = Helper()
"""The helper of this process."""


def serve() -> None:
    """Answer questions until the pipe closes: a line with a path by one with a span, or with a sentence."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
    _hold()
    for line in sys.stdin.buffer:
        _answer(json.loads(line), answers)


def _answer(path: str, answers: IO[bytes]) -> None:
    from pathlib import Path

    from replay.log.source_options import SourceOptions
    from replay.readers.registry import summarise_log

    found: object
    try:
        span = span_of(summarise_log(Path(path), SourceOptions()))
        found = span.start_ns, span.stop_ns, sorted(span.topics), span.clean, span.format, sorted(span.columns)
    except (LogError, MemoryError) as error:
        found = str(error) or "it needs more memory than there is for an index"
    answers.write(json.dumps(found).encode() + b"\n")
    answers.flush()


def _hold() -> None:
    """Limit this process's memory where the platform can."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY if hard < 0 else min(_MEMORY, hard), hard))
