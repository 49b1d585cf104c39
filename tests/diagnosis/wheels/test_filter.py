"""All wheels filtered together: parts of a mission, evidence over runs against a loop, faults isolated by their rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.channels.sample_status import PAIR, SILENT, SKIP
from diagnosis.wheels.blocks import WheelBlocks, blocks_of
from diagnosis.wheels.entry_kernel import enter
from diagnosis.wheels.filter import first_speeds, forward, initial_state, most_probable
from diagnosis.wheels.models import (
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    ROW_OF_MODEL,
    S_GAIN,
    S_NONE,
    S_STUCK,
    S_WHITE_24,
    JointModel,
    WheelFilterModel,
)
from diagnosis.wheels.run_kernel import evidence_of_runs
from diagnosis.wheels.runs import Runs
from diagnosis.wheels.step_kernel import WheelInput, advance, predict
from replay.machine.config import WheelPlant

RAW, WIDTH, DT = 0.001, 10, 0.01
WHEEL = WheelFilterModel(
    K=2.4,
    tau=0.25,
    noise=0.004,
    constant_noise=0.0005,
    rounding=0.0003,
    load=0.014,
    span=0.8,
    valve_span=0.15,
)
N, ONSET = 12_000, 6000
ROW = np.array([ROW_OF_MODEL.index(row) for row in ROW_OF_MODEL])  # first model of each model's row
PLANTS = (WheelPlant(WHEEL.K, WHEEL.tau),) * 4
Array = np.ndarray
Fault = Callable[[Array], Array]


def machine(flow: float = 1e9) -> JointModel:
    return JointModel((WHEEL,) * 4, flow, float(np.log(60.0 / DT * 12)))


def openings(n: int = N) -> Array:
    """Four valves on a drive back and forth, each a little different."""
    t = np.arange(n)[:, None] * RAW
    x = 0.07 * np.sin(2 * np.pi * t / 5.0) + 0.03 * np.sign(np.sin(2 * np.pi * t / 1.7 + 0.3))
    return np.asarray(x * [1.0, 0.95, 1.1, 1.05])


def rolled(u: Array, flow: float = 1e9) -> Array:
    """τ v̇ = −v + K u·share of four wheels on one pump, sample by sample."""
    v, out = np.zeros(4), np.empty(u.shape)
    a = np.exp(-RAW / WHEEL.tau)
    for k in range(u.shape[0]):
        out[k] = v
        v = a * v + (1 - a) * WHEEL.K * u[k] * min(1.0, flow / max(WHEEL.K * np.abs(u[k]).sum(), 1e-9))
    return out


def noisy(v: Array, seed: int = 1) -> Array:
    measured: Array = np.round(v + WHEEL.noise * np.random.default_rng(seed).normal(size=v.shape), 3)
    return measured


def blocks(y: Array, u: Array, status: Array | None = None, plants: Sequence[WheelPlant] = PLANTS) -> WheelBlocks:
    n = y.shape[0]
    status = np.full((n, 4), PAIR, dtype=np.int8) if status is None else status
    ratio, turn = np.ones((n, 4)) * [1.0, 1.02, 0.98, 1.01], np.zeros((n, 4))
    return blocks_of(y, u, status, np.zeros((n, 4), dtype=np.bool_), ratio, turn, plants, RAW)


@pytest.mark.parametrize("grip_most", [0.0, 0.1], ids=["free", "ground"])
def test_two_parts_give_the_numbers_of_one(grip_most: float) -> None:
    u = openings(4000)
    applied = u.copy()
    applied[1500:2200, 1] = 0.0
    y = noisy(rolled(applied, 0.7))
    y[2500:3000, 2] = 0.2
    model = machine(0.7).sliding_at(grip_most / WheelFilterModel.grip)
    whole = blocks(y, u)
    once = forward(whole, model)
    for cut in (1, 173, 399):
        first = forward(whole.part(0, cut), model)
        second = forward(whole.part(cut, 400), model, first.state)
        for i, back in enumerate(once.back):
            assert_array_equal(np.concatenate([first.back[i], second.back[i]]), back)
        assert_array_equal(np.concatenate([first.best, second.best]), once.best)
        assert_array_equal(np.concatenate([first.inputs, second.inputs]), once.inputs)
        assert_array_equal(np.concatenate([first.fault, second.fault]), once.fault)
        for name in ("score", "mean", "cov", "carried"):
            assert_array_equal(getattr(second.state, name), getattr(once.state, name), err_msg=name)
        assert first.evidence + second.evidence == pytest.approx(once.evidence)


def test_a_mission_may_begin_with_a_fault() -> None:
    speeds = np.array([0.2, -0.1, 0.0, 0.3])
    start = initial_state(speeds, machine(), DT, RAW)
    assert_array_equal(start.score[:, HEALTHY], 0.0)
    assert_allclose(start.score[:, 1:], -0.5 * machine().switch_cost)
    assert_array_equal(start.carried, np.column_stack([np.zeros((4, 3)), speeds]))
    assert_allclose(start.mean[:, A_NONE, 0], speeds)
    assert_allclose(start.mean[:, S_GAIN, 0], 0.5 * speeds)
    u = openings(3000)
    y = noisy(rolled(u))
    y[:2000, 0] = 0.15
    path, _ = most_probable(forward(blocks(y, u), machine()), 0)
    assert (path[:200] == S_STUCK).all()
    assert (path[210:] == HEALTHY).all()


def test_first_known_speed() -> None:
    y, status = np.full((50, 4), 0.3), np.full((50, 4), PAIR, dtype=np.int8)
    y[:20], y[20:30] = np.nan, 0.1
    status[:20] = SKIP
    status[:, 3], y[:, 3] = SKIP, np.nan
    assert_allclose(first_speeds(blocks(y, np.zeros((50, 4)), status)), [0.1, 0.1, 0.1, 0.0])


MAP = WheelPlant(  # seen up to 7 % of opening
    WHEEL.K,
    WHEEL.tau,
    openings=(-0.2, -0.07, 0.07, 0.2),
    speeds=(-0.168, -0.168, 0.168, 0.168),
    unseen=(-0.312, 0.0, 0.0, 0.312),
)


@pytest.mark.parametrize("ended", [False, True], ids=["map goes on", "map ends"])
def test_evidence_is_what_a_loop_sums_up(ended: bool) -> None:
    u = openings(2400)
    y = noisy(rolled(u))
    y[1000:1600, 0] *= 0.5
    status = np.full((2400, 4), PAIR, dtype=np.int8)
    status[300:340] = SKIP
    cut, model = blocks(y, u, status, (MAP,) * 4), machine()
    cut = cut.ending() if ended else cut
    unseen = WHEEL.K * cut.unseen[:, 0] * ended
    assert (np.abs(unseen) > 0.01).any() == ended
    done = forward(cut, model)
    runs = Runs(*(np.array(x) for x in ([0, 100, 160], [100, 160, 240], [HEALTHY, S_GAIN, HEALTHY], [0, 102, 160])))
    got = evidence_of_runs(cut, model, done, 0, runs)

    k = WHEEL.constants(DT, RAW)
    start = initial_state(first_speeds(cut), model, DT, RAW)
    z, P, gain = start.mean[0].copy(), start.cov[0].copy(), np.zeros(MODELS)
    free, free_P = z.copy(), P.copy()
    expected, spread = np.empty(240), np.empty(240)
    for r, (first, stop, last, m) in enumerate([(0, 100, 102, 0), (102, 160, 160, S_GAIN), (160, 240, 240, 0)]):
        if r:
            before = ([0, S_GAIN][r - 1], z.copy(), P.copy())
            for j in range(MODELS):
                z_j, P_j = before[1].copy(), before[2].copy()
                enter(j, before[0], k, z_j, P_j)
                z[j], P[j] = z_j[j], P_j[j]
        total = np.zeros(MODELS)
        for n in range(first, last):
            x, chatter = done.inputs[n, 0], cut.unsteady[n, 0] * WHEEL.K * RAW / WHEEL.tau
            seen = (cut.y[n, 0], cut.count[n, 0], cut.jitter[n, 0], 1.0, 0.0, np.int8(0))
            q = WheelInput(*seen, x[0], x[1], x[2], x[3], x[4], chatter, 0.0, x[5], x[6], unseen[n])
            predict(HEALTHY, q, k, free, free_P)
            expected[n], spread[n] = free[0, 0], free_P[0, 0, 0]
            advance(MODELS, q, cut.status[n, 0], False, k, z, P, gain)
            if n < stop:
                total += gain
            if n == stop - 1:
                assert_allclose(got.mean[r], z, rtol=1e-9, atol=1e-12)
                assert_allclose(got.cov[r], P, rtol=1e-9, atol=1e-14)
            if m == HEALTHY and n < stop:
                free[0], free_P[0] = z[0], P[0]
        assert_allclose(got.evidence[r], total, rtol=1e-9)
        best = int(np.argmax(total))  # a wheel that is faster than a map that ends is healthy under an unusual load
        assert (ROW[best] if ended else best) == m
    assert_allclose(got.expected, expected, rtol=1e-9, atol=1e-12)
    assert_allclose(got.spread, spread, rtol=1e-9)


@pytest.mark.parametrize("weighed", [(), (1,), (0, 2, 3), (4,)], ids=str)
def test_runs_that_are_not_weighed_change_nothing_of_the_others(weighed: tuple[int, ...]) -> None:
    u = openings(4000)
    y = noisy(rolled(u))
    y[1000:1600, 0] *= 0.5
    y[2500:3000, 0] = 0.1
    status = np.full((4000, 4), PAIR, dtype=np.int8)
    status[300:340], status[2700:2750] = SKIP, SILENT
    cut, model = blocks(y, u, status), machine()
    done = forward(cut, model)
    edges = np.array([0, 100, 160, 250, 300, 400])
    kinds, entry = np.array([HEALTHY, S_GAIN, HEALTHY, S_STUCK, HEALTHY]), np.array([0, 104, 160, 251, 310])
    runs = Runs(edges[:-1], edges[1:], kinds, entry)
    every = evidence_of_runs(cut, model, done, 0, runs)
    some = evidence_of_runs(cut, model, done, 0, runs, weighed)
    assert_array_equal(some.expected, every.expected)
    assert_array_equal(some.spread, every.spread)
    chosen = list(weighed)
    for name in ("evidence", "mean", "cov"):
        assert_array_equal(getattr(some, name)[chosen], getattr(every, name)[chosen], err_msg=name)
        assert not np.delete(getattr(some, name), chosen, axis=0).any()


def test_expectation_goes_on_through_a_fault() -> None:
    u = openings(2400)
    v = rolled(u)
    y = noisy(v)
    y[1000:1600, 0] = 0.3
    cut, model = blocks(y, u), machine()
    edges = np.array([0, 100, 160, 240])
    runs = Runs(edges[:-1], edges[1:], np.array([HEALTHY, S_STUCK, HEALTHY]), np.array([0, 110, 160]))
    got = evidence_of_runs(cut, model, forward(cut, model), 0, runs)
    off = got.expected - v[:, 0].reshape(-1, WIDTH).mean(axis=1)
    assert np.abs(off[100:160]).max() < 0.01
    # it becomes less certain meanwhile
    assert got.spread[159] > 2 * got.spread[99]
    assert got.spread[180] < 2 * got.spread[99]


def rows(y: Array, u: Array, model: JointModel, status: Array | None = None) -> Array:
    """Row of every block and wheel."""
    done = forward(blocks(y, u, status), model)
    return ROW[np.column_stack([most_probable(done, i)[0] for i in range(4)])]


@pytest.mark.parametrize("flow", [1e9, 0.7], ids=["own supply", "pump at its limit"])
@pytest.mark.parametrize("seed", range(2))
def test_healthy_wheels_are_healthy(seed: int, flow: float) -> None:
    u = openings()
    assert_array_equal(rows(noisy(rolled(u, flow), seed), u, machine(flow)), ROW[HEALTHY])


RNG_NOISE = 0.08 * np.random.default_rng(9).normal(size=N)
SENSOR: dict[str, tuple[int, Fault]] = {
    "stuck": (S_STUCK, lambda v: np.full(v.size, 0.2)),
    "no signal": (S_NONE, lambda v: np.zeros(v.size)),
    "inefficient": (S_GAIN, lambda v: 0.5 * v),
    "noise-affected": (S_WHITE_24, lambda v: 0.7 * v + RNG_NOISE[: v.size]),
}
VALVE: dict[str, tuple[int, Fault]] = {
    "inefficient": (A_GAIN, lambda u: 0.5 * u),
    "stuck": (A_STUCK, lambda u: np.full(u.size, 0.09)),
    "no control signal": (A_NONE, lambda u: np.zeros(u.size)),
}


@pytest.mark.parametrize("name", SENSOR)
def test_sensor_fault_is_the_sensors(name: str) -> None:
    model, fault = SENSOR[name]
    u = openings()
    y = noisy(rolled(u))
    y[ONSET:, 2] = fault(y[ONSET:, 2])
    row = rows(y, u, machine())
    edge = ONSET // WIDTH
    assert_array_equal(row[:, [0, 1, 3]], ROW[HEALTHY])
    assert_array_equal(row[: edge - 1, 2], ROW[HEALTHY])
    assert np.mean(row[edge + 10 :, 2] == ROW[model]) > 0.98


@pytest.mark.parametrize("flow", [1e9, 0.7], ids=["own supply", "pump at its limit"])
@pytest.mark.parametrize("name", VALVE)
def test_valve_fault_is_the_valves(name: str, flow: float) -> None:
    """The pump feeds the other wheels more or less from then on, and none of them is blamed for it."""
    model, fault = VALVE[name]
    u = openings()
    applied = u.copy()
    applied[ONSET:, 2] = fault(u[ONSET:, 2])
    row = rows(noisy(rolled(applied, flow)), u, machine(flow))
    edge, lag = ONSET // WIDTH, round(WHEEL.tau / DT)
    assert np.mean(row[:, [0, 1, 3]] == ROW[HEALTHY]) > 0.99
    assert_array_equal(row[: edge - lag, 2], ROW[HEALTHY])
    # half a loss may pass for an unusual load at first
    assert np.mean(row[edge + 2 * lag :, 2] == ROW[model]) > (0.7 if name == "inefficient" else 0.95)


def test_silence_beside_living_siblings_is_no_signal() -> None:
    u = openings(6000)
    y, status = noisy(rolled(u)), np.full((6000, 4), PAIR, dtype=np.int8)
    y[2000:4000, 1], status[2000:4000, 1] = np.nan, SILENT
    row = rows(y, u, machine(), status)
    assert (row[200:400, 1] == ROW[S_NONE]).all()
    assert (row[:200, 1] == ROW[HEALTHY]).all()
    assert (row[405:, 1] == ROW[HEALTHY]).all()


def test_measured_valves_are_judged_elsewhere() -> None:
    u = openings(3000)
    applied = u.copy()
    applied[1500:, 0] = 0.0
    cut = blocks(noisy(rolled(applied)), u)
    model = JointModel((replace(WHEEL, measured=True), WHEEL, WHEEL, None), 1e9, 12.0)
    done = forward(cut, model)
    assert done.best[:, 0].max() < A_GAIN
    assert_array_equal(done.best[:, 3], HEALTHY)
    one = np.array([0])
    got = evidence_of_runs(cut, model, done, 0, Runs(one, np.array([300]), one, one))
    assert_array_equal(got.evidence[0, A_GAIN:], -np.inf)
    assert np.isfinite(got.evidence[0, :A_GAIN]).all()
