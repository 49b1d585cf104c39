"""What a simple cause explains wherever it deviates is no noise, and noise stays noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.estimation.by_itself import causes_where_off, told_by_itself
from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]
DT, SIZE = 0.02, 2000
T = np.arange(SIZE) * DT
X = 0.5 + 0.2 * np.sin(0.7 * T)
NOISE = 0.003
SPELLS = ((5.0, 8.0), (15.0, 18.0), (25.0, 28.0))


def noisy(start: float = 4.0, stop: float = 30.0) -> Finding:
    """A finding of noise over some seconds."""
    row = (Hypothesis("actuator", "noisy", 0.96), Hypothesis("actuator", "stuck", 0.04))
    ends = round(start / DT), round(stop / DT)
    return Finding(*ends, Side.ACTUATOR, FaultMode.NOISY, 0.96, row, None, None, (), Tier.DIRECT)


def measured(change: Callable[[Array], Array]) -> Measured:
    y = change(X) + NOISE * np.random.default_rng(3).standard_normal(SIZE)
    return Measured(y, X, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", NOISE, 0.02, 0.1)


def in_spells(of: Callable[[Array, Array], Array]) -> Callable[[Array], Array]:
    """A change in each of the spells: of the seconds since its beginning, and of the reference."""

    def change(x: Array) -> Array:
        for start, stop in SPELLS:
            x = np.where((start <= T) & (stop > T), of(T - start, x), x)
        return x

    return change


@pytest.mark.parametrize(
    ("change", "mode"),
    [
        (lambda t, x: (1.0 - 0.2 * t) * x, FaultMode.INEFFICIENT),
        (lambda t, x: (1.0 + 0.15 * t) * x, FaultMode.OUTSIDE_TABLE),
        (lambda t, x: x + 0.12, FaultMode.OUTSIDE_TABLE),
    ],
    ids=["fades", "grows", "offset"],
)
def test_spells_between_health_are_told_one_by_one(change: Callable[[Array, Array], Array], mode: FaultMode) -> None:
    found = told_by_itself(noisy(), measured(in_spells(change)))
    assert [f.mode for f in found] == [mode] * len(SPELLS)
    for f, (start, stop) in zip(found, SPELLS, strict=True):
        assert f.start * DT == pytest.approx(start, abs=0.8)
        assert f.stop * DT == pytest.approx(stop, abs=0.2)
        assert sum(h.p for h in f.hypotheses) == pytest.approx(1.0)


@pytest.mark.parametrize("tau", [0.0, 0.05, 0.8])
def test_noise_of_any_colour_stays_noise(tau: float) -> None:
    rng = np.random.default_rng(8)
    walk, keeps = np.zeros(SIZE), np.exp(-DT / tau) if tau else 0.0
    for k in range(1, SIZE):
        walk[k] = keeps * walk[k - 1] + np.sqrt(1.0 - keeps**2) * rng.standard_normal()
    own = noisy()
    assert told_by_itself(own, measured(lambda x: 0.6 * x + 0.08 * walk)) == [own]


def test_a_loss_below_the_limit_is_no_fault() -> None:
    assert told_by_itself(noisy(), measured(in_spells(lambda t, x: 0.94 * x))) == []


def test_a_channel_that_stays_is_no_loss() -> None:
    own = noisy(5.0, 8.0)
    assert told_by_itself(own, measured(in_spells(lambda t, x: 0.0 * x))) == [own]


def test_what_hardly_deviates_is_left_out() -> None:
    off = in_spells(lambda t, x: x + 0.03)
    assert causes_where_off(noisy(), measured(off), 0.05)[0] == []
    assert len(causes_where_off(noisy(), measured(off), 0.02)[0]) == len(SPELLS)


@pytest.mark.parametrize("mode", [FaultMode.STUCK, FaultMode.INEFFICIENT])
def test_other_rows_stay(mode: FaultMode) -> None:
    own = noisy()
    own = Finding(own.start, own.stop, own.side, mode, 0.9, own.hypotheses, None, None, (), Tier.DIRECT)
    assert told_by_itself(own, measured(in_spells(lambda t, x: x + 0.12))) == [own]


@pytest.mark.parametrize(("last", "told"), [(1.08, False), (1.25, True), (0.93, False), (0.8, True)])
def test_a_gain_that_changes_counts_by_its_ends(last: float, *, told: bool) -> None:
    """From 1.0 on within 3 s; 0.1 counts."""
    channel = measured(in_spells(lambda t, x: (1.0 + (last - 1.0) * np.minimum(t / 3.0, 1.0)) * x))
    found, _ = causes_where_off(noisy(), channel)
    assert bool(found) is told


@pytest.mark.parametrize(("offset", "told"), [(0.031, False), (0.08, True)])
def test_what_a_stretch_is_off_by_is_what_it_usually_is(offset: float, *, told: bool) -> None:
    """Moves that come late make one reading in twenty-five large."""
    late = np.where(np.arange(SIZE) % 25 == 0, 0.2, 0.0)
    channel = measured(in_spells(lambda t, x: x + offset + late))
    found, _ = causes_where_off(noisy(), channel, 0.05)
    assert bool(found) is told
