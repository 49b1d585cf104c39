"""`mfhca schema`: JSON schemas of the documents that the tool writes."""

from __future__ import annotations

from typing import Annotated

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of

EXAMPLES = """\b
Examples:
  mfhca schema report > report.schema.json          # of report.json and of diagnose --json
  mfhca schema comparison                           # of compare --json
  mfhca schema report | jq '."$defs" | keys'"""


def schema(
    context: typer.Context,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Document: report, comparison, …", show_default=False)],
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Print the JSON schema of a document, for scripts that read it."""
    from diagnosis.documents import schema_of

    terminal_of(context).show_json(schema_of(name))
