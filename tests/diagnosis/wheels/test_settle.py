"""Faults that began together: the others' models may be given, and what one wheel explains is taken back elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.channels.sample_status import PAIR
from diagnosis.estimation.back_pointers import STAY
from diagnosis.wheels.blocks import WheelBlocks, blocks_of
from diagnosis.wheels.filter import JointPass, forward, most_probable
from diagnosis.wheels.joint_types import SHARE_NONE
from diagnosis.wheels.models import A_GAIN, A_NONE, HEALTHY, JointModel, WheelFilterModel
from diagnosis.wheels.settle import settled
from replay.machine.config import WheelPlant

RAW, WIDTH, N, ONSET, STOP = 0.001, 10, 9000, 4000, 7000
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
FLOW = 0.7
MODEL = JointModel((WHEEL,) * 4, FLOW, float(np.log(60.0 / (WIDTH * RAW) * 12)))
PLANTS = (WheelPlant(WHEEL.K, WHEEL.tau),) * 4
Array = np.ndarray


def openings() -> Array:
    t = np.arange(N)[:, None] * RAW
    return np.asarray(
        (0.07 * np.sin(2 * np.pi * t / 5.0 + 0.2) + 0.03 * np.sign(np.sin(4 * t + 0.3))) * [1, 0.9, 1.1, 1]
    )


def blocks(applied: Array, u: Array) -> WheelBlocks:
    """Four wheels whose valves take `applied` of one pump."""
    v, y = np.zeros(4), np.empty(u.shape)
    a = np.exp(-RAW / WHEEL.tau)
    for k in range(N):
        y[k] = v
        v = a * v + (1 - a) * WHEEL.K * applied[k] * min(1.0, FLOW / max(WHEEL.K * np.abs(applied[k]).sum(), 1e-9))
    y += WHEEL.noise * np.random.default_rng(1).normal(size=y.shape)
    unknown, status = np.full(u.shape, np.nan), np.full(u.shape, PAIR, dtype=np.int8)
    return blocks_of(y, u, status, np.zeros(u.shape, dtype=np.bool_), unknown, unknown, PLANTS, RAW)


def test_the_others_may_be_given_the_model_of_a_wheel() -> None:
    u = openings()
    cut = blocks(u, u)
    given = np.full(cut.y.shape, STAY, dtype=np.uint8)
    own = forward(cut, MODEL)
    assert_array_equal(forward(cut, MODEL, given=given).inputs, own.inputs)
    given[:, 2] = A_NONE
    silent = forward(cut, MODEL, given=given)
    asked = WHEEL.K * np.abs(u)
    others = asked[:, 1] + asked[:, 3]
    for done, rest in ((own, others + asked[:, 2]), (silent, others)):
        share = np.minimum(1.0, FLOW / np.maximum(rest, 1e-9)).reshape(-1, WIDTH).mean(axis=1)
        assert_allclose(done.inputs[:, 0, SHARE_NONE], share, rtol=1e-9)


def test_nothing_is_taken_back_from_healthy_wheels() -> None:
    u = openings()
    cut = blocks(u, u)
    done = forward(cut, MODEL)
    assert settled(cut, MODEL, done) is done


@pytest.mark.parametrize("fault", [0.0, 0.5], ids=["no control signal", "inefficient"])
def test_one_valve_explains_what_all_wheels_suffer(fault: float) -> None:
    u = openings()
    applied = u.copy()
    applied[ONSET:STOP, 2] *= fault
    cut = blocks(applied, u)
    done = forward(cut, MODEL)
    got = settled(cut, MODEL, done)
    assert got.evidence >= done.evidence
    paths = np.column_stack([most_probable(got, i)[0] for i in range(4)])
    assert np.mean(paths[:, [0, 1, 3]] == HEALTHY) > 0.99
    middle = paths[ONSET // WIDTH + 50 : STOP // WIDTH - 10, 2]
    assert np.isin(middle, (A_GAIN, A_NONE)).mean() > 0.8  # half a loss may pass for an unusual load at first
    assert (paths[: ONSET // WIDTH - 30, 2] == HEALTHY).all()


def test_where_all_is_taken_back_the_pass_without_it_is_taken_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    u = openings()
    applied = u.copy()
    applied[ONSET:STOP, 2] = 0.0
    cut = blocks(applied, u)
    first = forward(cut, MODEL)
    asked: list[dict[str, Any]] = []

    def counted(*words: Any, **named: Any) -> JointPass:
        asked.append(named)
        return forward(*words, **named)

    monkeypatch.setattr("diagnosis.wheels.settle.forward", counted)
    monkeypatch.setattr("diagnosis.wheels.settle._doubted", lambda runs, near: [(0, ONSET // WIDTH, STOP // WIDTH)])
    got = settled(cut, MODEL, first)
    assert len(asked) == 1
    assert got.evidence > first.evidence
    assert_array_equal(got.gains, forward(cut, MODEL, given=asked[0]["given"]).gains)
