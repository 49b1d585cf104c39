"""Blocks of samples against a loop over them: means, steps, openings and status, with gaps, silence and slow logs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.channels.sample_status import PAIR, SILENT, SKIP
from diagnosis.wheels.blocks import WheelBlocks, block_width, blocks_of, per_sample
from replay.arrays.column_store import ColumnStore
from replay.machine.config import WheelPlant

WHEELS = 3
Array = np.ndarray


def recorded(size: int, every: int = 1, seed: int = 1) -> tuple[Array, Array, Array, Array]:
    """Speeds, openings, status and quiet: one wheel with gaps and unknown openings, one that falls silent."""
    rng = np.random.default_rng(seed)
    y = 0.2 + 0.01 * rng.normal(size=(size, WHEELS)).cumsum(axis=0)
    u = 0.1 * np.sin(np.arange(size)[:, None] / 20 + np.arange(WHEELS)) + 0.01 * rng.normal(size=(size, WHEELS))
    status = np.full((size, WHEELS), SKIP, dtype=np.int8)
    status[::every] = PAIR
    status[rng.random(size) < 0.15, 1] = SKIP
    status[size // 4 : size // 2, 1] = SKIP
    u[size // 3 : size // 3 + 7, 1] = np.nan
    status[size // 2 + 3 : size // 2 + 38, 2] = SILENT
    y[status != PAIR] = np.nan
    quiet = np.zeros((size, WHEELS), dtype=np.bool_)
    quiet[15:47, 0] = True
    return y, u, status, quiet


def cut(
    y: Array, u: Array, status: Array, quiet: Array, dt: float, plants: Sequence[WheelPlant | None] = ()
) -> WheelBlocks:
    size = y.shape[0]
    ratio = np.linspace(0.9, 1.1, size)[:, None] * np.ones(WHEELS)
    turn = np.linspace(0.0, 0.02, size)[:, None] * np.arange(WHEELS)
    return blocks_of(y, u, status, quiet, ratio, turn, plants or [WheelPlant(1.0, 0.1, dead=0.01)] * WHEELS, dt)


def held(u: Array) -> Array:
    """An opening [fraction], shape (n,), with the last known one where it is not known."""
    out = [0.0]
    for x in u:
        out.append(out[-1] if np.isnan(x) else float(x))
    return np.array(out[1:])


def naive(y: Array, u: Array, status: Array, width: int, i: int) -> list[tuple[Any, ...]]:
    """Mean, count, mean squared step, status and unsteadiness of every block of wheel i."""
    places = [k for k in range(y.shape[0]) if status[k, i] == PAIR]
    usual = np.median(np.diff(places))
    before = {k: j for j, k in pairwise(places)}
    out = []
    for first in range(0, y.shape[0], width):
        block = range(first, min(first + width, y.shape[0]))
        new = [k for k in block if status[k, i] == PAIR]
        steps = [(y[k, i] - y[before[k], i]) ** 2 for k in new if k in before and k - before[k] <= 1.5 * usual]
        silent = sum(status[k, i] == SILENT for k in block) > 0.5 * width
        given = held(u[:, i])
        x = [np.sign(given[k]) * max(abs(given[k]) - 0.01, 0.0) for k in block]
        x += [x[-1]] * (width - len(x))
        out.append(
            (
                np.mean([y[k, i] for k in new]) if new else 0.0,
                len(new),
                np.mean(steps) if steps else 0.0,
                PAIR if new else SILENT if silent else SKIP,
                np.std(x),
            )
        )
    return out


# a kHz log; a sensor of 200 Hz in it; 400 and 200 Hz; all with a last block that is not whole, but for the second
@pytest.mark.parametrize(("rate", "every", "size"), [(1000, 1, 403), (1000, 5, 400), (400, 1, 401), (200, 1, 301)])
def test_blocks_are_what_a_loop_finds(rate: int, every: int, size: int) -> None:
    y, u, status, quiet = recorded(size, every)
    got = cut(y, u, status, quiet, 1 / rate)
    width = rate // 100
    assert got.width == width
    assert got.dt == pytest.approx(0.01)
    assert got.y.shape == (-(-size // width), WHEELS)
    for i in range(WHEELS):
        mean, count, jitter, state, unsteady = (np.array(x) for x in zip(*naive(y, u, status, width, i), strict=True))
        assert_allclose(got.y[:, i], mean, atol=1e-13)
        assert_array_equal(got.count[:, i], count)
        assert_allclose(got.jitter[:, i], jitter, atol=1e-14)
        assert_array_equal(got.status[:, i], state)
        if width >= 4:
            assert_allclose(got.unsteady[:, i], unsteady, atol=1e-13)
        else:
            assert (got.unsteady[:, i] >= unsteady - 1e-13).all()
    assert {SKIP, PAIR, SILENT} == set(got.status.ravel().tolist())


def test_places_without_a_sample_say_nothing() -> None:
    y, u, status, quiet = recorded(403)
    got = cut(y, u, status, quiet, 0.001)
    for x in (got.y, got.count, got.jitter, got.u, got.unsteady):
        assert np.isfinite(x).all()
    assert_array_equal(got.y[got.count == 0], 0.0)
    assert_array_equal(got.jitter[got.count == 0], 0.0)
    # an opening that is not known is the last known one, one within the dead zone none; the rest of the last block is held
    given = np.column_stack([held(column) for column in u.T])
    beyond = np.sign(given) * np.maximum(np.abs(given) - 0.01, 0.0)
    assert_allclose(got.u[:403], beyond)
    assert_allclose(got.u[403:], np.repeat(got.u[402:403], 7, axis=0))
    # quiet is a block that is so throughout
    assert_array_equal(np.flatnonzero(got.quiet[:, 0]), [2, 3])
    assert_allclose(got.ratio[:40], np.linspace(0.9, 1.1, 403)[:400].reshape(40, 10).mean(axis=1)[:, None] * [1, 1, 1])
    assert_allclose(got.turn[-1, 2], 2 * np.r_[np.linspace(0.0, 0.02, 403)[400:], np.full(7, 0.02)].mean())


def test_slow_logs_have_blocks_of_one_sample() -> None:
    assert [block_width(1 / rate) for rate in (1000, 500, 250, 100, 50, 20)] == [10, 5, 2, 1, 1, 1]
    y, u, status, quiet = recorded(120)
    got = cut(y, u, status, quiet, 0.02)
    pair = status == PAIR
    assert got.dt == 0.02
    assert_array_equal(got.status, status)
    assert_allclose(got.y[pair], y[pair])
    assert_array_equal(got.count, pair)
    follows = np.r_[False, pair[1:, 0] & pair[:-1, 0]]
    assert_allclose(got.jitter[follows, 0], np.diff(y[:, 0], prepend=np.nan)[follows] ** 2)


def test_slow_logs_say_how_far_openings_wander_unseen() -> None:
    size = 200
    y, _, status, quiet = recorded(size)
    steady, chatter = np.full((size, WHEELS), 0.1), 0.1 + 0.05 * (-1.0) ** np.arange(size)[:, None] * np.ones(WHEELS)
    per_opening = np.array([0.1, 0.2, 0.3])
    for u, least, most in ((steady, 0.0, 1e-12), (chatter, 0.02, 0.1)):
        slow = cut(y, u, status, quiet, 0.02)
        middle = slow.unsteady[20:-20]
        assert middle.min() >= least
        assert middle.max() <= most
        assert_allclose(slow.wander(per_opening), slow.unsteady * per_opening)
    quick = cut(y, chatter, status, quiet, 0.001)
    assert_allclose(quick.unsteady, 0.05)
    assert_array_equal(quick.wander(per_opening), 0.0)  # every change is in the log


def test_nothing_but_silence() -> None:
    status = np.full((95, WHEELS), SILENT, dtype=np.int8)
    nothing = np.full((95, WHEELS), np.nan)
    got = cut(nothing, nothing, status, np.ones((95, WHEELS), dtype=np.bool_), 0.001)
    assert_array_equal(got.status[:9], SILENT)
    assert_array_equal(got.status[9], SKIP)  # half a block is not enough to say so
    assert_array_equal(got.y, 0.0)
    assert_array_equal(got.u, 0.0)
    assert got.quiet.all()


def test_part_and_spread() -> None:
    y, u, status, quiet = recorded(403)
    got = cut(y, u, status, quiet, 0.001)
    part = got.part(10, 41)
    assert part.y.shape[0] == 31
    for name in ("y", "count", "jitter", "unseen", "unsteady", "status", "quiet", "ratio", "turn"):
        assert_array_equal(getattr(part, name), getattr(got, name)[10:41], err_msg=name)
    assert_array_equal(part.u, got.u[100:410])
    assert part.u.flags.c_contiguous
    whole = got.part(20, 999)
    assert whole.u.shape[0] == 10 * whole.y.shape[0]
    assert_array_equal(per_sample(np.array([1, 2, 3]), 4, 10), [1, 1, 1, 1, 2, 2, 2, 2, 3, 3])


MAPPED = WheelPlant(
    K=2.0,
    tau=0.2,
    openings=(-0.3, -0.02, 0.03, 0.08, 0.3),
    speeds=(-0.5, 0.0, 0.0, 0.15, 0.15),
    unseen=(-0.2, 0.0, 0.0, 0.0, 0.44),
    hysteresis=0.02,
)


def test_openings_are_what_the_valves_make_of_them() -> None:
    """Play, map and what nobody has seen beyond it, sample by sample; a wheel without a plant has its opening as it is."""
    y, u, status, quiet = recorded(403)
    got = cut(y, u, status, quiet, 0.001, [MAPPED, None, MAPPED])
    for i in (0, 2):
        spool, opening, unseen = u[0, i], [], []
        for x in held(u[:, i]):
            spool = min(max(spool, x - 0.01), x + 0.01)
            opening.append(np.interp(spool, MAPPED.openings, MAPPED.speeds) / 2.0)
            unseen.append(np.interp(spool, MAPPED.openings, MAPPED.unseen) / 2.0)
        most = np.array(opening) + unseen
        assert_allclose(got.u[:403, i], most, atol=1e-13)
        blockwise = np.pad(unseen, (0, 7), mode="edge").reshape(-1, 10).mean(axis=1)
        assert_allclose(got.unseen[:, i], blockwise, atol=1e-13)
        assert (blockwise > 0).any()
        ended = got.ending()
        assert ended.ended
        assert_allclose(ended.u[:, i], got.u[:, i] - np.repeat(blockwise, 10), atol=1e-13)
    assert_allclose(got.u[:403, 1], held(u[:, 1]))
    assert_array_equal(got.unseen[:, 1], 0.0)
    assert not got.ended
    assert ended.part(3, 9).ended


def test_parts_of_a_long_mission_change_nothing_of_a_spool() -> None:
    y, u, status, quiet = recorded(403)
    ones = np.ones((403, WHEELS))
    whole, parts = (
        blocks_of(y, u, status, quiet, ones, ones, [MAPPED] * WHEELS, 0.001, ColumnStore(block=block))
        for block in (10_000, 50)
    )
    for name in ("u", "unseen", "y", "jitter"):
        assert_array_equal(getattr(parts, name), getattr(whole, name), err_msg=name)
