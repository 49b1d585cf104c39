from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from replay.errors import ConfigError
from replay.simulation import run, structured_plant, structured_sensors, structured_state
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.plant import scan
from replay.simulation.state import Recording
from replay.simulation.structure import Structure
from replay.simulation.structure_draw import draw_machine
from replay.simulation.structures import STRUCTURES, StructureOptions

NAMES = list(STRUCTURES)


def healthy(name: str, seed: int = 3, duration_s: float = 20.0, **more: object) -> SimulationOptions:
    options = SimulationOptions(scenario="healthy", seed=seed, duration_s=duration_s, rate_hz=500.0, evidence="base")
    return replace(options, structure=StructureOptions(name), **more)  # type: ignore[arg-type]


@pytest.fixture(scope="module", params=NAMES)
def mission(request: pytest.FixtureRequest) -> SimulatedMission:
    return run.simulate_mission(healthy(request.param, duration_s=60.0))


def test_every_structure_follows_its_commands(mission: SimulatedMission) -> None:
    for wheel in mission.options.machine.wheels:
        error = mission.actual[f"wheel.{wheel}.v"] - mission.actual[f"wheel.{wheel}.v_ref"]
        assert np.isfinite(error).all()
        assert np.abs(error).mean() < 0.06
        assert np.abs(mission.columns[f"wheel.{wheel}.u"]).max() <= 1.0


def test_blocks_change_no_number() -> None:
    one, many = (run.simulate_mission(healthy("valves"), block=b) for b in (60_000, 777))
    for name, values in one.columns.items():
        np.testing.assert_array_equal(values, many.columns[name], err_msg=name)


def drawn(name: str, options: SimulationOptions) -> structured_state.StructureModel:
    model = run.mission_parts(options)[2]
    choice = StructureOptions(name, machine_seed=options.structure.machine_seed if options.structure else None)
    return draw_machine(
        choice.structure(options.seed), model, choice.generator(options.seed), 0.15, options.duration_s
    )[1]


def test_missions_of_one_machine_share_its_sizes() -> None:
    first, second = (
        drawn("valves", replace(healthy("valves", seed=s), structure=StructureOptions("valves", machine_seed=9)))
        for s in (1, 2)
    )
    other = drawn("valves", healthy("valves", seed=1))
    np.testing.assert_array_equal(first.gain_forward, second.gain_forward)
    assert not np.array_equal(first.gain_forward, other.gain_forward)


def test_an_unknown_structure_is_named() -> None:
    with pytest.raises(ConfigError, match="structure = 'steam' is not known; expected one of valves"):
        StructureOptions("steam")


def test_without_effects_it_is_the_default_machine() -> None:
    """Both compiled loops give the same numbers where no effect is switched on."""
    options = SimulationOptions(scenario="random", seed=5, duration_s=30.0, rate_hz=200.0, evidence="base")
    duty, faults, model = run.mission_parts(options)
    model = model._replace(dead_zone=0.0, leakage=0.0, speed_limit=1e9)
    steps = options.samples * options.substeps
    t = np.arange(steps) * model.dt
    found = []
    for structured in (False, True):
        table, _ = run._fault_table(options, faults, model.dt)
        state = run._initial_state(4, options.psi0, table)
        out = Recording(*(np.zeros((options.samples, w)) for w in [4] * 7 + [2] * 5 + [4, 4, 2, 2, 5]))
        normal = np.random.default_rng(1).standard_normal((steps, 6 + state.last.size))
        first = (0, options.substeps, duty.command(t), duty.slope.at(t), normal, model)
        if structured:
            more = structured_state.structure_state(4)
            structured_plant.scan(*first, structured_state.neutral(model), table, state, more, out, 0)
        else:
            scan(*first, table, state, out, 0)
        found.append(out)
    for name, plain, same in zip(Recording._fields, *found, strict=True):
        np.testing.assert_allclose(same, plain, rtol=0, atol=1e-9, err_msg=name)


def test_hall_sensors_step_and_counters_have_a_grid() -> None:
    torque = run.simulate_mission(healthy("torque"))
    v = torque.columns["wheel.FR.v"]
    driving = np.abs(torque.actual["wheel.FR.v"]) > 0.05
    held = (np.diff(v) == 0) & driving[1:]
    assert held.sum() > 0.5 * driving.sum()
    valves = run.simulate_mission(healthy("valves"))
    steps = np.diff(np.unique(np.round(valves.columns["wheel.FR.v"], 6)))
    assert np.allclose(steps / steps.min(), np.round(steps / steps.min()), atol=0.02)


@pytest.mark.parametrize(("u", "opened"), [(0.02, 0.0), (-0.05, 0.0), (0.525, 0.5), (1.0, 1.0), (-1.0, -1.0)])
def test_an_opening_within_the_dead_band_moves_nothing(u: float, opened: float) -> None:
    assert structured_plant._opened(u, 0.05, 0.06) == pytest.approx(opened)


def test_play_holds_until_it_is_crossed() -> None:
    held, seen = 0.0, []
    for value in (0.0, 0.05, 0.2, 0.15, 0.05, -0.1):
        held = structured_sensors.play(value, held, 0.1)
        seen.append(held)
    assert seen == pytest.approx([0.0, 0.0, 0.1, 0.1, 0.1, 0.0])


def test_a_structure_of_ones_own_is_taken() -> None:
    own = Structure(kind="tuning", dead_band=(0.04, 0.04))
    options = StructureOptions(own, machine_seed=4)
    assert options.structure(1) is own
    mission = run.simulate_mission(replace(healthy("pump"), structure=options))
    assert np.isfinite(mission.columns["wheel.FR.v"]).all()
