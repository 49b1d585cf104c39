from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest

from replay.simulation import run
from replay.simulation.options import SimulationOptions
from replay.simulation.random_structures import random_structure, stiffest_loop
from replay.simulation.structure import DRIVES, SPEED_SENSORS, Structure
from replay.simulation.structures import StructureOptions
from replay.simulation.variation import varied_options
from tests.campaigns import campaign

EFFECTS: dict[str, Callable[[Structure], bool]] = {
    **{
        name: lambda s, name=name: getattr(s, name)[1] > 0.0  # type: ignore[misc]
        for name in [
            "asymmetry",
            "dead_band",
            "hysteresis",
            "spool_lag",
            "wheel_limit",
            "pressure",
            "warming",
            "coulomb",
            "steer_dead_band",
            "steer_asymmetry",
            "steer_backlash",
        ]
    },
    "pump": lambda s: s.sharing == "proportional",
    "pi": lambda s: s.law == "pi",
    "scale": lambda s: s.scale > 0.0,
}


@pytest.fixture(scope="module")
def many() -> list[Structure]:
    return [random_structure(seed) for seed in range(300)]


def test_a_seed_draws_one_structure(many: list[Structure]) -> None:
    assert random_structure(7) == many[7]
    assert len(set(many)) == len(many)


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_is_there_and_absent(name: str, many: list[Structure]) -> None:
    assert 0.15 < np.mean([EFFECTS[name](s) for s in many]) < 0.65


def test_all_drives_and_sensors_are_drawn(many: list[Structure]) -> None:
    assert {s.drive for s in many} == set(DRIVES)
    assert {s.sensor for s in many} == set(SPEED_SENSORS)


def test_what_is_kept_for_figures_is_never_drawn(many: list[Structure]) -> None:
    assert all(s.kind == "tuning" and s.sharing != "least_loaded" and s.hysteresis[1] <= 0.02 for s in many)


def test_spans_are_in_order(many: list[Structure]) -> None:
    for structure in many[:50]:
        for field in fields(structure):
            value = getattr(structure, field.name)
            if isinstance(value, tuple) and field.name != "rate_hz":
                assert value[0] <= value[1], field.name


def test_a_proportional_loop_rings_beyond_the_stiffest_gain() -> None:
    """Second order: x'' + 2dω x' + ω²(1 + 2.5 g) x has damping d / √(1 + 2.5 g), with less for the loop's last lag."""
    structure = Structure(kind="tuning", drive="resonant", resonance=(2.0, 2.0), damping=(0.3, 0.3))
    assert 0.7 * 3.0 / 2.5 < stiffest_loop(structure) < 3.0 / 2.5


@pytest.mark.parametrize("seed", campaign([2, 11, 34]))
def test_random_machines_follow_their_commands(seed: int) -> None:
    options = SimulationOptions(scenario="healthy", seed=seed, duration_s=40.0, rate_hz=250.0, evidence="base")
    mission = run.simulate_mission(
        varied_options(seed, kind="tuning", scenario="healthy", duration_s=40.0, structure=StructureOptions("random"))
        if seed == 11
        else SimulationOptions(**{**vars(options), "structure": StructureOptions("random")})
    )
    for wheel in mission.options.machine.wheels:
        v, v_ref = mission.actual[f"wheel.{wheel}.v"], mission.actual[f"wheel.{wheel}.v_ref"]
        assert np.mean(v[v_ref > 0.15] > 0.02) > 0.8


def test_a_structure_changes_no_other_draw() -> None:
    plain = varied_options(12, kind="tuning")
    structured = varied_options(12, kind="tuning", structure=StructureOptions("random"))
    assert (plain.plant, plain.rate_hz, plain.law, plain.ice) == (
        structured.plant,
        structured.rate_hz,
        structured.law,
        structured.ice,
    )
