"""Models that are not followed where the next block enters them again change nothing: held against a recursion that follows all."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from diagnosis.channels.sample_status import PAIR, SILENT, SKIP
from diagnosis.estimation.back_pointers import STAY
from diagnosis.steering import path_kernel
from diagnosis.steering.filter_constants import FilterConstants
from diagnosis.steering.filter_state import Array, Block, BlockSeries, FilterBank, Redundancy, RedundantBlock
from diagnosis.steering.model_bank import HEALTHY, MODELS, NO_SIGNAL, NOISY, SENSOR, STUCK
from diagnosis.steering.models import model_of
from diagnosis.steering.path import AxleFilter, allowed_models, start_states
from diagnosis.steering.step_kernel import enter
from diagnosis.steering.waiting_kernel import learning_cost, most_gained, switch_cost
from replay.arrays.compiling import njit
from tests.diagnosis.steering.kernels import advance
from tests.diagnosis.steering.test_path import DT, PLANT, SensorNoise, blocks_of, driven_by

SECONDS = 16.0


def steered(seed: int, *, redundant: bool) -> tuple[AxleFilter, BlockSeries]:
    """An axle whose sensor goes through every row, with samples that are missing and openings that nobody knows."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, SECONDS, DT)
    u = 0.06 * np.sin(1.5 * t + seed)
    valve = np.where((t > 13.0) & (t < 14.0), 0.0, u)
    phi, rate = np.zeros(t.size), 0.0
    for k in range(1, t.size):
        rate += DT / PLANT.lag * (PLANT.gain * valve[k] - rate)
        phi[k] = phi[k - 1] + DT * rate
    y = phi + rng.normal(0.0, 5e-4, t.size)
    for first, kind in ((2.0, "stuck"), (4.0, "none"), (6.0, "half"), (8.0, "noisy")):
        part = (t >= first) & (t < first + 1.0)
        values = {"stuck": y[part][0], "none": 0.0, "half": 0.5 * y[part], "noisy": 0.65 * y[part]}[kind]
        y[part] = values + (rng.normal(0.0, 0.03, part.sum()) if kind == "noisy" else 0.0)
    always = np.ones(t.size, np.bool_)
    blocks = blocks_of(y, u, always, always, DT)
    noise = SensorNoise(white=2.5e-7, spread=0.01, step=0.0, lsb=0.0)
    model = model_of(blocks, PLANT, noise, stop=0.785)
    axle = AxleFilter(
        blocks,
        driven_by(PLANT, blocks),
        model,
        allowed_models(sensor=True, actuator=True, redundant=redundant),
        ("phi", "u"),
    )
    series = axle.series
    status, driven = series.status.copy(), series.driven.copy()
    status[300:310], status[1000:1030], driven[1200:1240] = SKIP, SILENT, np.nan
    size, known = status.size, Redundancy.nothing(status.size)
    if redundant:
        place = np.minimum(np.arange(size) * blocks.length, t.size - 1)
        known = known._replace(
            angle=phi[place] + rng.normal(0.0, 1e-3, size),
            angle_variance=np.full(size, 1e-6),
            opening=valve[place] + rng.normal(0.0, 1e-3, size),
            opening_variance=np.full(size, 1e-6),
            command=series.u.copy(),
        )
    return axle, series._replace(status=status, driven=driven, redundancy=known)


@njit
def followed(
    series: BlockSeries,
    allowed: np.ndarray,
    constants: FilterConstants,
    score: Array,
    bank: FilterBank,
    back: np.ndarray,
    most: Array,
) -> None:
    """All models over all blocks; `most` (n, models) becomes by how much each new one gained less than it might have at most."""
    for k in range(series.mean.size):
        best = int(np.argmax(score))
        top = score[best]
        if series.status[k] != SKIP:
            for m in range(MODELS):
                if m != best and allowed[m]:
                    cost = switch_cost(m, best, constants)
                    if top - cost - learning_cost(m) > score[m]:
                        score[m], back[k, m] = top - cost, best
                        enter(m, best, constants, bank)
        block = Block(
            series.mean[k],
            series.power[k],
            series.samples[k],
            series.driven[k],
            series.spread[k],
            series.u[k],
            series.pace[k],
            series.status[k],
        )
        known = series.redundancy
        seen = RedundantBlock(
            known.angle[k],
            known.angle_variance[k],
            known.opening[k],
            known.opening_variance[k],
            known.share[k],
            known.share_variance[k],
            known.command[k],
        )
        for m in range(MODELS):
            if allowed[m]:
                new = back[k, m] != STAY and SENSOR[m] != SENSOR[best] and series.status[k] == PAIR
                bound = most_gained(m, block, constants, bank) if new and not np.isnan(block.driven) else np.nan
                gain = advance(m, block, seen, constants, bank)
                score[m] += gain
                most[k, m] = bound - gain
        score -= score[allowed].max()


@pytest.mark.parametrize("redundant", [False, True], ids=["angle alone", "measured twice"])
@pytest.mark.parametrize("seed", range(3))
def test_nothing_differs(seed: int, redundant: bool) -> None:
    axle, series = steered(seed, redundant=redundant)
    constants = axle.constants._replace(redundant=redundant)
    results = []
    most = np.full((series.mean.size, MODELS), np.nan)
    for whole in (False, True):
        score, bank = start_states(axle.first_angle, constants)
        score[~axle.allowed] = -1e12
        back = np.full((series.mean.size, MODELS), STAY, np.uint8)
        if whole:
            followed(series, axle.allowed, constants, score, bank, back, most)
        else:
            path_kernel.scan(series, axle.allowed, constants, score, bank, back)
        results.append((back, score[axle.allowed], *(x[axle.allowed] for x in bank[:4])))
    for a, b in zip(*results, strict=True):
        assert_array_equal(a, b)
    back = results[0][0]
    assert (back[:, axle.allowed] != STAY).mean() > 0.3  # it is worth while
    for s in (STUCK, NO_SIGNAL, NOISY):
        told = most[:, s == SENSOR]
        assert np.isfinite(told).any()
        assert np.nanmin(told) >= -1e-6
    assert SENSOR[int(np.argmax(results[0][1]))] == HEALTHY
