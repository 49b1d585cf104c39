"""`mfhca evaluate`: results against the truth of simulated and injected missions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.app import command
from cli.console import Terminal
from cli.inputs import machine_of, mission_paths
from cli.options import Json, MachineFile
from replay.errors import ConfigError

if TYPE_CHECKING:
    from diagnosis.evaluate import MissionScores

EXAMPLES = """\b
Examples:
  mfhca evaluate mission.mcap
  mfhca evaluate mission-report --truth mission.truth.json
  mfhca evaluate missions/*.mcap --json | jq .all.wheel.sides.sensor.macro_f1"""

SCHEMA = "mfhca-evaluation/1"


@command
def evaluate(
    terminal: Terminal,
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT", help="Report folders, report.json files, or logs to diagnose first.", show_default=False
        ),
    ],
    truth: Annotated[
        Path | None,
        typer.Option(
            "--truth", metavar="FILE", help="Truth of the one RESULT. Default: <log>.truth.json.", show_default=False
        ),
    ] = None,
    machine: MachineFile = None,
    json: Json = False,
) -> None:
    """Score results against the truth: confusion, faults found, onset and ε errors, false alarms."""
    if truth is not None and len(results) > 1:
        raise ConfigError(f"--truth {truth}: {len(results)} results are given; the option is for a single one")
    mission_paths(results)
    truths = [truth or _truth_of(path) for path in results]
    with terminal.progress("starting") as progress:
        from diagnosis.evaluate import evaluate_report
        from diagnosis.outcomes import add
        from diagnosis.scores import figures
        from replay.truth import read_truth

        scores = []
        for path, file in zip(results, truths, strict=True):
            mission = read_truth(file)
            scores.append(evaluate_report(_report_of(path, machine, progress), mission, str(path)))
    groups = [g for g in ("wheel", "steer") if any(g in s.groups for s in scores)]
    pooled = {g: figures(add([s.groups[g] for s in scores if g in s.groups])) for g in groups}
    for path, score in zip(results, scores, strict=True):
        if score.left_out:
            verb = "is" if len(score.left_out) == 1 else "are"
            terminal.note(f"{path}: {', '.join(score.left_out)} {verb} not in the result and not scored")
    if json:
        rows = [_row(*each) for each in zip(results, truths, scores, strict=True)]
        terminal.show_json({"schema": SCHEMA, "results": rows, "all": pooled})
        return
    from cli.score_tables import score_parts

    names = [str(path) for path in results]
    terminal.show(*score_parts(names, scores, pooled))


def _row(path: Path, truth: Path, score: MissionScores) -> dict[str, Any]:
    """One result of the JSON document."""
    from diagnosis.result import to_json
    from diagnosis.scores import figures

    groups = {
        name: figures(counts)
        | {
            "faults": [to_json(asdict(f)) for f in counts.faults],
            "reported": [to_json(asdict(r)) for r in counts.reports],
        }
        for name, counts in score.groups.items()
    }
    return {"result": str(path), "truth": str(truth), "left_out": list(score.left_out)} | groups


def _report_of(path: Path, machine: Path | None, progress: Callable[[str], None]) -> Mapping[str, Any]:
    """A saved report, or the one of a log."""
    saved = _saved(path)
    if saved is not None:
        from diagnosis.output import load_report

        return load_report(saved)
    from diagnosis.pipeline import diagnose

    the_machine, source = machine_of(machine)
    return diagnose(
        [path], the_machine, machine_source=source, progress=lambda text: progress(f"{path.name}: {text}")
    ).report


def _saved(path: Path) -> Path | None:
    """The report.json that a word names, None for a log."""
    if path.is_dir():
        return path / "report.json" if (path / "report.json").is_file() else None
    return path if path.suffix.lower() == ".json" else None


def _truth_of(path: Path) -> Path:
    """Truth file of a log: beside it; of a report: in the current folder, beside the report's folder, or in it.

    Raises
    ------
    ConfigError
        Where there is none.
    """
    from replay.truth import truth_path

    saved = _saved(path)
    if saved is None:
        places = [truth_path(path, folder=path.is_dir())]
    else:
        from diagnosis.output import load_report

        logs = [Path(str(f["path"])) for f in load_report(saved)["log"]["files"]]
        names = [truth_path(log, folder=log.is_dir()).name for log in logs]
        folder = saved.absolute().parent
        places = [near / name for name in names for near in (Path(), folder.parent, folder)]
    for place in places:
        if place.is_file():
            return place
    looked = ", ".join(str(p) for p in places)
    raise ConfigError(f"{path}: no truth file; looked for {looked}; name it with --truth")
