"""`mfhca evaluate controllers`: the paper's table of controllers, simulated."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from cli.commands.simulate import ControllerName
from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.options import Json
from replay.errors import ConfigError
from replay.progress import Progress, Stage

EXAMPLES = """\b
Examples:
  mfhca evaluate controllers
  mfhca evaluate controllers --controller mfhca --controller fuzzy --scenario paper --seed 1 --seed 2 --seed 3
  mfhca evaluate controllers --json | jq '.rows[] | [.scenario, .controller, .error.mean]'"""


class TableScenario(StrEnum):
    """A scenario of the table."""

    HEALTHY = "healthy"
    BRIEF = "brief"
    PAPER = "paper"
    ICE = "ice"


def controllers(
    context: typer.Context,
    controller: Annotated[
        list[ControllerName] | None,
        typer.Option("--controller", help="Controller; may be given again.", show_default="all"),
    ] = None,
    scenario: Annotated[
        list[TableScenario] | None, typer.Option("--scenario", help="Scenario; may be given again.", show_default="all")
    ] = None,
    seed: Annotated[
        list[int] | None, typer.Option("--seed", help="Seed of a mission; may be given again.", show_default="1, 2")
    ] = None,
    duration: Annotated[float, typer.Option(metavar="S", help="Length of each mission [s].")] = 240.0,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Simulate the paper's table of controllers: tracking error, effort, number of parameters."""
    terminal = terminal_of(context, json=json)
    seeds = list(dict.fromkeys(seed or (1, 2)))
    if not 1.0 <= duration <= 3600.0:
        raise ConfigError(f"--duration {duration:g}: expected 1 to 3600 s")
    with terminal.progress(Stage.STARTING) as progress:
        from replay.simulation.controller_table import controller_table

        names = [c.value for c in dict.fromkeys(controller or ControllerName)]
        scenarios = [s.value for s in dict.fromkeys(scenario or TableScenario)]
        found = None
        for step, document in controller_table(names, scenarios, seeds, duration):
            found = document
            progress(Progress(Stage.SIMULATING, step))
    assert found is not None  # the last step holds the table
    if json:
        terminal.show_json(found)
        return
    from cli.tables.controllers import controller_parts

    terminal.show(*controller_parts(found))
