"""What a machine's motions show of its model's error: nothing where it fits, nor of a fault of one axle; much where spools are slower than it says."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from diagnosis.steering.blocks import SensorNoise, blocks_of
from diagnosis.steering.driven import driven_by
from diagnosis.steering.model_error import ModelError, model_error
from diagnosis.steering.models import model_of
from diagnosis.steering.path import AxleFilter, allowed_models
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.valve_map import ValveMap, rates_at

DT = 0.005
NOISE = SensorNoise(white=2.5e-7, spread=0.01, step=0.0, lsb=0.0)
VALVE = ValveMap(0.6, 0.6, 0.02, 0.02, 0.4, 0.4)
PLANT = SteeringPlant(VALVE, 0.1, 0.0, np.diag([1e-4] * 8), 0.01, 100, (-1.0, 1.0))
TIME = np.arange(0.0, 60.0, DT)


def lagged(x: np.ndarray, lag: float) -> np.ndarray:
    out = np.zeros(x.size)
    for k in range(1, x.size):
        out[k] = out[k - 1] + DT / lag * (x[k] - out[k - 1])
    return out


def axle(seed: int, *, late: float = 0.0, share: np.ndarray | float = 1.0) -> Callable[[ModelError], AxleFilter]:
    """An axle whose commands switch every second and a half; `late` [s] more than the plant's lag, its rate times `share`."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-0.5, 0.0, 0.4], 40), TIME.size // 40)
    u -= np.repeat(u.reshape(20, -1).mean(axis=1), TIME.size // 20)  # nowhere near the stops
    rate = lagged(share * rates_at(u, VALVE), 0.1)
    if late:
        rate = np.concatenate([np.zeros(round(late / DT)), rate])[: u.size]
    y = np.cumsum(rate) * DT + rng.normal(0.0, 5e-4, u.size)
    always = np.ones(u.size, np.bool_)
    blocks = blocks_of(y, u, always, always, DT)
    allowed = allowed_models(sensor=True, actuator=True, redundant=False)

    def under(error: ModelError) -> AxleFilter:
        model = model_of(blocks, PLANT, NOISE, 3.0, error.lag)
        return AxleFilter(blocks, driven_by(PLANT, blocks, error.share), model, allowed, ("phi", "u"))

    return under


def test_a_model_that_fits_has_no_error() -> None:
    assert model_error([axle(1), axle(2)]) == ModelError()


def test_spools_that_are_later_show_in_the_lag() -> None:
    assert model_error([axle(1, late=0.06), axle(2, late=0.06)]).lag > 0.1


def test_rates_that_vary_from_motion_to_motion_show_in_their_share() -> None:
    vary = 1.0 + 0.15 * np.sin(TIME / 2.3)
    assert model_error([axle(1, share=vary), axle(2, share=vary)]).share > 0.0


def test_one_axle_alone_tells_nothing_of_the_machine() -> None:
    assert model_error([axle(1, late=0.06, share=0.6), axle(2)]) == ModelError()


def test_few_motions_tell_nothing() -> None:
    assert model_error([axle(1, share=0.0)]) == ModelError()
