"""`mfhca simulate`: missions with known faults, to try the tool on."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from cli.commands.fault_help import FAULT_FORM
from cli.commands.simulate_run import run_simulation
from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.dates import moment_of, nanoseconds
from cli.terminal.options import Json
from diagnosis.api.log_format import LogFormat
from diagnosis.api.simulation_options import SimulateRequest

EXAMPLES = (
    """\b
Examples:
  mfhca simulate
  mfhca simulate -o drive.bag --scenario random --seed 7 --duration 120
  mfhca simulate -o test.mcap --scenario healthy --fault "FR sensor stuck 30 37"
                 --fault "RL actuator inefficient 60 75 eps=0.4 ramp=5"
  mfhca simulate -o worn.mcap --set K=1.6 --set dead_zone=0.03 --set leakage=0.01
  mfhca simulate -o lossy.mcap --rate 200 --set jitter=0.5 --set drop_share=0.02
  mfhca simulate -o monday.mcap --start 2026-10-05T07:30   # then tuesday.mcap …, for mfhca audit
  mfhca simulate -o other.mcap --vary --seed 7
  mfhca simulate -o foreign.mcap --set structure=valves --rate 500 --evidence base
  mfhca simulate -o any.mcap --vary --set structure=random --seed 12
  mfhca simulate -o table.mcap --preset paper-table
  mfhca simulate -o fuzzy.mcap --controller fuzzy

"""
    + FAULT_FORM
    + """

\b
Keys of --set, SI units. Machine: K tau wheel_spread tau_spread dead_zone (opening that moves nothing)
valve_lag droop leakage pump_flow mass friction ice_friction slip_stiffness rolling_resistance v_std
v_lsb phi_std phi_lsb. Controller: lambda k_ps zeta psi0, or with --controller parameters of that class.
Ground: steepness. Scenario: ramp_share ramp_max_s early_share (growing faults, faults from the first
sample). Recorder: jitter drop_share drop_burst_s.
structure=NAME: a machine of another structure, its sizes drawn by the seed: valves (dead band,
hysteresis, resonance), pump (shared, load-dependent, warming), torque (drives that accelerate),
resonant_pump, sticky_valves, electric, random (any mixture of such effects, drawn by the seed; with
--vary all else is drawn as well)."""
)


class Scenario(StrEnum):
    """What the machine does, and which faults it meets."""

    PAPER = "paper"
    BRIEF = "brief"
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


class ControllerName(StrEnum):
    """Controller of the wheels' valves: the paper's, references, and representatives of the classes it is compared with."""

    MFHCA = "mfhca"
    P = "p"
    PI = "pi"
    ADAPTIVE = "adaptive"
    FINITE_TIME = "finite-time"
    NEURAL = "neural"
    FUZZY = "fuzzy"


class PresetName(StrEnum):
    """Named missions."""

    PAPER_TABLE = "paper-table"


class Law(StrEnum):
    """Control law of the simulated machine."""

    OPPOSED = "opposed"
    SIGNED = "signed"
    PRINTED = "printed"
    SIGN_ABS = "sign_abs"
    P = "p"
    EVENT_RESET = "event_reset"


Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE", help="Log to write. Default: mission with the format's ending."),
]
ScenarioName = Annotated[
    Scenario | None,
    typer.Option(
        help="Drive and faults; brief: the paper's drive, faults that Assumptions 1 and 2 allow.", show_default="paper"
    ),
]
Seed = Annotated[int, typer.Option(help="The same seed gives the same mission.")]
Begin = Annotated[
    str | None,
    typer.Option(
        "--start",
        metavar="DATE",
        help="When the mission begins: 2026-10-05 or 2026-10-05T14:30, UTC without an offset.",
        show_default="2025-10-09T08:53:20",
    ),
]
Duration = Annotated[float, typer.Option(metavar="S", help="Length of the mission [s].")]
Rate = Annotated[float | None, typer.Option(metavar="HZ", help="Recorded rate [Hz], 50 to 1000.", show_default="1000")]
Logged = Annotated[
    Evidence,
    typer.Option(
        help="Second measurements in the log: base none, spool valve positions, direct also speeds and angles."
    ),
]
CouplingName = Annotated[
    Coupling | None, typer.Option(help="Wheels coupled by the ground, or free.", show_default="ground")
]
LawName = Annotated[Law | None, typer.Option(help="Control law.", show_default="opposed")]
ControllerChoice = Annotated[
    ControllerName | None,
    typer.Option("--controller", help="Controller of the valves, instead of a law.", show_default="mfhca"),
]
PresetChoice = Annotated[
    PresetName | None,
    typer.Option(
        "--preset",
        help="A named mission. paper-table: a reconstruction in which MFHCA comes to the paper's table.",
        show_default=False,
    ),
]
Ice = Annotated[
    float | None, typer.Option(metavar="SHARE", help="Share of icy ground, 0 to 0.9.", show_default="by scenario")
]
Format = Annotated[
    LogFormat | None, typer.Option("--format", "-f", help="Container.", show_default="by the file's ending")
]
Faults = Annotated[
    list[str] | None,
    typer.Option("--fault", metavar="WORDS", help="Fault to inject instead; may be given again.", show_default=False),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a constant; may be given again.", show_default=False),
]
Vary = Annotated[
    bool, typer.Option("--vary", help="Draw all that is not given from wide ranges (seeds from 2000: wider ones).")
]
Force = Annotated[bool, typer.Option("--force", help="Replace an earlier simulated log, or the truth of another one.")]


def simulate(
    context: typer.Context,
    output: Output = None,
    scenario: ScenarioName = None,
    preset: PresetChoice = None,
    seed: Seed = 1,
    start: Begin = None,
    duration: Duration = 240.0,
    rate: Rate = None,
    evidence: Logged = Evidence.DIRECT,
    coupling: CouplingName = None,
    law: LawName = None,
    controller: ControllerChoice = None,
    ice: Ice = None,
    format: Format = None,  # noqa: A002 - the option's name
    fault: Faults = None,
    setting: Settings = None,
    vary: Vary = False,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Simulate a mission with known faults: a log, and its truth beside it."""
    request = SimulateRequest(
        output=output,
        scenario=None if scenario is None else scenario.value,
        preset=None if preset is None else preset.value,
        seed=seed,
        start_ns=None if start is None else nanoseconds(moment_of("--start", start)),
        duration_s=duration,
        rate_hz=rate,
        evidence=evidence.value,
        coupling=None if coupling is None else coupling.value,
        law=None if law is None else law.value,
        controller=None if controller is None else controller.value,
        ice=ice,
        format=format,
        faults=tuple(fault or ()),
        settings=tuple(setting or ()),
        vary=vary,
        force=force,
    )
    run_simulation(terminal_of(context, json=json), request, json)
