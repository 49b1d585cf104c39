"""What is measured redundantly, block by block: a second angle, and a valve that follows its command or does not."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, blocks_of
from diagnosis.steering.redundancy import with_second_angle, with_valve_opening
from diagnosis.steering.windows import windows_of

DT, SIZE, STUCK_AT, DELAY = 0.001, 20_000, 15_000, 2
ALWAYS = np.ones(SIZE, np.bool_)


def command_of(rng: np.random.Generator) -> np.ndarray:
    t = np.arange(SIZE) * DT
    return 0.05 * np.sin(2 * t) + rng.normal(0.0, 2e-3, SIZE)


def blocks(u: np.ndarray) -> SteeringBlocks:
    return blocks_of(np.zeros(SIZE), u, ALWAYS, ALWAYS, DT)


def test_nothing_is_redundant_before_it_is_added() -> None:
    assert not blocks(np.zeros(SIZE)).redundancy.known.any()


def test_a_valve_follows_its_command_until_it_sticks() -> None:
    rng = np.random.default_rng(3)
    u = command_of(rng)
    opening = np.r_[np.zeros(DELAY), u[:-DELAY]] + rng.normal(0.0, 2e-4, SIZE)
    opening[STUCK_AT:] = 0.01
    found, deviation = with_valve_opening(blocks(u), u, opening, ALWAYS, DT)
    redundancy, edge = found.redundancy, STUCK_AT // found.length
    healthy, stuck = slice(1, edge - 1), slice(edge + 1, -1)
    assert np.nanmedian(redundancy.share[healthy]) == pytest.approx(1.0, abs=0.02)
    assert np.nanmedian(redundancy.share[stuck]) == pytest.approx(0.0, abs=0.02)
    assert np.nanmax(np.abs(redundancy.opening - redundancy.command)[healthy]) < 1e-3
    assert redundancy.opening[stuck] == pytest.approx(0.01)
    assert np.isnan(redundancy.angle).all()
    assert np.nanmedian(np.abs(deviation[: STUCK_AT - 10])) < 2.0
    assert np.nanmedian(np.abs(deviation[STUCK_AT:])) > 10.0


def test_a_second_angle_has_at_least_the_variance_of_the_tolerance() -> None:
    rng = np.random.default_rng(4)
    t = np.arange(SIZE) * DT
    true = 0.2 * np.sin(t)
    y = true + rng.normal(0.0, 3e-4, SIZE)
    found = with_second_angle(blocks(np.zeros(SIZE)), y, true, ALWAYS, DT, tolerance=0.01).redundancy
    assert found.known.all()
    assert found.angle == pytest.approx(true.reshape(-1, 10).mean(axis=1), abs=2e-3)
    assert (found.angle_variance >= 1e-4).all()
    assert np.isnan(found.opening).all()


def test_a_valve_behind_a_lag_in_a_slow_log_follows_its_command() -> None:
    """The log holds every tenth sample: its command's jitter is not that of the controller, and the valve answers within 40 ms."""
    rng = np.random.default_rng(5)
    t = np.arange(10 * SIZE) * DT
    u = 0.2 * np.clip(np.sin(0.5 * t) * 4, -1, 1) + rng.normal(0.0, 4e-3, t.size)
    opening, keep = np.empty_like(u), np.exp(-DT / 0.04)
    y = 0.0
    for k, value in enumerate(u):
        y = keep * y + (1 - keep) * value
        opening[k] = y
    opening += rng.normal(0.0, 2e-3, t.size)
    u, opening = u[::10], opening[::10]
    found, _ = with_valve_opening(blocks_of(np.zeros(SIZE), u, ALWAYS, ALWAYS, 10 * DT), u, opening, ALWAYS, 10 * DT)
    r = found.redundancy
    apart = (r.opening - r.command)[5:] / np.sqrt(r.opening_variance[5:])
    assert np.isnan(r.share).all()
    assert np.nanquantile(np.abs(apart), 0.99) < 2.0
    assert np.nanmedian(np.sqrt(r.opening_variance)) < 0.01


def test_a_valve_that_lags_does_not_follow_jitter_at_once() -> None:
    """A controller that switches to and fro at the edge of a dead band, and a valve whose lag passes some of that on."""
    rng = np.random.default_rng(6)
    step, lag = 10 * DT, 0.06
    t = np.arange(SIZE) * step
    u = np.where(np.sin(0.8 * t) > 0.9, 0.7, 0.0) + 0.08 * (rng.random(SIZE) < 0.5)
    keep, opening = np.exp(-step / lag), np.empty_like(u)
    y = 0.0
    for k, value in enumerate(u):
        y = keep * y + (1 - keep) * value
        opening[k] = y
    opening += rng.normal(0.0, 1e-3, SIZE)
    found, _ = with_valve_opening(blocks_of(np.zeros(SIZE), u, ALWAYS, ALWAYS, step), u, opening, ALWAYS, step)
    apart = np.abs(found.redundancy.opening - found.redundancy.command)[5:]
    assert np.nanmax(apart) < 0.1


def test_a_loss_from_start_to_end_is_no_usual_difference() -> None:
    rng = np.random.default_rng(6)
    t = np.arange(SIZE) * DT
    u = 0.4 * np.sin(2 * t)
    found, _ = with_valve_opening(blocks(u), u, 0.2 * u + rng.normal(0.0, 2e-4, SIZE), ALWAYS, DT)
    seen = found.redundancy
    assert np.nanmax(np.sqrt(seen.opening_variance)) < 0.05
    assert np.nanmax(np.abs(seen.opening - seen.command)) > 0.25


def test_the_plant_is_found_by_what_a_valve_opens_where_it_does_not_obey() -> None:
    rng = np.random.default_rng(7)
    t = np.arange(SIZE) * DT
    u = 0.4 * np.sin(2 * t)
    for share in (0.2, 1.0):
        phi = 0.3 * np.cumsum(share * u) * DT + rng.normal(0.0, 3e-4, SIZE)
        cut = blocks_of(phi, u, ALWAYS, ALWAYS, DT)
        found, _ = with_valve_opening(cut, u, share * u + rng.normal(0.0, 2e-4, SIZE), ALWAYS, DT)
        windows = windows_of(found, SensorNoise(9e-8, 0.0, 0.0, 0.0), 1.0, 0.25)
        moving = windows.good & (np.abs(windows.opening) > 0.05 * share)
        assert np.count_nonzero(moving) > 10
        assert np.median(windows.rate[moving] / windows.opening[moving]) == pytest.approx(0.3, rel=0.05)
