"""Missions of machines far from the default one, drawn at random from declared ranges.

Limits and models may be tuned on the missions of kind ``tuning``. Those of kind ``reporting`` have seeds of their own and
ranges that reach beyond, so that a figure measured on them says something about machines that no choice has seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from replay.errors import ConfigError
from replay.machine.config import haulotte
from replay.simulation.options import Scenario, SimulatedLaw, SimulationOptions
from replay.simulation.plant_options import PlantOptions
from replay.simulation.random_structures import stiffest_loop
from replay.simulation.structure import Structure
from replay.simulation.structures import StructureOptions

Kind = Literal["tuning", "reporting"]

_DRY_ERROR = 0.15  # speed error at which the law overcomes dry friction [m/s]

POOLS: Mapping[str, range] = {"tuning": range(1000), "reporting": range(2000, 2**63)}

Span = tuple[float, float]


@dataclass(frozen=True)
class Ranges:
    """Lowest and highest value of everything that is drawn.

    Attributes
    ----------
    plant : Mapping[str, Span]
        Fields of `PlantOptions`, drawn evenly by logarithm where the lowest is above 0.
    lambda_, k_ps, zeta, psi0 : Span
        λ [s/m], k_ps [1/rad], ζ [s/m²] and Ψ̂(0) of the controller.
    rates : tuple[float, ...]
        Recorded rates [Hz].
    ice, steepness, ramp_share, ramp_max_s, early_share, jitter, drop_share, drop_burst_s : Span
        Fields of `SimulationOptions`; one mission in three has no jitter, one in two loses no rows.
    """

    plant: Mapping[str, Span]
    lambda_: Span
    k_ps: Span
    zeta: Span
    psi0: Span
    rates: tuple[float, ...]
    ice: Span
    steepness: Span
    ramp_share: Span
    ramp_max_s: Span
    early_share: Span
    jitter: Span
    drop_share: Span
    drop_burst_s: Span


RANGES: Mapping[str, Ranges] = {
    "tuning": Ranges(
        plant={
            "K": (1.2, 4.0),
            "tau": (0.1, 0.5),
            "wheel_spread": (0.0, 0.06),
            "tau_spread": (0.0, 0.1),
            "dead_zone": (0.0, 0.02),
            "valve_lag": (0.0, 0.05),
            "droop": (3e-6, 2e-5),
            "leakage": (0.0, 0.01),
            "mass": (5e3, 9e3),
            "friction": (0.4, 0.8),
            "ice_friction": (0.03, 0.1),
            "slip_stiffness": (3e4, 8e4),
            "rolling_resistance": (0.015, 0.05),
            "v_std": (0.001, 0.008),
            "v_lsb": (2e-4, 3e-3),
            "phi_std": (2e-4, 1e-3),
        },
        lambda_=(0.6, 2.5),
        k_ps=(0.6, 2.0),
        zeta=(300.0, 2000.0),
        psi0=(0.0, 0.4),
        rates=(100.0, 200.0, 250.0, 500.0, 1000.0),
        ice=(0.0, 0.4),
        steepness=(0.0, 1.5),
        ramp_share=(0.0, 0.5),
        ramp_max_s=(1.0, 4.0),
        early_share=(0.0, 0.3),
        jitter=(0.05, 0.5),
        drop_share=(0.001, 0.02),
        drop_burst_s=(0.0, 0.1),
    ),
    "reporting": Ranges(
        plant={
            "K": (0.8, 6.0),
            "tau": (0.06, 0.9),
            "wheel_spread": (0.0, 0.1),
            "tau_spread": (0.0, 0.15),
            "dead_zone": (0.0, 0.05),
            "valve_lag": (0.0, 0.12),
            "droop": (1e-6, 4e-5),
            "leakage": (0.0, 0.02),
            "mass": (3e3, 1.5e4),
            "friction": (0.3, 1.0),
            "ice_friction": (0.02, 0.15),
            "slip_stiffness": (2e4, 1.5e5),
            "rolling_resistance": (0.01, 0.08),
            "v_std": (5e-4, 0.015),
            "v_lsb": (1e-4, 6e-3),
            "phi_std": (1e-4, 2e-3),
        },
        lambda_=(0.4, 4.0),
        k_ps=(0.4, 3.0),
        zeta=(100.0, 3000.0),
        psi0=(0.0, 0.6),
        rates=(50.0, 62.5, 80.0, 100.0, 125.0, 200.0, 250.0, 300.0, 400.0, 500.0, 640.0, 800.0, 1000.0),
        ice=(0.0, 0.6),
        steepness=(0.0, 2.5),
        ramp_share=(0.0, 0.8),
        ramp_max_s=(1.0, 8.0),
        early_share=(0.0, 0.6),
        jitter=(0.05, 0.9),
        drop_share=(0.001, 0.05),
        drop_burst_s=(0.0, 0.3),
    ),
}

# `sign_abs` is left out: it is unstable around reversals.
_LAWS: tuple[tuple[SimulatedLaw, float], ...] = (
    ("opposed", 0.3),
    ("signed", 0.25),
    ("event_reset", 0.15),
    ("p", 0.2),
    ("printed", 0.1),
)


def varied_options(
    seed: int,
    *,
    kind: Kind,
    scenario: Scenario | None = None,
    duration_s: float = 120.0,
    structure: StructureOptions | None = None,
) -> SimulationOptions:
    """Options of one mission with plant, law, sensors, rate, ground, onsets and recorder drawn at random.

    All else is drawn alike with and without a structure, so that figures of varied machines stay comparable.

    Parameters
    ----------
    seed : int
        Of the draw and of the mission: 0…999 for ``tuning``, at least 2000 for ``reporting``.
    kind : str
        ``tuning`` or ``reporting``.
    scenario : str or None
        ``paper``, ``random`` or ``healthy``; None draws ``paper`` or ``random``.
    duration_s : float
        Length [s].
    structure : StructureOptions or None
        Another structure, whose drives, valves and sensors then replace those of the drawn plant; ``random`` draws it
        by the seed. λ is lowered where the structure's loop would ring.

    Raises
    ------
    ConfigError
        Where the kind is not known, or the seed belongs to the other pool.
    """
    _check_seed(seed, kind)
    ranges, rng = RANGES[kind], np.random.default_rng([seed, 91])

    def draw(span: Span) -> float:
        low, high = span
        x = np.exp(rng.uniform(np.log(low), np.log(high))) if low > 0.0 else rng.uniform(low, high)
        return float(f"{x:.4g}")

    plant = PlantOptions(**{name: draw(span) for name, span in ranges.plant.items()})
    names, shares = zip(*_LAWS, strict=True)
    law = names[int(rng.choice(len(names), p=shares))]
    fault_scenario: Scenario = "paper" if rng.random() < 0.5 else "random"
    control = replace(
        haulotte().control,
        lambda_=_tamed(draw(ranges.lambda_), plant, None if structure is None else structure.structure(seed)),
        k_ps=draw(ranges.k_ps),
        zeta=draw(ranges.zeta),
    )
    return SimulationOptions(
        scenario=scenario or fault_scenario,
        seed=seed,
        duration_s=duration_s,
        rate_hz=float(rng.choice(ranges.rates)),
        coupling="ground" if rng.random() < 0.7 else "free",
        law=law,
        psi0=draw(ranges.psi0),
        ice=draw(ranges.ice),
        steepness=draw(ranges.steepness),
        steering_faults=bool(rng.random() < 0.3),
        ramp_share=draw(ranges.ramp_share),
        ramp_max_s=draw(ranges.ramp_max_s),
        early_share=draw(ranges.early_share),
        silent=("zero", "nan", "drop")[int(rng.integers(3))],
        jitter=draw(ranges.jitter) if rng.random() < 2 / 3 else 0.0,
        drop_share=draw(ranges.drop_share) if rng.random() < 0.5 else 0.0,
        drop_burst_s=draw(ranges.drop_burst_s),
        machine=replace(haulotte(), control=control),
        plant=plant,
        structure=structure,
    )


def _check_seed(seed: int, kind: Kind) -> None:
    """Raise where the kind is not known, or the seed belongs to the other pool."""
    if kind not in POOLS:
        raise ConfigError(f"kind = {kind!r} is not known; expected tuning or reporting")
    if seed not in POOLS[kind]:
        where = "0 to 999" if kind == "tuning" else "at least 2000"
        raise ConfigError(f"seed = {seed} is not a {kind} seed; expected {where}")


def _tamed(lambda_: float, plant: PlantOptions, structure: Structure | None) -> float:
    """λ that neither makes the loop ring nor leaves the machine behind its commands (Kλ ≥ 1.5)."""
    if structure is not None:
        gain, least = float(np.mean(structure.gain)), 1.5
        if structure.drive == "torque":
            gain, dry = float(np.mean(structure.acceleration)), structure.coulomb[1] + structure.stribeck[1]
            least = 1.5 * structure.viscous[1] + dry / _DRY_ERROR
        return float(f"{min(max(lambda_, least / gain), stiffest_loop(structure) / gain):.4g}")
    tau, lag = plant.tau, plant.valve_lag
    if lag > 0.0:
        lambda_ = min(lambda_, ((tau + lag) ** 2 / (tau * lag) - 1.0) / plant.K)
    return float(f"{max(lambda_, 1.5 / plant.K):.4g}")
