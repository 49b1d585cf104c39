"""Signals of a mission by steps: parts of time change nothing, and figures of single steps by hand."""

from __future__ import annotations

from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.channels.sample_status import PAIR, SILENT, SKIP
from diagnosis.wheels.blocks import WheelBlocks, blocks_of
from diagnosis.wheels.frames.signals import MissionSignals, step_width
from diagnosis.wheels.models import JointModel, WheelFilterModel
from replay.arrays.column_store import ColumnStore
from replay.machine.config import WheelPlant

WHEELS, DT = 3, 0.002
WHEEL = WheelFilterModel(
    K=2.0, tau=0.2, noise=0.01, constant_noise=1e-4, rounding=1e-4, load=0.1, span=2.0, valve_span=0.3
)
MODEL = JointModel((WHEEL, None, replace(WHEEL, tau=0.5)), flow=np.inf, switch_cost=8.0)


def mission(size: int, store: ColumnStore, *, body: bool = False) -> tuple[Any, WheelBlocks]:
    """A wheel with gaps that begin with the mission, one that falls silent, one without a model."""
    rng = np.random.default_rng(4)
    y = 0.5 + 0.01 * rng.normal(size=(size, WHEELS)).cumsum(axis=0)
    u = 0.4 + 0.01 * rng.normal(size=(size, WHEELS)).cumsum(axis=0)
    status = np.full((size, WHEELS), PAIR, np.int8)
    status[rng.random((size, WHEELS)) < 0.2] = SKIP
    status[: size // 10, 0] = SKIP
    status[size // 3 : size // 2, 0] = SKIP
    status[size // 2 : size // 2 + size // 4, 2] = SILENT
    y[status != PAIR] = np.nan
    u[size // 5 : size // 4, 1] = np.nan
    ratio = 1.0 + 0.1 * rng.normal(size=(size, WHEELS))
    ratio[: size // 6] = np.nan
    plants = [WheelPlant(2.0, 0.2, openings=(-0.3, 0.0, 0.3), speeds=(-0.6, 0.0, 0.6), unseen=(0.2, 0.0, 0.2))] * WHEELS
    blocks = blocks_of(y, u, status, rng.random((size, WHEELS)) < 0.5, ratio, 0.1 * ratio, plants, DT, store)
    if body:
        known = rng.random(blocks.y.shape)
        blocks = replace(blocks, body_speed=np.where(known < 0.3, np.nan, known), body_std=0.1 * known)
    reference = np.where(rng.random((size, WHEELS)) < 0.01, np.nan, 0.6)
    return SimpleNamespace(u=u, reference=reference, span=2.0), blocks


@pytest.mark.parametrize("body", [False, True])
@pytest.mark.parametrize("size", [3, 4007, 6000])
def test_parts_of_time_change_nothing(size: int, *, body: bool) -> None:
    whole = MissionSignals.of(*mission(size, ColumnStore(), body=body), MODEL)
    parts = MissionSignals.of(*mission(size, ColumnStore(block=300), body=body), MODEL)
    for field in fields(MissionSignals):
        assert_array_equal(getattr(parts, field.name), getattr(whole, field.name), field.name)


def test_steps_by_hand() -> None:
    data, blocks = mission(6000, ColumnStore(block=700))
    seen, width = MissionSignals.of(data, blocks, MODEL), step_width(blocks.dt)
    samples = width * blocks.width
    assert samples == 20
    for k in (0, 40, 120, 299):
        of_blocks, of_samples = slice(k * width, (k + 1) * width), slice(k * samples, (k + 1) * samples)
        assert_allclose(seen.command[k, 0], data.u[of_samples, 0].mean())
        assert_allclose(seen.silent[k], (blocks.status[of_blocks] == SILENT).mean(axis=0))
        assert_allclose(seen.rough[k, 2], blocks.u[of_samples, 2].reshape(width, -1).std(axis=1).mean())
        held = [blocks.y[b, 0] for b in range((k + 1) * width) if blocks.count[b, 0] > 0]
        if k == 120:  # nothing new: the last known speed
            assert_allclose(seen.speed[k, 0], held[-1])
    x, openings = blocks.u[: blocks.width, 0].mean() * WHEEL.K, blocks.u.reshape(-1, blocks.width, WHEELS).mean(axis=1)
    lagged = []
    for opening in openings[:, 0]:
        lagged.append(x)
        x += (1 - np.exp(-blocks.dt / WHEEL.tau)) * (WHEEL.K * opening - x)
    assert_allclose(seen.asked[:, 0], np.reshape(lagged, (-1, width)).mean(axis=1))
    assert not seen.asked[:, 1].any()


def test_valves_that_end_are_made_in_parts() -> None:
    _, blocks = mission(4007, ColumnStore(block=300))
    less = np.repeat(blocks.unseen, blocks.width, axis=0)
    assert blocks.unseen.any()
    assert blocks.ending().ended
    assert_array_equal(blocks.ending().u, blocks.u - less)
