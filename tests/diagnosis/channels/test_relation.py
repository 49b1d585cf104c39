"""Delay, lag, play and scale of a healthy channel are found beside faults."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.channels.relation import Relation, _Filled, _loss, relation_of, relations_of_kind, valves_of_kind

DT, N = 0.001, 60_000
Array = np.ndarray


def command(seed: int = 0) -> Array:
    t = np.arange(N) * DT
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.uniform(-0.5, 0.5, N // 1500), 1500)
    slow = np.convolve(steps, np.ones(400) / 400, mode="same")
    return np.asarray(slow + 0.1 * np.sin(2 * np.pi * t / 1.7))


def found(y: Array, x: Array, span: float, least: int = 0) -> Relation:
    use = np.isfinite(y)
    return relation_of(y, x, use, Relation(delay=0.0), DT, (least, 50), span)


def noisy(y: Array, std: float = 0.003) -> Array:
    return np.asarray(y + std * np.random.default_rng(7).normal(size=N))


@pytest.mark.parametrize("faulty", [False, True])
def test_spool_with_lag_and_hysteresis(faulty: bool) -> None:
    x, true = command(), Relation(delay=2.0, lag=0.03, play=0.02)
    y = true.expected(x, DT)
    if faulty:
        y[10_000:20_000] = 0.1
        y[35_000:45_000] *= 0.5
    relation = found(noisy(y), x, 1.0)
    assert relation.lag + relation.delay * DT == pytest.approx(0.032, abs=0.006)
    assert relation.play == pytest.approx(0.02, abs=0.005)
    healthy = np.r_[1000:9000, 21_000:34_000, 46_000:59_000]
    left = (relation.expected(x, DT) - true.expected(x, DT))[healthy]
    assert np.sqrt(np.nanmean(left**2)) < 0.003


def test_wire_has_neither() -> None:
    x = command()
    relation = relation_of(noisy(np.roll(x, 2)), x, np.ones(N, bool), Relation(delay=2.0), DT, (0, 50), 1.0)
    assert relation[:3] == (2.0, 0.0, 0.0)
    assert relation.gain == pytest.approx(1.0, abs=0.002)


def test_scale_of_a_second_sensor_but_no_loss_of_gain() -> None:
    x = command()
    assert found(noisy(1.006 * x), x, 0.0, -50).gain == pytest.approx(1.006, abs=0.001)
    assert found(noisy(0.8 * x), x, 0.0, -50).gain == 1.0


def test_scale_of_a_sensor_that_is_faulty_most_of_the_time() -> None:
    """Losses, and noise that stays for a second, leave the places alone by which the sound part is known."""
    x, random = 0.3 + 0.4 * command(), np.random.default_rng(2)
    slow = np.convolve(random.normal(size=N + 4000), np.exp(-np.arange(4000) / 800.0))[4000 : N + 4000] / 20.0
    y = 1.008 * x
    y[3_000:26_000] = (0.75 * y + 0.04 * slow - 0.01)[3_000:26_000]
    y[27_000:36_000] *= 0.9
    y[38_000:56_000] = (0.9 * y + 0.03 * slow)[38_000:56_000]
    assert found(noisy(y, 0.005), x, 0.0, -50).gain == pytest.approx(1.008, abs=0.004)


def test_expectation_is_the_lag_of_the_play() -> None:
    x = np.r_[np.zeros(100), np.ones(400)]
    y = Relation(delay=3.0, lag=0.05, play=0.2).expected(x, DT)
    assert_allclose(y[103 + 50], 0.9 * (1 - np.exp(-51 / 50)), rtol=1e-9)
    assert np.isnan(y[:3]).all()


def test_loss_is_the_mean_of_cauchys() -> None:
    rng = np.random.default_rng(3)
    x, at = rng.normal(size=500), np.arange(10, 490)
    x[200] = np.nan
    y = 1.1 * (0.7 * x[at - 2] + 0.3 * x[at - 3]) + rng.normal(size=at.size)
    y[7] = 1e60
    misfit = (y - 1.1 * (0.7 * x[at - 2] + 0.3 * x[at - 3])) / 1e-4
    mean = np.nanmean(np.log1p(misfit**2))
    assert_allclose(_loss(x, at, y, 2, 0.3, 1.1, 1e-4, np.inf), mean, rtol=1e-12)
    assert_allclose(_loss(x, at, y, 2, 0.3, 1.1, 1e-4, 1.001 * mean), mean, rtol=1e-12)
    assert _loss(x, at, y, 2, 0.3, 1.1, 1e-4, 0.5 * mean) == np.inf  # a trial before left less: the sum ends early


def test_channels_of_one_kind_are_as_late_as_most_of_them() -> None:
    found = [
        Relation(delay=3.0, gain=1.001),
        Relation(delay=-1.0, lag=0.004),
        Relation(delay=3.1),
        Relation(delay=9.0, gain=0.992),
    ]
    got = relations_of_kind(found, 0.001)
    assert got[:3] == found[:3]  # a delay and a lag may stand for each other
    assert got[3] == Relation(delay=got[3].delay, lag=got[3].lag, gain=0.992)
    assert got[3].delay + got[3].lag / 0.001 == pytest.approx(3.0, abs=0.15)
    scaled = [Relation(gain=g) for g in (1.002, 0.982, 0.999, 1.0)]
    assert [r.gain for r in relations_of_kind(scaled, 0.001)] == [1.002, 0.9995, 0.999, 1.0]
    apart = [Relation(delay=d) for d in (0.0, 3.0, 6.0, 9.0)]
    assert relations_of_kind(apart, 0.001) == apart  # nobody agrees
    assert relations_of_kind(found[2:], 0.001) == found[2:]  # too few


@pytest.mark.parametrize("lag", [0.1, 0.15])
def test_large_pilot_stages_lag_by_more(lag: float) -> None:
    x = command()
    relation = found(noisy(Relation(lag=lag).expected(x, DT)), x, 1.0)
    assert relation.lag + relation.delay * DT == pytest.approx(lag, rel=0.15)


@pytest.mark.parametrize(("seed", "kept", "share"), [(1, 0.75, 0.8), (2, 0.5, 0.8), (2, 0.64, 0.75)])
def test_a_loss_for_most_of_a_mission_gives_no_scale(seed: int, kept: float, share: float) -> None:
    x = command(seed)
    y, healthy = x.copy(), round(0.5 * (1.0 - share) * N)
    y[healthy : N - healthy] *= kept
    assert found(noisy(y), x, 0.0).gain == pytest.approx(1.0, abs=0.004)


def test_what_no_other_valve_has_of_scale_and_delay_is_a_faults() -> None:
    plain = [Relation(1.0, 0.0, 0.0, gain) for gain in (1.0, 0.998, 1.001)]
    lost = Relation(0.0, 0.0, 0.0, 0.985)
    assert valves_of_kind([*plain, lost], DT) == [*plain, Relation(1.0, 0.0, 0.0, 0.999)]
    slow = [
        Relation(1.0, lag, 0.02, gain) for lag, gain in ((0.03, 1.0), (0.034, 1.001), (0.026, 0.999), (0.03, 0.985))
    ]
    assert valves_of_kind(slow, DT) == [*slow[:3], slow[3]._replace(gain=0.9995)]
    assert valves_of_kind([lost, plain[0]], DT) == [lost, plain[0]]
    late = Relation(0.06 / DT)  # a disturbance looks like a delay where the others lag
    assert valves_of_kind([*slow[:3], late], DT)[3].lag in (0.026, 0.03, 0.034)


def test_nothing_settles_after_a_gap_of_the_reference() -> None:
    x = 1.0 + 0.1 * np.sin(np.arange(2000) * 0.005)
    known = x.copy()
    known[1000:1030] = np.nan
    follows = Relation(delay=2.0, lag=0.04, play=0.0, gain=1.0)
    whole, seen = follows.expected(x, 0.01), follows.expected(known, 0.01)
    assert np.isnan(seen[1002:1032]).all()
    assert seen[1032:] == pytest.approx(whole[1032:], abs=2e-3)


def test_lags_and_plays_that_are_tried_at_once_are_each_as_if_alone() -> None:
    x = np.cumsum(np.random.default_rng(8).normal(0.0, 0.1, 500))
    x[40:60] = np.nan
    ways = [(0.0, 0.0), (0.02, 0.0), (0.0, 0.3), (0.05, 0.1)]
    together = _Filled.of(x).followed(ways, 0.001)
    for (lag, play), found in zip(ways, together, strict=True):
        alone = Relation(lag=lag, play=play).expected(x, 0.001)
        assert np.array_equal(found, alone, equal_nan=True)
        held = y = float(x[0])
        for k in range(40):
            held = min(max(held, x[k] - play / 2), x[k] + play / 2)
            keep = float(np.exp(-0.001 / lag)) if lag else 0.0
            y = keep * y + (1.0 - keep) * held
            assert found[k] == y
