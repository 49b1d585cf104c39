"""The paper's table of controllers in the simulator: tracking error and effort of each class in the same missions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

from replay.controllers.choice import CONTROLLERS, Controller
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.presets import preset_options
from replay.simulation.run import simulate_mission

SCHEMA: Final = "mfhca-controllers/1"
TABLE_SCENARIOS: tuple[str, ...] = ("healthy", "brief", "paper", "ice")
SCENARIO_TEXT = {
    "healthy": "the paper's drive without faults, firm ground",
    "brief": "preset paper-table: the paper's drive and ice, faults as brief and partial as Assumptions 1 and 2 demand",
    "paper": "the paper's drive and ice, every row of both tables on every wheel for 3 to 12 s",
    "ice": "the paper's drive without faults, half of the ground under ice",
}
_RATE_HZ = 50.0  # recorded; the control step stays 1 ms
_ICE = 0.5

Array = NDArray[np.float64]


class Band(TypedDict):
    """A figure over seeds: mean, lowest, highest; null where no mission has it."""

    mean: float | None
    low: float | None
    high: float | None


class ControllerRow(TypedDict):
    """One controller in one scenario.

    `error` is mean |v_a − v_c| over wheels with the true speed [m/s], `effort` mean |u| [fraction of full opening];
    `error_in_faults` and `error_outside` are over the samples of wheels with a fault at that moment, and of those without.
    """

    controller: str
    title: str
    stands_for: str
    parameters: int
    scenario: str
    error: Band
    effort: Band
    error_in_faults: Band
    error_outside: Band


class ControllerTable(TypedDict):
    """Controllers by scenario."""

    schema: Literal["mfhca-controllers/1"]
    seeds: list[int]
    duration_s: float
    scenarios: dict[str, str]
    gains: dict[str, dict[str, float]]
    rows: list[ControllerRow]


@dataclass(frozen=True)
class _Figures:
    """Of one mission."""

    error: float
    effort: float
    in_faults: float
    outside: float


def table_options(scenario: str, controller: Controller, seed: int, duration_s: float) -> SimulationOptions:
    """One mission of the table.

    MFHCA takes its own parameters from the paper and Ψ̂'s forcing from the preset, whatever the scenario; the others the gains of
    their class.

    `duration_s` in s.
    """
    own = None if controller.name == "mfhca" else controller
    options = SimulationOptions(
        scenario="paper",
        seed=seed,
        duration_s=duration_s,
        rate_hz=_RATE_HZ,
        evidence="base",
        zeta=controller.own["zeta"] if own is None else None,
        controller=own,
    )
    if scenario == "brief":
        return replace(preset_options("paper-table", options), zeta=options.zeta)
    if scenario == "paper":
        return options
    return replace(options, faults=(), ice=_ICE if scenario == "ice" else 0.0)


def controller_table(
    names: Sequence[str], scenarios: Sequence[str], seeds: Sequence[int], duration_s: float
) -> Iterator[tuple[str, ControllerTable | None]]:
    """Simulate every controller in every scenario with every seed.

    Parameters
    ----------
    names : Sequence[str]
        Of `replay.controllers.choice.CONTROLLERS`.
    scenarios : Sequence[str]
        Of `TABLE_SCENARIOS`.
    seeds : Sequence[int]
        One mission each.
    duration_s : float
        Length of each mission [s].

    Yields
    ------
    tuple[str, ControllerTable or None]
        What is simulated next, and None; last an empty text and the table.
    """
    rows: list[ControllerRow] = []
    controllers = [Controller(name) for name in names]
    for scenario in scenarios:
        for controller in controllers:
            yield f"{controller.name}, {scenario}", None
            found = [_figures(simulate_mission(table_options(scenario, controller, s, duration_s))) for s in seeds]
            rows.append(_row(controller, scenario, found))
    yield (
        "",
        {
            "schema": SCHEMA,
            "seeds": list(seeds),
            "duration_s": duration_s,
            "scenarios": {s: SCENARIO_TEXT[s] for s in scenarios},
            "gains": {c.name: c.own for c in controllers},
            "rows": rows,
        },
    )


def _figures(mission: SimulatedMission) -> _Figures:
    wheels = mission.options.machine.wheels
    t = np.arange(mission.options.samples) / mission.options.rate_hz
    faulty = np.zeros((t.size, len(wheels)), np.bool_)
    for fault in mission.truth.intervals:
        if fault.component in wheels:
            faulty[:, wheels.index(fault.component)] |= (t >= fault.start_s) & (t < fault.stop_s)
    error = np.column_stack(
        [np.abs(mission.actual[f"wheel.{w}.v"] - mission.actual[f"wheel.{w}.v_ref"]) for w in wheels]
    )
    effort = np.column_stack([np.abs(mission.columns[f"wheel.{w}.u"]) for w in wheels])
    return _Figures(_mean(error), _mean(effort), _mean(error[faulty]), _mean(error[~faulty]))


def _mean(x: Array) -> float:
    return float(x.mean()) if x.size else float("nan")


def _row(controller: Controller, scenario: str, found: Sequence[_Figures]) -> ControllerRow:
    kind = CONTROLLERS[controller.name]
    return {
        "controller": kind.name,
        "title": kind.title,
        "stands_for": kind.stands_for,
        "parameters": kind.parameters,
        "scenario": scenario,
        "error": _band([f.error for f in found]),
        "effort": _band([f.effort for f in found]),
        "error_in_faults": _band([f.in_faults for f in found]),
        "error_outside": _band([f.outside for f in found]),
    }


def _band(values: Sequence[float]) -> Band:
    known = [x for x in values if np.isfinite(x)]
    if not known:
        return {"mean": None, "low": None, "high": None}
    return {"mean": float(np.mean(known)), "low": min(known), "high": max(known)}
