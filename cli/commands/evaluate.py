"""`mfhca evaluate`: results against the truth of simulated and injected missions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.commands.saved_results import results_and_truths, saved_report
from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.inputs import check_output, machine_of
from cli.terminal.options import Json, MachineFile
from replay.progress import Stage, Subscriber

if TYPE_CHECKING:
    from diagnosis.evaluation.document import ScoresDocument
    from diagnosis.evaluation.excitation import Speeds
    from diagnosis.results.document import ReportDocument

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
        from diagnosis.evaluation.counts import add
        from diagnosis.evaluation.evaluate import evaluate_report
        from diagnosis.evaluation.scores import figures, scores_document
        from replay.truth import read_truth

        scores = []
        for path, file in pairs:
            mission = read_truth(file)
            report, speeds = _result_of(path, machine, mission.wheels, progress)
            scores.append(evaluate_report(report, mission, str(path), speeds=speeds))
    groups = [g for g in ("wheel", "steer") if any(g in s.groups for s in scores)]
    pooled = {g: figures(add([s.groups[g] for s in scores if g in s.groups])) for g in groups}
    for (path, _), score in zip(pairs, scores, strict=True):
        if score.left_out:
            verb = "is" if len(score.left_out) == 1 else "are"
            terminal.note(f"{path}: {', '.join(score.left_out)} {verb} not in the result and not scored")
    if json or html is not None:
        document = scores_document([(str(a), str(b)) for a, b in pairs], scores, pooled)
    if html is not None:
        _write_page(document, html)
    if json:
        terminal.show_json(document)
        return
    from cli.tables.layout import text
    from cli.tables.scores import score_parts

    terminal.show(*score_parts([str(path) for path, _ in pairs], scores, pooled))
    if html is not None:
        terminal.show(text(f"Wrote {html}"))


def _write_page(document: ScoresDocument, path: Path) -> None:
    from diagnosis.evaluation.page import build_scores_page
    from replay.atomic_write import atomic_path

    page = build_scores_page(document)
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8", newline="\n")


def _result_of(
    path: Path, machine: Path | None, wheels: tuple[str, ...], progress: Subscriber
) -> tuple[ReportDocument, Speeds | None]:
    """A saved report, or the one of a log, and the commanded speeds beside it."""
    from diagnosis.evaluation.excitation import read_speeds, speeds_of
    from diagnosis.output import PARQUET, load_report

    saved = saved_report(path)
    if saved is not None:
        return load_report(saved), read_speeds(saved.with_name(PARQUET), wheels)
    from diagnosis.pipeline import diagnose

    the_machine, source = machine_of(machine)
    result = diagnose(
        [path], the_machine, machine_source=source, progress=lambda event: progress(replace(event, mission=path.name))
    )
    return result.report, speeds_of(result.columns, wheels)
