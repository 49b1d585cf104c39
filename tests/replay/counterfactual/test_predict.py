"""Two worlds: the recorded law gives the recorded mission, another one what a simulation of it gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from replay.controllers.choice import Controller
from replay.counterfactual.predict import predict
from replay.counterfactual.world import CoupledPlant, RecordedWorld, linear_map
from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec, Side
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.plant_options import PlantOptions
from replay.simulation.run import mission_parts, simulate_mission

OPTIONS = SimulationOptions(
    scenario="random",
    seed=3,
    duration_s=16.0,
    rate_hz=1000.0,
    evidence="base",
    coupling="free",
    plant=PlantOptions(pump_flow=1.0),
    faults=(
        FaultSpec("FR", Side.SENSOR, FaultMode.INEFFICIENT, 4.0, 7.0, 0.5),
        FaultSpec("FL", Side.ACTUATOR, FaultMode.INEFFICIENT, 4.0, 9.0, 0.6),
        FaultSpec("RR", Side.SENSOR, FaultMode.STUCK, 8.0, 10.0, 1.0, float("nan")),
        FaultSpec("RL", Side.ACTUATOR, FaultMode.STUCK, 8.0, 11.0, 1.0, float("nan")),
    ),
)
LAW = Controller("mfhca", {"zeta": 1000.0})


def stacked(mission: SimulatedMission, leaf: str, *, actual: bool = True) -> np.ndarray:
    source = mission.actual if actual else mission.columns
    return np.column_stack([source[f"wheel.{w}.{leaf}"] for w in mission.truth.wheels])


def world_of(mission: SimulatedMission) -> tuple[RecordedWorld, CoupledPlant]:
    """What the simulator knows of a mission off the ground, whose pump is never at its limit."""
    _, faults, model = mission_parts(mission.options)
    t, wheels = np.arange(mission.options.samples) / mission.options.rate_hz, mission.truth.wheels
    y = stacked(mission, "v", actual=False)
    let = {side: np.ones(y.shape) for side in Side}
    held = {side: np.zeros(y.shape, np.bool_) for side in Side}
    for f in faults:
        rows, i = (t >= f.start_s - 1e-9) & (t < f.stop_s - 1e-9), wheels.index(f.component)
        let[f.side][rows, i] = 1.0 - f.epsilon
        held[f.side][rows, i] = np.isnan(f.sat)
    world = RecordedWorld(
        dt=1.0 / mission.options.rate_hz,
        v_ref=stacked(mission, "v_ref"),
        y=y,
        u=stacked(mission, "u", actual=False),
        opening=stacked(mission, "u_applied"),
        speed=stacked(mission, "v"),
        let_sensor=let[Side.SENSOR],
        let_valve=let[Side.ACTUATOR],
        held_sensor=held[Side.SENSOR],
        held_valve=held[Side.ACTUATOR],
        ratio=np.ones(y.shape),
        turn=np.zeros(y.shape),
        ground=np.ones(y.shape),
    )
    openings, speeds = linear_map(model.K, np.zeros(4), 1.0)
    none = np.zeros(4)
    return world, CoupledPlant(model.tau, openings, speeds, none, none, none, 0.0, model.speed_limit)


@pytest.fixture(scope="module")
def recorded() -> tuple[SimulatedMission, RecordedWorld, CoupledPlant]:
    mission = simulate_mission(OPTIONS)
    return mission, *world_of(mission)


def test_the_recorded_law_gives_the_recorded_mission(
    recorded: tuple[SimulatedMission, RecordedWorld, CoupledPlant],
) -> None:
    _, world, plant = recorded
    found = predict(world, plant, LAW, 1.0)
    assert np.abs(found.shift).mean() < 1e-3
    error = [np.abs(world.speed + s - world.v_ref).mean() for s in (0.0, found.shift)]
    assert error[1] == pytest.approx(error[0], rel=0.01)
    assert np.abs(found.u).mean() == pytest.approx(np.abs(world.u).mean(), rel=0.01)


@pytest.mark.parametrize(
    "law", [Controller("mfhca", {"zeta": 2400.0}), Controller("p"), Controller("fuzzy")], ids=lambda c: c.name
)
def test_another_law_does_what_its_simulation_does(
    law: Controller, recorded: tuple[SimulatedMission, RecordedWorld, CoupledPlant]
) -> None:
    mission, world, plant = recorded
    found = predict(world, plant, law, 1.0)
    own = law.name == "mfhca"
    again = simulate_mission(
        replace(mission.options, controller=None if own else law, zeta=law.own["zeta"] if own else None)
    )
    truth = np.abs(stacked(again, "v") - world.v_ref).mean()
    assert np.abs(world.speed + found.shift - world.v_ref).mean() == pytest.approx(truth, rel=0.03)
    assert np.abs(found.u).mean() == pytest.approx(np.abs(stacked(again, "u", actual=False)).mean(), rel=0.03)


def test_a_dead_sensor_reads_the_same_in_every_world(
    recorded: tuple[SimulatedMission, RecordedWorld, CoupledPlant],
) -> None:
    _, world, plant = recorded
    dead = replace(world, let_sensor=np.zeros(world.y.shape), held_sensor=np.zeros(world.y.shape, np.bool_))
    np.testing.assert_array_equal(predict(dead, plant, Controller("p"), 1.0).y, world.y)


def test_columns_of_other_shapes_or_without_numbers_are_refused(
    recorded: tuple[SimulatedMission, RecordedWorld, CoupledPlant],
) -> None:
    _, world, plant = recorded
    with pytest.raises(ConfigError, match="expected one shape"):
        predict(replace(world, u=world.u[:-1]), plant, LAW, 1.0)
    holes = world.u.copy()
    holes[5, 1] = np.nan
    with pytest.raises(ConfigError, match="u has values that are no numbers"):
        predict(replace(world, u=holes), plant, LAW, 1.0)
