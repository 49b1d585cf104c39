"""`mfhca compare`: two results of one machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.options import Json
from diagnosis.api.inputs import check_output
from diagnosis.api.saved_results import result_file
from replay.errors import ConfigError

if TYPE_CHECKING:
    from diagnosis.comparison.compare import Comparison

EXAMPLES = """\b
Examples:
  mfhca compare monday-report tuesday-report          # the older one first
  mfhca compare monday-report tuesday-report -o monday-tuesday.html
  mfhca compare before.json after.json --json | jq '.faults[] | select(.status == "new")'

\b
Exit codes: 0 nothing new or worse · 1 a fault of at least low severity is new or worse ·
2 usage, or results of different machines · 3 a result could not be read"""

_WORSE = 1

Older = Annotated[
    Path, typer.Argument(metavar="A", help="Older result: folder of a report, or its report.json.", show_default=False)
]
Newer = Annotated[Path, typer.Argument(metavar="B", help="Newer result of the same machine.", show_default=False)]
More = Annotated[list[Path] | None, typer.Argument(metavar="", hidden=True)]
Page = Annotated[
    Path | None,
    typer.Option("--html", "-o", metavar="FILE", help="Write the comparison as one page.", show_default=False),
]
Force = Annotated[bool, typer.Option("--force", help="Compare even results of different machines.")]


def compare(
    context: typer.Context,
    older: Older,
    newer: Newer,
    more: More = None,
    html: Page = None,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compare two missions: faults that are new, worse, better or resolved, and parts that were not assessed."""
    terminal = terminal_of(context, json=json)
    if more:
        raise ConfigError(
            f"{2 + len(more)} results are given, and two are compared; `mfhca audit` on the folder of their logs shows what changes over many "
            "missions"
        )
    files = [result_file(path) for path in (older, newer)]
    if html is not None:
        check_output([html], files)
    from diagnosis.comparison.compare import compare_reports, comparison_json
    from diagnosis.output import load_report

    found = compare_reports(load_report(files[0]), load_report(files[1]), (str(older), str(newer)), force=force)
    if html is not None:
        _write_page(found, html)
    if json:
        terminal.show_json(comparison_json(found))
    else:
        from cli.tables.comparison import comparison_parts

        terminal.show(*comparison_parts(found))
    if html is not None:
        from cli.tables.layout import text

        terminal.show(text(f"Wrote {html}"))
    if found.worse:
        raise typer.Exit(_WORSE)


def _write_page(found: Comparison, path: Path) -> None:
    from diagnosis.comparison.compare import comparison_json
    from diagnosis.comparison.page import build_compare_page
    from replay.atomic_write import atomic_path

    page = build_compare_page(comparison_json(found))
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8", newline="\n")
