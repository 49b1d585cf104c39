"""`mfhca counterfactual`: a recorded mission under another law or with other gains."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.terminal.browser import show_page
from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.console import Terminal
from cli.terminal.options import End, Json, Logs, MachineFile, OpenPage, Start
from diagnosis.api.inputs import check_output, check_times, machine_of, mission_paths
from replay.errors import ConfigError
from replay.progress import Progress, Stage

if TYPE_CHECKING:
    from replay.controllers.choice import Controller

EXAMPLES = """\b
Examples:
  mfhca counterfactual drive.mcap                                  # under every law
  mfhca counterfactual drive.mcap --controller mfhca --set zeta=2400 -o what-if
  mfhca counterfactual drive.mcap --controller fuzzy --tune healthy1.mcap --tune healthy2.mcap
  mfhca counterfactual drive.mcap --recorded "pi kp=1.9 ki=29 ff=0.44" --json | jq '.laws[].figures'

\b
The mission keeps its commands, ground, loads and faults; the law that answers is another. The recorded law is
replayed first: where it does not give the recorded mission (mean |e| within 2 %, effort within 5 %) nothing is
predicted. adaptive, finite-time, neural and fuzzy stand for classes of controllers, not for anybody's own."""


class LawName(StrEnum):
    """Laws to predict."""

    ALL = "all"
    MFHCA = "mfhca"
    PRINTED = "printed"
    P = "p"
    PI = "pi"
    ADAPTIVE = "adaptive"
    FINITE_TIME = "finite-time"
    NEURAL = "neural"
    FUZZY = "fuzzy"


@dataclass(frozen=True)
class CounterfactualRequest:
    """What the command line asks for; names as there."""

    logs: list[Path]
    output: Path | None
    machine: Path | None
    laws: list[str]
    settings: list[str]
    tune_on: list[Path]
    recorded: str | None
    draws: int
    start_s: float | None
    end_s: float | None
    json: bool
    open_page: bool


def counterfactual(
    context: typer.Context,
    logs: Logs,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="DIR", help="Folder for page, JSON and time series.", show_default="none written"
        ),
    ] = None,
    machine: MachineFile = None,
    controller: Annotated[
        list[LawName] | None, typer.Option("--controller", help="Law; may be given again.", show_default="all")
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="NAME=VALUE", help="Parameter of the one law; may be given again.", show_default=False
        ),
    ] = None,
    tune: Annotated[
        list[Path] | None,
        typer.Option(
            "--tune", metavar="LOG", help="Healthy mission to tune the laws on; may be given again.", show_default=False
        ),
    ] = None,
    recorded: Annotated[
        str | None,
        typer.Option(
            "--recorded",
            metavar="WORDS",
            help="Law that ran and its parameters, where the log does not tell it.",
            show_default=False,
        ),
    ] = None,
    draws: Annotated[
        int, typer.Option(metavar="N", min=0, max=1000, help="Monte Carlo draws for the bands; 0: none.")
    ] = 12,
    start: Start = None,
    end: End = None,
    json: Json = False,
    open_page: OpenPage = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Predict the recorded mission, with its faults, under another control law or other gains."""
    request = CounterfactualRequest(
        logs=logs,
        output=output,
        machine=machine,
        laws=[c.value for c in controller or [LawName.ALL]],
        settings=setting or [],
        tune_on=tune or [],
        recorded=recorded,
        draws=draws,
        start_s=start,
        end_s=end,
        json=json,
        open_page=open_page,
    )
    _run(terminal_of(context, json=json), request)


def _run(terminal: Terminal, request: CounterfactualRequest) -> None:
    paths, tune_on = mission_paths(request.logs), mission_paths(request.tune_on)
    check_times(request.start_s, request.end_s)
    if request.open_page and request.output is None:
        raise ConfigError("--open: there is no page to open; give a folder for it with -o")
    if request.output is not None:
        check_output([request.output], [*paths, *tune_on])
    machine, _ = machine_of(request.machine)
    settings = dict(_setting("--set", words) for words in request.settings)
    with terminal.progress(Stage.STARTING) as progress:
        from diagnosis.counterfactual.run import Request, counterfactual

        asked = Request(
            laws=tuple(request.laws),
            settings=settings,
            recorded=None if request.recorded is None else _recorded(request.recorded),
            tune_on=tuple(tune_on),
            draws=request.draws,
            start_s=request.start_s,
            stop_s=request.end_s,
        )
        result = counterfactual(paths, machine, asked, progress)
        written: tuple[Path, ...] = ()
        if request.output is not None:
            progress(Progress(Stage.WRITING_REPORT))
            from diagnosis.counterfactual.output import write_counterfactual

            written = write_counterfactual(result, request.output)
    if request.json:
        terminal.show_json(result.document)
    else:
        from cli.tables.counterfactual import counterfactual_parts

        terminal.show(*counterfactual_parts(result.document))
    if written:
        terminal.show(f"Report: {written[0]}")
    if request.open_page and written:
        show_page(terminal, written[0])


def _setting(option: str, words: str) -> tuple[str, float]:
    """One NAME=VALUE."""
    key, _, text = words.partition("=")
    try:
        return key, float(text)
    except ValueError as error:
        raise ConfigError(f"{option} {words}: expected NAME=VALUE with a number, e.g. zeta=2400") from error


def _recorded(words: str) -> Controller:
    """The law that ran, as ``NAME [READING] NAME=VALUE …``."""
    from replay.controllers.choice import Controller
    from replay.controllers.mfhca import READINGS

    parts = words.split()
    if not parts:
        raise ConfigError('--recorded: is empty; expected a law and its parameters, e.g. "pi kp=1.9 ki=29 ff=0.44"')
    values = dict(_setting("--recorded", part) for part in parts[1:] if "=" in part)
    readings = [part for part in parts[1:] if "=" not in part]
    if len(readings) > 1 or (readings and parts[0] != "mfhca"):
        raise ConfigError(
            f"--recorded {words!r}: {readings[-1]!r} is not understood; expected a law, of mfhca one of {', '.join(READINGS)}, "
            "and NAME=VALUE"
        )
    return Controller(parts[0], values, readings[0] if readings else "opposed")
