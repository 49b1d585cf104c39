"""`mfhca inject`: known faults in a recorded log, to measure the diagnosis on one's own machine."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from cli.commands.fault_help import FAULT_FORM
from cli.commands.inject_run import run_injection
from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.options import Json, Logs, MachineFile
from diagnosis.api.injecting import InjectRequest
from diagnosis.api.log_format import LogFormat

EXAMPLES = (
    """\b
Examples:
  mfhca inject drive.mcap -o faulty.mcap --fault "FR sensor stuck 30 45"
  mfhca inject drive.bag -o faulty.bag --fault "RL sensor inefficient 60 75 eps=0.4 ramp=3"
  mfhca inject drive.csv -o faulty.csv -m machine.toml --random --count 6 --seed 7
  mfhca diagnose faulty.mcap && mfhca evaluate faulty.mcap

"""
    + FAULT_FORM
    + """ Times count from the first wheel sample.

\b
OUT holds the mapped signals in SI under canonical names at their own stamps, and says that it is
open-loop: the controller did not react to these faults. Other topics and columns are not written."""
)


class Silent(StrEnum):
    """What a sensor without signal writes."""

    ZERO = "zero"
    NAN = "nan"
    DROP = "drop"


Output = Annotated[Path, typer.Option("--output", "-o", metavar="OUT", help="Log to write, with its truth beside it.")]
Faults = Annotated[
    list[str] | None,
    typer.Option("--fault", metavar="WORDS", help="A fault; may be given again.", show_default=False),
]
Random = Annotated[bool, typer.Option("--random", help="Draw faults while the machine drives.")]
Count = Annotated[int, typer.Option(metavar="K", min=1, max=1000, help="Faults to draw.")]
Seed = Annotated[int, typer.Option(min=0, help="The same seed gives the same faults and noise.")]
Epsilon = Annotated[
    float | None,
    typer.Option(metavar="E", help="ε of inefficient and noisy faults that give none.", show_default=False),
]
SilentAs = Annotated[Silent, typer.Option(help="What a sensor without signal writes.")]
KeepTrue = Annotated[
    bool, typer.Option("--keep-true", help="Keep the original as a second sensor, v_true, with noise of its own.")
]
SecondNoise = Annotated[
    float | None,
    typer.Option(metavar="M/S", help="Noise of that second sensor.", show_default="0.6 % of the top speed"),
]
Plant = Annotated[
    bool,
    typer.Option("--plant", help="Let the speed answer a valve's fault by the machine file's K and tau (linear)."),
]
Format = Annotated[
    LogFormat | None,
    typer.Option("--format", "-f", help="Container.", show_default="by OUT's ending, else the input's, else mcap"),
]
Force = Annotated[bool, typer.Option("--force", help="Replace OUT and its truth.")]


def inject(
    context: typer.Context,
    logs: Logs,
    output: Output,
    fault: Faults = None,
    random: Random = False,
    count: Count = 4,
    seed: Seed = 1,
    epsilon: Epsilon = None,
    silent: SilentAs = Silent.ZERO,
    keep_true: KeepTrue = False,
    second_noise: SecondNoise = None,
    plant: Plant = False,
    machine: MachineFile = None,
    format: Format = None,  # noqa: A002 - the option's name
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Inject sensor (L4) and actuator (L8) faults into a recorded log: a new log, and its truth beside it."""
    request = InjectRequest(
        paths=tuple(logs),
        output=output,
        faults=tuple(fault or ()),
        random=random,
        count=count,
        seed=seed,
        epsilon=epsilon,
        silent=silent.value,
        keep_true=keep_true,
        second_noise=second_noise,
        plant=plant,
        format=format,
        force=force,
    )
    run_injection(terminal_of(context, json=json), request, machine, json)
