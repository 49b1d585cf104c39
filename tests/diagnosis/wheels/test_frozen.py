"""A speed that stays at one value to the last digit, far longer than it ever does, is frozen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.channels.one_value import frozen_of
from diagnosis.results.alike import SHIFTED_SENTENCE
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.frozen import _step_of, with_frozen
from replay.faults import FaultMode, Side
from replay.machine.config import WheelPlant

DT, N, SPAN = 0.01, 6_000, 3.0
T = np.arange(N) * DT


def speeds(seed: int = 1) -> np.ndarray:
    """Four wheels that speed up and slow down, to 5 mm/s."""
    rng = np.random.default_rng(seed)
    v = 1.0 + 0.6 * np.sin(2 * np.pi * T / 15.0)[:, np.newaxis] + 0.004 * rng.standard_normal((N, 4))
    return np.asarray(np.round(v / 0.005) * 0.005)


PLANTS = [WheelPlant(2.0, 0.1, dead=0.01)] * 4


def data(y: np.ndarray, u: np.ndarray | None = None) -> Any:
    return SimpleNamespace(
        y=y,
        u=0.3 * y if u is None else u,
        plants=PLANTS,
        span=SPAN,
        dt=DT,
        measured=[False] * 4,
        names=[(f"wheel.{w}.v", "u") for w in "abcd"],
    )


def found(y: np.ndarray, *findings: Finding, u: np.ndarray | None = None) -> list[Finding]:
    """What is told of the first wheel."""
    before = {i: WheelFindings(findings=list(findings) if i == 0 else []) for i in range(4)}
    after = with_frozen(data(y, u), before)
    assert all(after[i].findings == [] for i in range(1, 4))
    return after[0].findings


def valve(start: int, stop: int) -> Finding:
    rows = (Hypothesis("actuator", FaultMode.STUCK, 0.9), Hypothesis("none", "healthy", 0.1))
    return Finding(start, stop, Side.ACTUATOR, FaultMode.STUCK, 0.9, rows, None, None, (), Tier.MODEL)


@pytest.mark.parametrize("spells", [1, 5])
def test_a_frozen_speed_is_told_as_the_sensors_whatever_a_model_says(spells: int) -> None:
    y, starts = speeds(), [100 + 750 * k for k in range(spells)]
    for start in starts:
        y[start : start + 300, 0] = 0.7
    told = found(y, valve(starts[0] + 10, starts[0] + 290), valve(5800, 5900))
    assert [(f.side, f.mode) for f in told[:-1]] == [(Side.SENSOR, FaultMode.STUCK)] * spells
    assert [f.start for f in told[:-1]] == starts
    assert told[-1].side is Side.ACTUATOR
    assert sum(h.p for h in told[0].hypotheses) == pytest.approx(1.0)


@pytest.mark.parametrize(("others", "count"), [((20,), 1), ((100,), 1), ((40, 60, 100), 0)])
def test_hardly_longer_than_its_habit_is_no_claim(others: tuple[int, ...], count: int) -> None:
    """A run of 3 s beside another of .2 s, one of 1 s, which may be frozen, too, and some of many lengths, which are how it reads."""
    y = speeds()
    y[100:400, 0] = 0.7
    for k, other in enumerate(others):
        y[3100 + 500 * k : 3100 + 500 * k + other, 0] = 0.9 + 0.05 * k
    told = found(y)
    assert sum(f.probability > 0.9 for f in told) == count


def test_a_frozen_sensor_is_not_off_by_a_constant_instead() -> None:
    y = speeds()
    y[2_000:2_300, 0] = y[2_000, 0]
    rows = tuple(Hypothesis("sensor", mode, p) for mode, p in ((FaultMode.STUCK, 0.58), (FaultMode.OUTSIDE_TABLE, 0.4)))
    said = (SHIFTED_SENTENCE, "It is seen.")
    halved = Finding(2_000, 2_300, Side.SENSOR, FaultMode.STUCK, 0.58, rows, None, None, said, Tier.SIGNAL)
    (one,) = found(y, halved)
    assert one.probability == pytest.approx(0.96)
    assert SHIFTED_SENTENCE not in one.evidence
    assert "It is seen." in one.evidence


def test_coarse_readings_at_a_steady_speed_are_a_habit() -> None:
    y = np.repeat(np.round((1.0 + 0.6 * np.sin(2 * np.pi * T[::100] / 15.0))[:, np.newaxis], 2), 100, axis=0)
    assert found(np.repeat(y, 4, axis=1)[:N]) == []


def test_a_speed_at_the_end_of_its_range_or_at_rest_is_not_frozen() -> None:
    y = speeds()
    y[:, 0] = np.minimum(y[:, 0], 1.3)
    y[2000:2400, 0] = 0.0
    assert found(y) == []


def test_where_all_are_held_the_log_is() -> None:
    y = speeds()
    y[2000:2400] = y[2000]
    assert found(y) == []


def test_where_nothing_else_moves_nothing_is_told() -> None:
    y = speeds()
    trembling = 0.005 * np.round(np.random.default_rng(2).standard_normal((400, 4)))
    y[2000:2400] = y[2000] + np.where(np.abs(trembling) > 0.006, 0.005, 0.0)
    y[2000:2400, 0] = 0.8
    assert found(y) == []


def test_where_all_others_tremble_by_more_than_a_step_one_value_is_a_sensor_that_froze() -> None:
    y = np.asarray(np.round(speeds() + 0.02 * np.random.default_rng(2).standard_normal((N, 4)), 3))
    y[2000:2400] = 1.0 + 0.02 * np.random.default_rng(3).standard_normal((400, 4))
    y[2000:2400, 0] = 1.01
    (told,) = found(np.asarray(np.round(y, 3)))
    assert (told.start, told.stop, told.side, told.probability) == (2000, 2400, Side.SENSOR, 0.96)


def test_beside_counts_that_go_to_and_fro_one_value_is_a_steady_speed() -> None:
    """Teeth in a window, in finer digits: what the others change by is a tooth."""
    y = speeds() + 0.012 * np.random.default_rng(2).standard_normal((N, 4))
    y[2000:2400] = 1.0 + 0.012 * np.random.default_rng(3).standard_normal((400, 4))
    y = 0.0234 * np.round(y / 0.0234)
    y[2000:2400, 0] = 0.0234 * 43
    assert found(np.asarray(np.round(y, 2))) == []


def test_a_sensor_that_is_frozen_for_the_whole_mission() -> None:
    y = speeds()
    y[:, 0] = 0.7
    assert [(r.start, r.stop) for r in frozen_of(y[:, 0], SPAN, DT)] == [(0, N)]
    assert found(y)[0].stop == N


def test_a_filter_that_comes_to_rest_at_counts_that_do_not_change_is_not_frozen() -> None:
    """Its changes become smaller and smaller; a sensor that freezes stops anywhere."""
    y = 1.0 + 0.01 * np.random.default_rng(4).standard_normal(N)
    y[2000:2400] = 0.94 + 0.05 * 0.5 ** np.minimum(np.arange(400), 30)
    assert frozen_of(y, SPAN, DT) == []
    y[1960:2400] = np.where(np.arange(440) < 30, y[1960:2400], 0.94)
    assert [(r.start, r.stop) for r in frozen_of(y, SPAN, DT)] == [(1990, 2400)]


def test_gaps_and_nothing() -> None:
    assert frozen_of(np.full(N, np.nan), SPAN, DT) == []
    assert frozen_of(np.zeros(0), SPAN, DT) == []


@pytest.mark.parametrize(("opening", "reading", "sure"), [(0.03, 0.0, False), (0.3, 0.0, True), (0.03, np.nan, True)])
def test_a_wheel_that_may_creep_below_what_its_sensor_reads_has_no_surely_dead_one(
    opening: float, reading: float, sure: bool
) -> None:
    """But one that gives no readings at all is dead, whatever its wheel does."""
    y = np.where(np.abs(moving := speeds() - 0.9) < 0.05, 0.0, moving)
    u = 0.3 * y
    y[2000:2600, 0], u[2000:2600, 0] = reading, opening
    rows = (Hypothesis("sensor", FaultMode.NO_SIGNAL, 0.95), Hypothesis("none", "healthy", 0.05))
    dead = Finding(2000, 2600, Side.SENSOR, FaultMode.NO_SIGNAL, 0.95, rows, None, None, (), Tier.MODEL)
    told = with_frozen(data(y, u), {0: WheelFindings(findings=[dead])})[0].findings
    assert (told[0].probability > 0.9) is sure


def test_a_speed_that_stays_as_all_others_do_is_hardly_stuck() -> None:
    y = np.round(speeds() * 0.0 + 0.34, 3)
    y[:2000], y[2600:] = speeds()[:2000], speeds()[2600:]
    rows = (Hypothesis("sensor", FaultMode.STUCK, 0.9), Hypothesis("none", "healthy", 0.1))
    stuck = Finding(2000, 2600, Side.SENSOR, FaultMode.STUCK, 0.9, rows, None, None, (), Tier.MODEL)
    (told,) = found(y, stuck)
    assert told.probability < 0.5
    y[2000:2600, 0] = 0.6  # it alone reads something else
    assert found(y, stuck)[0].probability == pytest.approx(0.9)


def silent(start: int, stop: int = 2600) -> Finding:
    rows = (Hypothesis("sensor", FaultMode.NO_SIGNAL, 0.95), Hypothesis("none", "healthy", 0.05))
    return Finding(start, stop, Side.SENSOR, FaultMode.NO_SIGNAL, 0.95, rows, None, None, (), Tier.MODEL)


@pytest.mark.parametrize(("falls", "side"), [(1, Side.SENSOR), (12, Side.SENSOR_OR_ACTUATOR)])
def test_a_wheel_that_slows_down_before_it_reads_zero_may_be_held(falls: int, side: Side) -> None:
    """A dead sensor's reading is cut off; what reads zero ever since is told alike."""
    y = speeds()
    y[2000:3500, 0] = 0.0
    y[2000 - falls : 2000, 0] *= np.linspace(1.0, 0.0, falls + 2)[1:-1] if falls > 1 else 1.0
    first, since = found(y, silent(1998), silent(3000, 3500), u=np.full_like(y, 0.9))
    assert (first.side, since.side) == (side, side)
    assert sum(h.p for h in first.hypotheses) == pytest.approx(1.0)
    assert (first.probability > 0.9) is (side is Side.SENSOR)


def test_where_the_machine_stands_a_constant_is_no_stuck_sensor_alone() -> None:
    """One that is off by a constant reads the same."""
    y = np.round(speeds(), 3)
    y[2000:2600] = 0.0
    y[2000:2600, 0] = 0.5
    rows = (Hypothesis("sensor", FaultMode.STUCK, 0.9), Hypothesis("none", "healthy", 0.1))
    stuck = Finding(2000, 2600, Side.SENSOR, FaultMode.STUCK, 0.9, rows, None, None, (), Tier.MODEL)
    (told,) = found(y, stuck, u=0.0 * y)
    assert told.probability < 0.6
    assert {(h.side, h.mode) for h in told.hypotheses} >= {("sensor", "outside_table")}


@pytest.mark.parametrize(("step", "sure"), [(0.1, False), (0.001, True)])
def test_a_coarse_reading_that_goes_on_at_one_speed_is_hardly_stuck(step: float, *, sure: bool) -> None:
    """Of a fine one, only a dead sensor's reading stays."""
    slow = 1.0 + 0.6 * np.sin(2 * np.pi * T / 30.0)
    slow[1900:2600] = slow[1900]
    noise = 0.004 * np.random.default_rng(1).standard_normal((N, 4))
    y = np.round((slow[:, np.newaxis] * np.array([1.0, 0.7, 0.75, 0.72]) + noise) / step) * step
    y[2000:2600, 0] = y[1999, 0]
    rows = (Hypothesis("sensor", FaultMode.STUCK, 0.9), Hypothesis("none", "healthy", 0.1))
    stuck = Finding(2000, 2600, Side.SENSOR, FaultMode.STUCK, 0.9, rows, None, None, (), Tier.MODEL)
    u = 0.3 * np.broadcast_to(slow[:, np.newaxis], y.shape)
    before = {i: WheelFindings(findings=[stuck] if i == 0 else []) for i in range(4)}
    told = with_frozen(data(y, np.array(u)), before)[0].findings
    assert any(f.probability > 0.8 for f in told) is sure


def test_times_that_are_counted_are_coarse_at_speed_alone() -> None:
    """The tick is the same, the step of the speed grows with its square: slow readings of a log say nothing of quick ones."""
    slow = 0.3 + 0.2 * np.sin(2 * np.pi * T / 30.0)
    slow[1000:1100], slow[1990:2600] = 1.9, 2.1
    noise = 0.002 * np.random.default_rng(1).standard_normal((N, 4))
    v = slow[:, np.newaxis] * np.array([1.0, 0.93, 0.93, 0.93]) + noise
    y = 15.0 / np.round(15.0 / v)
    rows = (Hypothesis("sensor", FaultMode.STUCK, 0.9), Hypothesis("none", "healthy", 0.1))
    stuck = Finding(2000, 2600, Side.SENSOR, FaultMode.STUCK, 0.9, rows, None, None, (), Tier.MODEL)
    before = {i: WheelFindings(findings=[stuck] if i == 0 else []) for i in range(4)}
    told = with_frozen(data(y, 0.3 * np.broadcast_to(slow[:, np.newaxis], y.shape).copy()), before)[0].findings
    assert all(f.probability < 0.5 for f in told)


def test_a_sensor_that_freezes_again_and_again_makes_no_habit_of_it() -> None:
    y = speeds()
    for k in range(5):
        y[500 + 1_000 * k : 700 + 1_000 * k, 0] = y[500 + 1_000 * k, 0] + 0.005 * k
    runs = frozen_of(y[:, 0], SPAN, DT)
    assert [r.start for r in runs] == [pytest.approx(500 + 1_000 * k, abs=2) for k in range(5)]
    assert max(r.usual_s for r in runs) < 0.3


@pytest.mark.parametrize(("again", "frozen"), [(True, False), (False, True)])
def test_a_sensor_that_comes_back_to_the_values_at_which_it_stays_reads_in_steps(*, again: bool, frozen: bool) -> None:
    """Teeth that are counted make holds of the same few values; one that freezes again and again holds another value each time."""
    rng = np.random.default_rng(7)
    holds = [0.1, 0.2, 0.1, 0.3, 0.2] if again else [0.11, 0.23, 0.14, 0.32, 0.21]
    y = np.concatenate(
        [piece for v in holds for piece in (np.full(round(1.5 / DT), v), rng.normal(v, 0.01, round(1.0 / DT)))]
    )
    y = np.concatenate([y, np.full(round(1.6 / DT), 0.25), rng.normal(0.25, 0.01, round(1.0 / DT)), np.full(9, 0.35)])
    last = [r for r in frozen_of(y, SPAN, DT) if r.value == 0.25]
    assert bool(last) is frozen


def test_how_a_fraction_was_rounded_is_no_step() -> None:
    counts = np.round(np.linspace(1.0, 3.0, 200) / 0.015) * 0.015
    dither = 1e-8 * np.random.default_rng(1).standard_normal(200)
    assert _step_of(counts + dither) > 0.001
