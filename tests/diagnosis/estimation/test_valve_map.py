"""Maps of valves: the play of a spool and lagged ramps against naive twins, and openings that a linear valve would need."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.estimation.lag import low_passed
from diagnosis.estimation.valve_map import KNOTS, RAMPS, effective, lagged_ramps, played
from replay.machine.config import WheelPlant

DT = 0.01
Array = np.ndarray


def openings(n: int = 900) -> Array:
    """A drive back and forth through every ramp of the map, with noise that is less than a play."""
    t = np.arange(n) * DT
    x = np.sin(2 * np.pi * t / 4.0) * np.linspace(0.02, 1.1, n) + 0.003 * np.random.default_rng(1).normal(size=n)
    return np.asarray(x)


def naive_play(u: Array, width: float, spool: float) -> list[float]:
    """A spool that is pushed by whichever flank of its play touches it."""
    out = []
    for x in u:
        if x - spool > width / 2:
            spool = x - width / 2
        elif spool - x > width / 2:
            spool = x + width / 2
        out.append(spool)
    return out


@pytest.mark.parametrize("width", [0.005, 0.04, 3.0])
def test_spool_is_pushed_by_the_flanks_of_its_play(width: float) -> None:
    u = openings()
    got, held = played(u, width)
    assert_allclose(got, naive_play(u, width, u[0]), atol=1e-15)
    assert held == got[-1]
    assert np.abs(got - u).max() <= width / 2 + 1e-12
    from_elsewhere, _ = played(u, width, 0.5)
    assert_allclose(from_elsewhere, naive_play(u, width, 0.5), atol=1e-15)


def test_without_play_the_spool_is_where_it_is_sent() -> None:
    u = openings()
    got, held = played(u, 0.0)
    assert_array_equal(got, u)
    assert held == u[-1]
    gone = np.r_[0.1, np.nan, 0.2]
    assert_array_equal(played(gone, 0.0)[0], [0.1, 0.0, 0.2])
    assert_allclose(played(gone, 0.02)[0], [0.1, 0.01, 0.19])
    for width in (0.0, 0.02):
        nothing, where = played(np.empty(0), width, 0.3)
        assert nothing.size == 0
        assert where == 0.3


def test_parts_give_what_the_whole_gives() -> None:
    u = openings()
    whole, last = played(u, 0.03)
    first, held = played(u[:411], 0.03)
    second, end = played(u[411:], 0.03, held)
    assert_array_equal(np.r_[first, second], whole)
    assert end == last


@pytest.mark.parametrize("every", [1, 4])
def test_lagged_ramps_are_low_passed_ramps(every: int) -> None:
    u, tau = openings(), 0.12
    rows = -(-u.size // every)
    got = np.zeros((rows, RAMPS + 1))
    lagged_ramps(u, KNOTS, float(np.exp(-DT / tau)), every, got)
    half = KNOTS.size - 1
    for j in range(half):
        forward = np.clip(u, KNOTS[j], KNOTS[j + 1]) - KNOTS[j]
        reverse = -(np.clip(-u, KNOTS[j], KNOTS[j + 1]) - KNOTS[j])
        for column, ramp in ((j, forward), (half + j, reverse)):
            # low_passed starts at rest and answers a sample later; the ramps start where the opening stands
            settled = ramp[0]
            twin = settled + low_passed(ramp - settled, tau, DT)
            assert_allclose(got[1:, column], twin[::every][1:], atol=1e-12)
    assert_array_equal(got[:, RAMPS], 0.0)  # a column of another regressor is left alone


def test_ramps_add_up_to_the_opening() -> None:
    u = np.clip(openings(), -1.0, 1.0)
    out = np.zeros((u.size, RAMPS))
    lagged_ramps(u, KNOTS, 0.0, 1, out)  # no lag: one sample late
    assert_allclose(out.sum(axis=1)[1:], u[:-1], atol=1e-12)


MAPPED = WheelPlant(
    K=2.0,
    tau=0.2,
    openings=(-0.3, -0.02, 0.03, 0.08, 0.3),
    speeds=(-0.5, 0.0, 0.0, 0.15, 0.15),
    unseen=(-0.2, 0.0, 0.0, 0.0, 0.44),
)


def test_effective_opening_drives_a_linear_valve_alike() -> None:
    u = np.array([-0.5, -0.3, -0.02, 0.0, 0.02, 0.055, 0.08, 0.19, 0.3, 0.9])
    opening, unseen, held = effective(u, MAPPED)
    # the map ends in both directions, and is flat in its dead band
    assert_allclose(2.0 * opening, [-0.5, -0.5, 0.0, 0.0, 0.0, 0.075, 0.15, 0.15, 0.15, 0.15])
    assert_allclose(2.0 * unseen, [-0.2, -0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.22, 0.44, 0.44])
    assert held == 0.9
    assert_allclose(effective(np.array([np.nan]), MAPPED)[0], 0.0)


def test_effective_opening_is_that_of_the_spool() -> None:
    slack, u = replace(MAPPED, hysteresis=0.02), openings()
    opening, unseen, held = effective(u, slack, 0.07)
    spool, end = played(u, 0.02, 0.07)
    assert_allclose(opening, effective(spool, MAPPED)[0])
    assert_allclose(unseen, effective(spool, MAPPED)[1])
    assert held == end


def test_a_wheel_without_a_map_has_its_dead_zone_alone() -> None:
    u = np.array([-0.3, -0.01, 0.0, np.nan, 0.015, 0.2])
    opening, unseen, _ = effective(u, WheelPlant(K=2.4, tau=0.2, dead=0.01))
    assert_allclose(opening, [-0.29, 0.0, 0.0, 0.0, 0.005, 0.19])
    assert_array_equal(unseen, 0.0)


def test_a_map_without_unseen_is_known_throughout() -> None:
    known = WheelPlant(K=2.0, tau=0.2, openings=(-1.0, 1.0), speeds=(-2.0, 2.0))
    opening, unseen, _ = effective(np.array([-0.4, 0.7]), known)
    assert_allclose(opening, [-0.4, 0.7])
    assert_array_equal(unseen, 0.0)


def test_a_lag_stays_where_its_command_is_not_known() -> None:
    u = np.r_[np.nan, np.full(400, 0.5), np.full(60, np.nan), np.full(100, 0.5)]
    assert_allclose(low_passed(u, 0.1, 0.01), 0.5)
