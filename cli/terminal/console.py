"""What the user sees: results on stdout; progress, warnings and errors on stderr."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING

from cli.terminal.interrupts import check
from cli.terminal.streams import clean, console_of
from replay.progress import Progress, Stage, Subscriber, silent, tell_of_compiling

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from cli.terminal.progress import Plan

_PADDING = re.compile("[ ]+$", re.MULTILINE)


@dataclass
class Terminal:
    """The two output streams of one run.

    Attributes
    ----------
    quiet : bool
        Errors and JSON only.
    verbose : bool
        Progress as lines where stderr is no terminal, tracebacks of internal errors.
    json : bool
        stdout is kept for one JSON document; what `show` prints goes to stderr.
    """

    quiet: bool = False
    verbose: bool = False
    json: bool = False

    def show(self, *parts: RenderableType) -> None:
        """Print results; a reader that closed the pipe early is no error."""
        if not self.quiet:
            stream = sys.stderr if self.json else sys.stdout
            _write(stream, _rendered(console_of(stream), parts))

    def show_text(self, text: str) -> None:
        """Print text of our own as it is."""
        if not self.quiet:
            _write(sys.stdout, text)

    def show_file(self, text: str) -> None:
        """Print a file that is asked for on stdout, also when quiet."""
        _write(sys.stdout, text)

    def show_json(self, document: object) -> None:
        """Print the one JSON document of a run, as UTF-8."""
        # A lone surrogate of a file name becomes its JSON escape.
        data = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False).encode("utf-8", "backslashreplace")
        _write(sys.stdout, data + b"\n")

    def note(self, text: object) -> None:
        """One line on stderr."""
        if not self.quiet:
            self._line("note", "cyan", text)

    def error(self, text: object) -> None:
        """One line on stderr, also when quiet."""
        self._line("error", "bold red", text)

    def plain(self, text: str) -> None:
        """One plain line on stderr."""
        _write(sys.stderr, clean(text) + "\n")

    def _line(self, label: str, style: str, text: object) -> None:
        from rich.text import Text

        line = Text.assemble((f"{label}:", style), " ", clean(text).strip())
        _write(sys.stderr, _rendered(console_of(sys.stderr), (line,), wrap=False))

    @contextmanager
    def progress(self, first: Stage, detail: str = "", *, plan: Plan | None = None) -> Iterator[Subscriber]:
        """Give a subscriber that shows stages and for how long: on a terminal, else as lines with ``--verbose``.

        Parameters
        ----------
        first : Stage
            What is being done until the first event comes.
        detail : str
            On what.
        plan : Plan or None
            Stages that will come; None: not known.
        """
        if self.quiet or not sys.stderr.isatty():
            yield _begun(self._as_line if self.verbose and not self.quiet else silent, Progress(first, detail))
            return
        from cli.terminal.progress import Plan, shown_plan

        with shown_plan(plan or Plan([]), sys.stderr) as subscriber:
            yield _begun(subscriber, Progress(first, detail))

    def _as_line(self, progress: Progress) -> None:
        self.plain(str(progress))


def _begun(subscriber: Subscriber, first: Progress) -> Subscriber:
    """The same after the first event; ends the run between two stages where that was asked for in the one before."""

    def checked(progress: Progress) -> None:
        check()
        subscriber(progress)

    subscriber(first)
    tell_of_compiling(subscriber)
    return checked


def _rendered(console: Console, parts: tuple[RenderableType, ...], *, wrap: bool = True) -> str:
    with console.capture() as capture:
        for part in parts:
            console.print(part, soft_wrap=not wrap, crop=False)
    return _PADDING.sub("", capture.get())


def _write(stream: IO[str], data: str | bytes) -> None:
    try:
        if isinstance(data, bytes):
            stream.flush()
            stream.buffer.write(data)  # type: ignore[attr-defined]
        else:
            stream.write(data)
        stream.flush()
    except BrokenPipeError:
        discard(stream)


def discard(stream: IO[str]) -> None:
    """Send what is still written to a stream nowhere, so that the run ends with its own exit code."""
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, stream.fileno())
    finally:
        os.close(sink)
