"""The wheel model is identified from a mission, also one with many faults or at the limit of the pump."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from diagnosis.estimation.lag import low_passed
from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.wheels.identification import demand, identify
from diagnosis.wheels.robust_fit import mode
from replay.machine.config import WheelPlant

DT, N = 0.01, 6000
Array = np.ndarray


def openings(wheels: int = 4, seed: int = 1) -> Array:
    """Joystick-like openings that move between −0.15 and 0.15."""
    rng = np.random.default_rng(seed)
    targets: Array = rng.uniform(0.04, 0.15, size=(N // 150, wheels)) * rng.choice([-1, 1], size=(N // 150, 1))
    return np.asarray(np.repeat(targets, 150, axis=0))


def speeds(u: Array, K: Array, tau: float, noise: float = 0.004) -> Array:
    v = np.column_stack([low_passed(u[:, i], tau, DT) for i in range(u.shape[1])]) * K
    return np.asarray(v + noise * np.random.default_rng(2).normal(size=v.shape))


def moving(u: Array) -> Array:
    return np.asarray(np.abs(u) > 0.02)


def test_low_pass_is_the_lag_of_the_wheel() -> None:
    u = np.repeat([0.0, 0.1, -0.05, 0.2], 10)
    steps, v = [], 0.0
    for k in range(u.size - 1):
        steps.append(v)
        v = float(solve_ivp(lambda _, y, k=k: (u[k] - y) / 0.25, (0, DT), [v], rtol=1e-10, atol=1e-13).y[0, -1])
    assert_allclose(low_passed(u, 0.25, DT)[:-1], steps, rtol=1e-8, atol=1e-12)
    assert low_passed(np.empty(0), 0.25, DT).size == 0
    assert_allclose(low_passed(np.array([0.0, np.nan, 0.0]), 0.25, DT), 0.0)


@pytest.mark.parametrize("tau", [0.05, 0.25, 0.5])
def test_gain_and_lag_are_found(tau: float) -> None:
    u, K = openings(), np.array([2.4, 2.3, 2.5, 2.4])
    fit = identify(speeds(u, K, tau), u, moving(u), DT, {})
    assert fit.reliable
    plants = [p for p in fit.plants if p is not None]
    assert_allclose([p.K for p in plants], K, rtol=0.02)
    assert {p.tau for p in plants} == {tau}
    assert fit.windows > 20
    assert "K = 2.4" in fit.note


def test_faults_in_part_of_the_mission_change_little() -> None:
    u, K = openings(), np.full(4, 2.4)
    y = speeds(u, K, 0.25)
    y[1000:3000, 0] = 0.2  # stuck
    y[2000:4000, 1] *= 0.5  # inefficient
    fit = identify(y, u, moving(u), DT, {})
    assert fit.reliable
    assert_allclose([p.K for p in fit.plants if p is not None], 2.4, rtol=0.03)


@pytest.mark.parametrize("seed", range(4))
def test_faults_in_most_of_one_wheels_windows_change_little(seed: int) -> None:
    u, K = openings(seed=seed), np.array([2.4, 2.35, 2.45, 2.4])
    y = speeds(u, K, 0.25)
    rng = np.random.default_rng(seed)
    faults: list[tuple[int, int, Callable[[Array], Array]]] = [
        (300, 1300, lambda v: 0.5 * v),
        (1400, 2600, lambda v: np.full(v.size, 0.2)),
        (2800, 3600, lambda v: 0.6 * v + 0.1 + 0.15 * rng.normal(size=v.size)),
        (3700, 4400, lambda v: 0.75 * v),
    ]
    assert sum(stop - start for start, stop, _ in faults) > 0.6 * N
    for start, stop, fault in faults:
        y[start:stop, 0] = fault(y[start:stop, 0])
    fit = identify(y, u, moving(u), DT, {})
    assert fit.reliable
    assert_allclose([p.K for p in fit.plants if p is not None], K, rtol=0.02)


def test_wheel_far_from_the_others_takes_the_machines_gain() -> None:
    u, K = openings(), np.array([2.4, 2.4, 2.4, 1.2])
    fit = identify(speeds(u, K, 0.25), u, moving(u), DT, {})
    last = fit.plants[3]
    assert last is not None
    assert pytest.approx(2.4, rel=0.02) == last.K


def test_given_models_are_taken_as_they_are() -> None:
    u = openings(2)
    given = WheelPlant(K=1.1, tau=0.3, K_std=0.1)
    fit = identify(speeds(u, np.array([2.4, 2.4]), 0.25), u, moving(u), DT, {0: given})
    assert fit.plants[0] is given
    assert fit.plants[1] is not None
    only = identify(np.full((N, 1), np.nan), np.full((N, 1), np.nan), np.zeros((N, 1), dtype=bool), DT, {0: given})
    assert only.plants == (given,)
    assert only.reliable


def test_nothing_moves_nothing_is_known() -> None:
    zero = np.zeros((N, 2))
    fit = identify(zero, zero, np.zeros((N, 2), dtype=bool), DT, {})
    assert fit.plants == (None, None)
    assert not fit.reliable
    assert "no window" in fit.note


def test_speeds_that_do_not_follow_are_no_model() -> None:
    u = openings()
    y = 0.3 * np.random.default_rng(5).normal(size=u.shape).cumsum(axis=0) / 30
    assert not identify(y, u, moving(u), DT, {}).reliable


def test_pump_limit_is_left_out() -> None:
    u = openings() * np.where(np.arange(N) < N // 4, 1.0, 3.0)[:, None]
    K, flow = np.full(4, 2.4), 1.6
    asked = np.abs(u).sum(axis=1) * 2.4
    fed = u * np.minimum(1.0, flow / asked)[:, None]
    assert (asked > flow).mean() > 0.5
    y = speeds(fed, K, 0.25)
    fit = identify(y, u, moving(u), DT, {}, flow)
    assert_allclose([p.K for p in fit.plants if p is not None], K, rtol=0.03)
    without = identify(y, u, moving(u), DT, {})
    assert not np.allclose([p.K for p in without.plants if p is not None], K, rtol=0.03)
    assert_allclose(demand(np.abs(u), fit), asked, rtol=0.03)


def test_blocks_of_samples_ask_for_what_their_samples_ask() -> None:
    """Openings that change sign within a block: their mean says nothing of what the pump feeds."""
    u = openings() * np.where(np.arange(N) < N // 2, 1.0, 3.0)[:, None]
    chatter = 0.02 * (-1.0) ** np.arange(N)[:, None]
    K, flow = np.full(4, 2.4), 1.6
    asked = np.abs(u + chatter).sum(axis=1) * 2.4
    y = speeds((u + chatter) * np.minimum(1.0, flow / asked)[:, None], K, 0.25)

    def mean(x: Array) -> Array:
        return np.asarray(x.reshape(N // 2, 2, 4).mean(axis=1))

    fit = identify(mean(y), mean(u + chatter), mean(moving(u)) > 0.5, 2 * DT, {}, flow, mean(np.abs(u + chatter)))
    assert_allclose([p.K for p in fit.plants if p is not None], K, rtol=0.03)


def test_demand_of_a_wheel_without_a_model_is_that_of_the_others() -> None:
    fit = WheelModelFit((WheelPlant(2.0, 0.25), None, WheelPlant(3.0, 0.25)), 0.0, 9, True, "")
    assert_allclose(demand(np.array([[0.1, 0.2, 0.3], [0.0, 0.0, 0.0]]), fit), [0.2 + 0.5 + 0.9, 0.0])


def test_mode_is_where_values_are_densest() -> None:
    rng = np.random.default_rng(1)
    healthy, faulty = 2.4 + 0.02 * rng.normal(size=40), rng.uniform(0.0, 2.2, size=60)
    values = np.concatenate([healthy, faulty])
    assert mode(rng.permutation(values)) == pytest.approx(2.4, abs=0.03)
    assert np.median(values) < 2.2
    assert mode(np.array([3.0])) == 3.0
    assert mode(np.array([1.0, 5.0, 6.0])) == 5.0
