"""`mfhca simulate`: missions with known faults, to try the tool on."""

from __future__ import annotations

import shlex
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cli.terminal.command import command
from cli.terminal.console import Terminal
from cli.terminal.options import Json
from replay.errors import ConfigError
from replay.progress import Progress, Stage

if TYPE_CHECKING:
    from replay.simulation.options import SimulationOptions
    from replay.truth import MissionTruth

EXAMPLES = """\b
Examples:
  mfhca simulate
  mfhca simulate -o drive.bag --scenario random --seed 7 --duration 120
  mfhca simulate -o test.mcap --scenario healthy --fault "FR sensor stuck 30 37"
                 --fault "RL actuator inefficient 60 75 eps=0.4 ramp=5"
  mfhca simulate -o worn.mcap --set K=1.6 --set dead_zone=0.03 --set leakage=0.01
  mfhca simulate -o lossy.mcap --rate 200 --set jitter=0.5 --set drop_share=0.02
  mfhca simulate -o other.mcap --vary --seed 7

\b
A fault is PART SIDE MODE START STOP [eps=] [sat=] [std=] [tau=] [ramp=]: part FR FL RR RL front
rear; side sensor or actuator; mode stuck, no_signal, inefficient or noisy; times in s; sat and std
in m/s (speed), rad (angle) or fraction of full opening (valve); tau the correlation time in s, ramp
the time over which eps grows from 0.

\b
Keys of --set, SI units. Machine: K tau wheel_spread tau_spread dead_zone valve_lag droop leakage
pump_flow mass friction ice_friction slip_stiffness rolling_resistance v_std v_lsb phi_std phi_lsb.
Controller: lambda k_ps zeta psi0. Ground: steepness. Scenario: ramp_share ramp_max_s early_share
(growing faults, faults from the first sample). Recorder: jitter drop_share drop_burst_s."""

_PLANT = [
    "K",
    "tau",
    "wheel_spread",
    "tau_spread",
    "dead_zone",
    "valve_lag",
    "droop",
    "leakage",
    "pump_flow",
    "mass",
    "friction",
    "ice_friction",
    "slip_stiffness",
    "rolling_resistance",
    "v_std",
    "v_lsb",
    "phi_std",
    "phi_lsb",
]
_CONTROL = {"lambda": "lambda_", "k_ps": "k_ps"}
_MISSION = [
    "zeta",
    "psi0",
    "steepness",
    "ramp_share",
    "ramp_max_s",
    "early_share",
    "jitter",
    "drop_share",
    "drop_burst_s",
]


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
    EVENT_RESET = "event_reset"


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
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="Recorded rate [Hz], 50 to 1000.", show_default="1000")
    ] = None,
    evidence: Annotated[
        Evidence, typer.Option(help="Logged besides commands and sensors: base nothing, spool, direct both.")
    ] = Evidence.DIRECT,
    coupling: Annotated[
        Coupling | None, typer.Option(help="Wheels on the ground, or free.", show_default="ground")
    ] = None,
    law: Annotated[Law | None, typer.Option(help="Control law.", show_default="opposed")] = None,
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
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a constant; may be given again.", show_default=False),
    ] = None,
    vary: Annotated[
        bool,
        typer.Option("--vary", help="Draw all that is not given from wide ranges (seeds from 2000: wider ones)."),
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Replace an earlier simulated log, or the truth of another one.")
    ] = False,
    json: Json = False,
) -> None:
    """Simulate a mission with known faults: a log, and its truth beside it."""
    from cli.commands.fault_spec import parse_fault
    from replay.truth import truth_path

    kind = format or (LogFormat.MCAP if output is None else format_of(output))
    log = output or Path(f"mission{ENDINGS[kind]}")
    truth = truth_path(log, folder=kind is LogFormat.ROSBAG2)
    if log.exists() and not truth.exists():
        raise ConfigError(f"{log}: exists and was not simulated, so it is left as it is; give another name with -o")
    if log.exists() and not force:
        raise ConfigError(f"{log}: exists already; give another name with -o, or --force to replace it and its truth")
    faults = tuple(parse_fault(words) for words in fault) if fault else None
    with terminal.progress(Stage.SIMULATING) as progress:
        from replay.export.mission import write_mission
        from replay.simulation.options import SimulationOptions
        from replay.simulation.run import simulate_mission
        from replay.simulation.variation import varied_options
        from replay.truth import write_truth

        if vary:
            kind_of_seed: Literal["tuning", "reporting"] = "tuning" if seed < 1000 else "reporting"
            options = varied_options(seed, kind=kind_of_seed, scenario=scenario.value, duration_s=duration)
        else:
            options = SimulationOptions(scenario=scenario.value, seed=seed, duration_s=duration)
        asked: dict[str, Any] = {"rate_hz": rate, "coupling": coupling, "law": law, "ice": ice}
        given: dict[str, Any] = {
            key: x.value if isinstance(x, StrEnum) else x for key, x in asked.items() if x is not None
        }
        options = replace(options, evidence=evidence.value, faults=faults, **given)
        mission = simulate_mission(_changed(options, setting or []))
        if not force:
            _keep_other_truth(truth, mission.truth)
        progress(Progress(Stage.WRITING, log.name))
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
    from cli.tables.layout import key_values

    count = len(mission.truth.intervals)
    rows = [
        ("log", f"{log}  ({kind.value}, {mission.truth.duration_s:g} s at {mission.options.rate_hz:g} Hz)"),
        ("truth", f"{truth}  ({count} fault{'' if count == 1 else 's'})"),
    ]
    terminal.show(key_values([*rows, ("next", shlex.join(words))]))


def _keep_other_truth(path: Path, truth: MissionTruth) -> None:
    """Raise a `ConfigError` where a truth file of another mission stands where this one's belongs."""
    from replay.errors import MfhcaError
    from replay.truth import read_truth

    try:
        same = not path.exists() or read_truth(path) == truth
    except MfhcaError:
        same = False
    if not same:
        raise ConfigError(
            f"{path}: belongs to another mission, whose truth would be lost; give another name with -o, or --force to replace it"
        )


def _changed(options: SimulationOptions, settings: list[str]) -> SimulationOptions:
    """Options with constants changed as ``KEY=VALUE``.

    Raises
    ------
    ConfigError
        Where a key is not known or a value is no number in its range.
    """
    values: dict[str, float] = {}
    for words in settings:
        key, _, text = words.partition("=")
        if key not in (*_PLANT, *_CONTROL, *_MISSION):
            known = ", ".join((*_PLANT, *_CONTROL, *_MISSION))
            raise ConfigError(f"--set {words}: {key!r} is not known; expected KEY=VALUE with KEY one of {known}")
        try:
            values[key] = float(text)
        except ValueError as error:
            raise ConfigError(f"--set {words}: {text!r} is no number") from error
    plant: dict[str, Any] = {key: values[key] for key in _PLANT if key in values}
    control: dict[str, Any] = {_CONTROL[key]: values[key] for key in _CONTROL if key in values}
    mission: dict[str, Any] = {key: values[key] for key in _MISSION if key in values}
    machine = options.machine
    return replace(
        options,
        plant=replace(options.plant, **plant),
        machine=replace(machine, control=replace(machine.control, **control)),
        **mission,
    )


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
