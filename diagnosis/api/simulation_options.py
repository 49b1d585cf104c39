"""Options of a simulated mission from what was asked: scenario, preset or variation, faults, and constants by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from diagnosis.api.log_format import LogFormat
from replay.errors import ConfigError

if TYPE_CHECKING:
    from replay.controllers.choice import Controller
    from replay.faults import FaultSpec
    from replay.simulation.options import EvidenceLevel, Scenario, SimulatedLaw, SimulationOptions
    from replay.simulation.structures import StructureOptions

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
    """What is asked for; names and defaults as on the command line, None for what is left to the scenario.

    Attributes
    ----------
    output : Path or None
        Log to write; None: ``mission`` with the format's ending.
    start_ns : int or None
        When the mission begins [ns since 1970].
    faults : tuple[str, ...]
        Faults in words, see `diagnosis.api.fault_words`.
    settings : tuple[str, ...]
        Constants as ``KEY=VALUE``.
    force : bool
        Whether an earlier simulated log may be replaced.
    """

    output: Path | None = None
    scenario: Scenario | None = None
    preset: str | None = None
    seed: int = 1
    start_ns: int | None = None
    duration_s: float = 240.0
    rate_hz: float | None = None
    evidence: EvidenceLevel = "direct"
    coupling: Literal["ground", "free"] | None = None
    law: SimulatedLaw | None = None
    controller: str | None = None
    ice: float | None = None
    format: LogFormat | None = None
    faults: tuple[str, ...] = ()
    settings: tuple[str, ...] = ()
    vary: bool = False
    force: bool = False


def options_of(request: SimulateRequest) -> SimulationOptions:
    """Options of the mission that is asked for.

    Raises
    ------
    ConfigError
        Where a word is not known, a value is out of its range, or options do not go together.
    """
    from diagnosis.api.fault_words import parse_fault

    faults = tuple(parse_fault(words) for words in request.faults) or None
    options = _changed(_options(request, faults), request.settings)
    _check_law(request, options)
    return options


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
        start_ns=options.start_ns if request.start_ns is None else request.start_ns,
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


def _structure(settings: Sequence[str]) -> StructureOptions | None:
    """Structure that the settings name."""
    from replay.simulation.structures import StructureOptions

    names = [text for key, _, text in (words.partition("=") for words in settings) if key == "structure" and text]
    return StructureOptions(names[-1]) if names else None


def _number(words: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise ConfigError(f"--set {words}: {text!r} is not a number") from error


def _changed(options: SimulationOptions, settings: Sequence[str]) -> SimulationOptions:
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
