"""`mfhca evaluate`: results against the truth of simulated and injected missions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.options import Json, MachineFile
from diagnosis.api.inputs import check_output
from diagnosis.api.truths import logs_and_their_reports, results_and_truths
from replay.progress import Stage

EXAMPLES = """\b
Examples:
  mfhca evaluate mission.mcap
  mfhca evaluate mission-report mission.truth.json
  mfhca evaluate missions/ -o scores.html     # all in a folder: its reports, else its logs with a truth
  mfhca evaluate missions/*.mcap --json | jq .all.wheel.sides.sensor.macro_f1"""

Results = Annotated[
    list[Path],
    typer.Argument(
        metavar="RESULT",
        help="Report folders, report.json files, logs to diagnose first, or folders of them; the truth may follow "
        "a single one.",
        show_default=False,
    ),
]
TruthFile = Annotated[
    Path | None,
    typer.Option(
        "--truth", metavar="FILE", help="Truth of the one RESULT. Default: <log>.truth.json.", show_default=False
    ),
]
Page = Annotated[
    Path | None,
    typer.Option("--html", "-o", metavar="FILE", help="Write all figures as one page.", show_default=False),
]


def evaluate(
    context: typer.Context,
    results: Results,
    truth: TruthFile = None,
    html: Page = None,
    machine: MachineFile = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Score results against the truth: confusion, delays, errors of ε, false alarms, reliability."""
    terminal = terminal_of(context, json=json)
    pairs = results_and_truths(results, truth)
    if html is not None:
        check_output([html], [path for pair in pairs for path in pair if not path.is_dir()])
    with terminal.progress(Stage.STARTING) as progress:
        from diagnosis.api.evaluating import score

        found = score(pairs, machine, progress)
    for log, saved in logs_and_their_reports(pairs):
        terminal.note(f"{saved} is a report of {log}, which is given too: the mission counts twice")
    for sentence in found.notes:
        terminal.note(sentence)
    if html is not None:
        found.save(html)
    if json:
        terminal.show_json(found.document)
        return
    from cli.tables.layout import text
    from cli.tables.scores import score_parts

    terminal.show(*score_parts([str(path) for path, _ in pairs], found.scores, found.pooled))
    if html is not None:
        terminal.show(text(f"Wrote {html}"))
