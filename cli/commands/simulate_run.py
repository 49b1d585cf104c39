"""A run of `mfhca simulate`: options, mission, log and truth."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cli.terminal.console import Terminal
from cli.terminal.log_format import ENDINGS, LogFormat, format_of
from replay.errors import ConfigError
from replay.progress import Progress, Stage

if TYPE_CHECKING:
    from replay.controllers.choice import Controller
    from replay.faults import FaultSpec
    from replay.simulation.options import EvidenceLevel, Scenario, SimulatedLaw, SimulatedMission, SimulationOptions
    from replay.simulation.structures import StructureOptions
    from replay.truth import MissionTruth

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
_DRAWN = ("K", "tau", "wheel_spread", "tau_spread", "dead_zone", "valve_lag", "droop", "leakage", "pump_flow")
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


@dataclass(frozen=True)
class SimulateRequest:
    """What the command line asks for; names and defaults as there, None for what is left to the scenario."""

    output: Path | None
    scenario: Scenario | None
    preset: str | None
    seed: int
    duration_s: float
    rate_hz: float | None
    evidence: EvidenceLevel
    coupling: Literal["ground", "free"] | None
    law: SimulatedLaw | None
    controller: str | None
    ice: float | None
    format: LogFormat | None
    faults: list[str]
    settings: list[str]
    vary: bool
    force: bool
    json: bool


def run_simulation(terminal: Terminal, request: SimulateRequest) -> None:
    """Simulate a mission, and write its log and its truth."""
    from cli.commands.fault_spec import parse_fault
    from replay.truth import truth_path

    kind = request.format or (LogFormat.MCAP if request.output is None else format_of(request.output))
    log = request.output or Path(f"mission{ENDINGS[kind]}")
    truth = truth_path(log, folder=kind is LogFormat.ROSBAG2)
    _check_absent(log, truth, request.force)
    faults = tuple(parse_fault(words) for words in request.faults) or None
    with terminal.progress(Stage.SIMULATING) as progress:
        from replay.export.mission import write_mission
        from replay.simulation.run import simulate_mission
        from replay.truth import write_truth

        options = _changed(_options(request, faults), request.settings)
        _check_law(request, options)
        mission = simulate_mission(options)
        if not request.force:
            _keep_other_truth(truth, mission.truth)
        progress(Progress(Stage.WRITING, log.name))
        write_mission(mission, log, "ros1" if kind is LogFormat.BAG else kind.value)
        write_truth(mission.truth, truth)
    if options.faults is None and options.scenario != "healthy" and not mission.truth.intervals:
        terminal.note(
            f"{log}: the {options.scenario} scenario has no fault in {options.duration_s:g} s; give a longer --duration, or --fault"
        )
    _show(terminal, mission, log, truth, kind, request)


def _check_absent(log: Path, truth: Path, force: bool) -> None:
    """Raise a `ConfigError` where a log would be replaced that is not simulated, or that was not asked to be."""
    if log.exists() and not truth.exists():
        raise ConfigError(f"{log}: exists and is not a simulated log, so it was not changed; give another name with -o")
    if log.exists() and not force:
        raise ConfigError(f"{log}: exists already; give another name with -o, or --force to replace it and its truth")


def _options(request: SimulateRequest, faults: tuple[FaultSpec, ...] | None) -> SimulationOptions:
    """Options of the scenario, with what the request gives instead."""
    from replay.simulation.options import SimulationOptions
    from replay.simulation.presets import preset_options
    from replay.simulation.variation import varied_options

    scenario: Scenario = request.scenario or "paper"
    seed, duration = request.seed, request.duration_s
    if request.vary:
        kind: Literal["tuning", "reporting"] = "tuning" if seed < 1000 else "reporting"
        structure = _structure(request.settings)
        options = varied_options(seed, kind=kind, scenario=scenario, duration_s=duration, structure=structure)
    else:
        options = SimulationOptions(scenario=scenario, seed=seed, duration_s=duration)
    options = replace(options, controller=_controller(request))
    if request.preset is not None:
        if request.scenario is not None or request.vary:
            other = "--vary" if request.vary else "--scenario"
            raise ConfigError(f"--preset {request.preset}: says itself what {other} would; leave one of them out")
        options = preset_options(request.preset, options)
    return replace(
        options,
        evidence=request.evidence,
        faults=faults,
        rate_hz=options.rate_hz if request.rate_hz is None else request.rate_hz,
        coupling=options.coupling if request.coupling is None else request.coupling,
        law=options.law if request.law is None else request.law,
        ice=options.ice if request.ice is None else request.ice,
    )


def _controller(request: SimulateRequest) -> Controller | None:
    """Controller that stands in for the law, with its own parameters of ``--set``; None for the paper's law."""
    from replay.controllers.choice import Controller

    if request.controller in (None, "mfhca"):
        return None
    settable = Controller(str(request.controller)).settable
    given = [words.partition("=") for words in request.settings]
    return Controller(
        str(request.controller),
        {key: _number(f"{key}={text}", text) for key, _, text in given if key in settable and text},
    )


def _preset_text(name: str) -> str:
    from replay.simulation.presets import PRESETS

    return f"{name}: {PRESETS[name].text}"


def _loop(mission: SimulatedMission) -> tuple[float, float]:
    """Mean |v_a − v_c| with the true speed [m/s] and mean |u| over the wheels."""
    import numpy as np

    wheels = mission.options.machine.wheels
    error = [np.abs(mission.actual[f"wheel.{w}.v"] - mission.actual[f"wheel.{w}.v_ref"]).mean() for w in wheels]
    effort = [np.abs(mission.columns[f"wheel.{w}.u"]).mean() for w in wheels]
    return float(np.mean(error)), float(np.mean(effort))


def _show(
    terminal: Terminal, mission: SimulatedMission, log: Path, truth: Path, kind: LogFormat, request: SimulateRequest
) -> None:
    words = ["mfhca", "diagnose", str(log)]
    preset = None if request.preset is None else _preset_text(request.preset)
    error, effort = _loop(mission)
    count, duration = len(mission.truth.intervals), mission.truth.duration_s
    if request.json:
        terminal.show_json(
            {"log": str(log), "truth": str(truth), "faults": count, "duration_s": duration, "diagnose": words}
            | {"tracking_error": error, "control_effort": effort}
            | ({} if preset is None else {"preset": preset})
        )
        return
    from cli.tables.layout import key_values

    rows = [
        ("log", f"{log}  ({kind.value}, {duration:g} s at {mission.options.rate_hz:g} Hz)"),
        ("truth", f"{truth}  ({count} fault{'' if count == 1 else 's'})"),
    ]
    rows.append(("loop", f"mean |v_a − v_c| {error:.4f} m/s, mean |u| {effort:.3f} of full opening"))
    if preset is not None:
        rows.append(("preset", preset))
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


def _check_law(request: SimulateRequest, options: SimulationOptions) -> None:
    """Raise a `ConfigError` where a law is asked for and the machine's structure has another."""
    if request.law is not None and request.controller not in (None, "mfhca"):
        raise ConfigError(f"--law {request.law}: is a reading of MFHCA's law; leave it out, or --controller")
    if request.law is None or options.structure is None:
        return
    own = options.structure.structure(options.seed).law
    if own != "recorded":
        raise ConfigError(
            f"--law {request.law}: a machine of this structure has its own law, {own}; leave out --law, or structure"
        )


def _structure(settings: list[str]) -> StructureOptions | None:
    """Structure that the settings name."""
    from replay.simulation.structures import StructureOptions

    names = [text for key, _, text in (words.partition("=") for words in settings) if key == "structure" and text]
    return StructureOptions(names[-1]) if names else None


def _number(words: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise ConfigError(f"--set {words}: {text!r} is not a number") from error


def _changed(options: SimulationOptions, settings: list[str]) -> SimulationOptions:
    """Options with constants changed as ``KEY=VALUE``.

    Raises
    ------
    ConfigError
        Where a key is not known or a value is no number in its range.
    """
    values: dict[str, float] = {}
    structure = _structure(settings)
    keys = [words.partition("=")[0] for words in settings]
    own = () if options.controller is None else options.controller.settable
    for words, key in zip(settings, keys, strict=True):
        text = words.partition("=")[2]
        if keys.count(key) > 1:
            raise ConfigError(f"--set {words}: {key} is given {keys.count(key)} times; give it once")
        if not text:
            raise ConfigError(f"--set {words}: the value is missing; expected KEY=VALUE")
        if key == "structure" or key in own:
            continue
        if key not in (*_PLANT, *_CONTROL, *_MISSION):
            known = ", ".join(dict.fromkeys((*_PLANT, *_CONTROL, *_MISSION, "structure", *own)))
            raise ConfigError(f"--set {words}: {key!r} is not known; expected KEY=VALUE with KEY one of {known}")
        values[key] = _number(words, text)
    given = [key for key in _DRAWN if key in values]
    if structure is not None and given:
        raise ConfigError(f"--set {given[0]}: a machine of another structure draws its own; leave it out, or structure")
    plant: dict[str, Any] = {key: values[key] for key in _PLANT if key in values}
    control: dict[str, Any] = {_CONTROL[key]: values[key] for key in _CONTROL if key in values}
    mission: dict[str, Any] = {key: values[key] for key in _MISSION if key in values}
    machine = options.machine
    return replace(
        options,
        plant=replace(options.plant, **plant),
        machine=replace(machine, control=replace(machine.control, **control)),
        structure=structure,
        **mission,
    )
