"""`mfhca simulate`: missions with known faults, to try the tool on."""

from __future__ import annotations

import shlex
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from cli.app import command
from cli.console import Terminal
from cli.options import Json
from replay.errors import ConfigError

EXAMPLES = """\b
Examples:
  mfhca simulate
  mfhca simulate -o drive.bag --scenario random --seed 7 --duration 120
  mfhca simulate -o test.mcap --scenario healthy --fault "FR sensor stuck 30 37"
                 --fault "RL actuator inefficient 60 75 eps=0.4"

\b
A fault is PART SIDE MODE START STOP [eps=] [sat=] [std=] [tau=]: part FR FL RR RL front rear;
side sensor or actuator; mode stuck, no_signal, inefficient or noisy; times in s; sat and std in
m/s (speed), rad (angle) or fraction of full opening (valve); tau the correlation time in s."""


class Scenario(StrEnum):
    """What the machine does, and which faults it meets."""

    PAPER = "paper"
    RANDOM = "random"
    HEALTHY = "healthy"


class Evidence(StrEnum):
    """Which second measurements are logged."""

    BASE = "base"
    SPOOL = "spool"
    DIRECT = "direct"


class Coupling(StrEnum):
    """Whether wheels share the body through their tyres."""

    GROUND = "ground"
    FREE = "free"


class Law(StrEnum):
    """Control law of the simulated machine."""

    OPPOSED = "opposed"
    SIGNED = "signed"
    PRINTED = "printed"
    SIGN_ABS = "sign_abs"
    P = "p"


class LogFormat(StrEnum):
    """Container of the log."""

    MCAP = "mcap"
    BAG = "bag"
    ROSBAG2 = "rosbag2"
    TWINCAT = "twincat"
    CSV = "csv"
    PARQUET = "parquet"


ENDINGS = {
    LogFormat.MCAP: ".mcap",
    LogFormat.BAG: ".bag",
    LogFormat.ROSBAG2: "",
    LogFormat.TWINCAT: ".txt",
    LogFormat.CSV: ".csv",
    LogFormat.PARQUET: ".parquet",
}


@command
def simulate(
    terminal: Terminal,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Log to write. Default: mission with the format's ending."),
    ] = None,
    scenario: Annotated[Scenario, typer.Option(help="Drive and faults.")] = Scenario.PAPER,
    seed: Annotated[int, typer.Option(help="The same seed gives the same mission.")] = 1,
    duration: Annotated[float, typer.Option(metavar="S", help="Length [s].")] = 240.0,
    rate: Annotated[float, typer.Option(metavar="HZ", help="Recorded rate [Hz], 50 to 1000.")] = 1000.0,
    evidence: Annotated[
        Evidence, typer.Option(help="Logged besides commands and sensors: base nothing, spool, direct both.")
    ] = Evidence.DIRECT,
    coupling: Annotated[Coupling, typer.Option(help="Wheels on the ground, or free.")] = Coupling.GROUND,
    law: Annotated[Law, typer.Option(help="Control law.")] = Law.OPPOSED,
    ice: Annotated[
        float | None, typer.Option(metavar="SHARE", help="Share of icy ground, 0 to 0.9.", show_default="by scenario")
    ] = None,
    format: Annotated[  # noqa: A002
        LogFormat | None, typer.Option("--format", "-f", help="Container.", show_default="by the file's ending")
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option("--fault", metavar="WORDS", help="Inject this instead; may be given again.", show_default=False),
    ] = None,
    json: Json = False,
) -> None:
    """Simulate a mission with known faults: a log, and its truth beside it."""
    from cli.fault_words import parse_fault
    from replay.truth import truth_path

    kind = format or (LogFormat.MCAP if output is None else format_of(output))
    log = output or Path(f"mission{ENDINGS[kind]}")
    truth = truth_path(log, folder=kind is LogFormat.ROSBAG2)
    if log.exists() and not truth.exists():
        raise ConfigError(f"{log}: exists and was not simulated, so it is left as it is; give another name with -o")
    faults = tuple(parse_fault(words) for words in fault) if fault else None
    with terminal.progress("simulating") as progress:
        from replay.export.mission import write_mission
        from replay.simulation.options import SimulationOptions
        from replay.simulation.run import simulate_mission
        from replay.truth import write_truth

        mission = simulate_mission(
            SimulationOptions(
                scenario=scenario.value,
                seed=seed,
                duration_s=duration,
                rate_hz=rate,
                evidence=evidence.value,
                coupling=coupling.value,
                law=law.value,
                ice=ice,
                faults=faults,
            )
        )
        progress(f"writing {log.name}")
        write_mission(mission, log, "ros1" if kind is LogFormat.BAG else kind.value)
        write_truth(mission.truth, truth)
    words = ["mfhca", "diagnose", str(log)]
    if json:
        terminal.show_json(
            {
                "log": str(log),
                "truth": str(truth),
                "faults": len(mission.truth.intervals),
                "duration_s": mission.truth.duration_s,
                "diagnose": words,
            }
        )
        return
    from cli.tables import key_values

    count = len(mission.truth.intervals)
    rows = [
        ("log", f"{log}  ({kind.value}, {mission.truth.duration_s:g} s at {rate:g} Hz)"),
        ("truth", f"{truth}  ({count} fault{'' if count == 1 else 's'})"),
    ]
    terminal.show(key_values([*rows, ("next", shlex.join(words))]))


def format_of(output: Path) -> LogFormat:
    """Format that a file name asks for.

    Raises
    ------
    ConfigError
        Where its ending is none of a known format.
    """
    for kind, ending in ENDINGS.items():
        if output.suffix.lower() == ending:
            return kind
    known = ", ".join(e for e in ENDINGS.values() if e)
    raise ConfigError(
        f"{output}: cannot tell the format from its name; expected {known} or a folder name, or give --format"
    )
