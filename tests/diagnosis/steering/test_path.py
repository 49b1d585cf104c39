"""The recursions along a path agree with each other, and refining puts a fault's ends where the evidence is."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.steering.blocks import SensorNoise, blocks_of
from diagnosis.steering.driven import driven_by
from diagnosis.steering.model_bank import ACTUATOR, HEALTHY, INEFFICIENT, NOISY, SENSOR, STUCK
from diagnosis.steering.models import model_of
from diagnosis.steering.path import AxleFilter, allowed_models, evidence_of, follow_path, most_probable
from diagnosis.steering.path_refinement import refine_path
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.valve_map import ValveMap

DT, START, STOP = 0.002, 8.0, 12.0
VALVE = ValveMap(4.0, 4.0, 0.0, 0.0, 0.25, 0.25)
PLANT = SteeringPlant(VALVE, 0.05, 0.0, 1e-4 * np.eye(8), 0.01, 50, (-0.1, 0.1))


@pytest.fixture(scope="module")
def axle() -> AxleFilter:
    """Twenty seconds of a steered axle whose sensor sticks from 8 s to 12 s."""
    t = np.arange(0.0, 20.0, DT)
    u = 0.05 * np.sin(1.5 * t)
    phi, rate = np.zeros(t.size), 0.0
    for k in range(1, t.size):
        rate += DT / PLANT.lag * (PLANT.gain * u[k] - rate)
        phi[k] = phi[k - 1] + DT * rate
    y = phi + np.random.default_rng(1).normal(0.0, 5e-4, t.size)
    y[(t >= START) & (t < STOP)] = y[round(START / DT)]
    always = np.ones(t.size, np.bool_)
    blocks = blocks_of(y, u, always, always, DT)
    noise = SensorNoise(white=2.5e-7, spread=0.01, step=0.0, lsb=0.0)
    model = model_of(blocks, PLANT, noise, stop=0.785)
    allowed = allowed_models(sensor=True, actuator=True, redundant=False)
    return AxleFilter(blocks, driven_by(PLANT, blocks), model, allowed, ("phi", "u"))


def test_a_stuck_sensor_lies_where_it_was_put(axle: AxleFilter) -> None:
    rows = refine_path(axle, most_probable(axle)).sensor
    assert set(rows.tolist()) == {HEALTHY, STUCK}
    stuck = np.flatnonzero(rows == STUCK) * axle.blocks.dt
    assert stuck[0] == pytest.approx(START, abs=0.03)
    assert stuck[-1] == pytest.approx(STOP, abs=0.03)


@pytest.mark.parametrize(
    ("pair", "free"),
    [((HEALTHY, HEALTHY), "φrb"), ((STUCK, HEALTHY), "φrbc"), ((NOISY, INEFFICIENT), "φrabdc"), ((INEFFICIENT, STUCK), "φrbd")],
)  # fmt: skip
def test_what_a_model_does_not_free_stays_as_it_was_entered(axle: AxleFilter, pair: tuple[int, int], free: str) -> None:
    model = list(zip(SENSOR.tolist(), ACTUATOR.tolist(), strict=True)).index(pair)
    path = follow_path(axle, np.full(axle.blocks.mean.size, model, np.uint8))
    fixed = [i for i, name in enumerate("φrabdc") if name not in free]
    assert (np.delete(path.variance, fixed, axis=1)[10:] > 0.0).all()
    assert (path.cov[:, fixed] == 0.0).all()
    assert (path.cov[:, :, fixed] == 0.0).all()
    assert (path.mean[:, fixed] == path.mean[0, fixed]).all()


def test_evidence_from_any_block_ends_in_the_state_of_the_whole_path(axle: AxleFilter) -> None:
    known = refine_path(axle, most_probable(axle))
    for start, stop in ((0, 700), (850, 1000), (1300, known.model.size)):
        _, state = evidence_of(axle, known, known.model, start, stop)
        assert_allclose(state, known.mean[stop - 1], rtol=0, atol=0)


@pytest.mark.parametrize("begin", [0, 1, 900, 1999])
def test_states_from_where_two_paths_part_are_those_of_the_whole_path(axle: AxleFilter, begin: int) -> None:
    first = most_probable(axle)
    other = first.copy()
    other[begin:] = np.where(other[begin:] == 0, 1, 0)
    whole, resumed = follow_path(axle, other), follow_path(axle, other, follow_path(axle, first))
    for a, b in zip(whole, resumed, strict=True):
        assert_array_equal(a, b)
    assert follow_path(axle, other, resumed) is resumed


def test_evidence_of_a_path_is_that_of_its_parts(axle: AxleFilter) -> None:
    path = follow_path(axle, most_probable(axle))
    whole = evidence_of(axle, path, path.model, 100, 1900)[0]
    parts = [evidence_of(axle, path, path.model, a, b)[0] for a, b in ((100, 900), (900, 1300), (1300, 1900))]
    assert sum(parts) == pytest.approx(whole, rel=1e-9)


def test_models_of_a_side_that_is_not_judged_are_left_out() -> None:
    allowed = allowed_models(sensor=False, actuator=True, redundant=True)
    assert (SENSOR[allowed] == HEALTHY).all()
