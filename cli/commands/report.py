"""`mfhca report`: the page again, from a saved result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.terminal.browser import show_page
from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.options import MaxSize, OpenPage, Previous
from diagnosis.api.inputs import mission_paths
from diagnosis.api.saved_results import previous_result
from replay.progress import Stage

EXAMPLES = """\b
Examples:
  mfhca report mission-report
  mfhca report tuesday-report --previous monday-report
  mfhca report mission-report/report.json --max-size 5"""

Result = Annotated[
    Path, typer.Argument(metavar="RESULT", help="Folder of a report, or its report.json.", show_default=False)
]


def report(
    context: typer.Context,
    result: Result,
    previous: Previous = None,
    max_size: MaxSize = 8.0,
    open_page: OpenPage = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write report.html again from a saved result; the log is not needed."""
    terminal = terminal_of(context)
    mission_paths([result])
    other = previous_result(previous)
    with terminal.progress(Stage.WRITING_REPORT):
        from diagnosis.output import rebuild

        known = None if previous is None or other is None else (previous, other)
        page = rebuild(result, max_size_mb=max_size, previous=known)
    terminal.show(f"Report: {page}")
    if open_page:
        show_page(terminal, page)
