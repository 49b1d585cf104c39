"""Named missions: options that belong together, each with what it is and what it is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from replay.errors import ConfigError
from replay.simulation.options import SimulationOptions
from replay.simulation.plant_options import PlantOptions

RECONSTRUCTED_K, RECONSTRUCTED_ZETA = 2.1, 2600.0


@dataclass(frozen=True)
class Preset:
    """A named mission.

    Attributes
    ----------
    text : str
        What it is.
    apply : Callable[[SimulationOptions], SimulationOptions]
        Puts it onto options of a seed.
    """

    text: str
    apply: Callable[[SimulationOptions], SimulationOptions]


def _paper_table(options: SimulationOptions) -> SimulationOptions:
    return replace(
        options,
        scenario="brief",
        zeta=RECONSTRUCTED_ZETA if options.controller is None else None,
        plant=PlantOptions(K=RECONSTRUCTED_K),
    )


PRESETS: Mapping[str, Preset] = {
    "paper-table": Preset(
        "a reconstruction: the paper states neither Ψ̂'s forcing nor how long its faults last; with ζ = "
        f"{RECONSTRUCTED_ZETA:g} s/m², K = {RECONSTRUCTED_K:g} m/s and faults as brief as Assumptions 1 and 2 demand, MFHCA "
        "comes to the table's 0.019 m/s at an effort of 0.125",
        _paper_table,
    )
}


def preset_options(name: str, options: SimulationOptions) -> SimulationOptions:
    """Options of a preset, on those of a seed, length and controller.

    Raises
    ------
    ConfigError
        Where no preset has that name.
    """
    if name not in PRESETS:
        raise ConfigError(f"--preset {name}: is not known; expected one of {', '.join(PRESETS)}")
    return PRESETS[name].apply(options)
