"""Pieces of one fault are joined where one simple cause explains them together, and nowhere else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.estimation.lag import low_passed
from diagnosis.estimation.one_cause import _fading, with_one_cause
from diagnosis.estimation.simple_causes import Cause, Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]
DT, SIZE = 0.01, 4000
T = np.arange(SIZE) * DT
X = 0.4 * np.sin(0.9 * T) + 0.15 * np.sin(2.3 * T + 1.0)
RNG = np.random.default_rng(5)
NOISE = 0.004
PIECES = ((1000, 1200, FaultMode.STUCK), (1200, 1900, FaultMode.NOISY), (1950, 2400, FaultMode.INEFFICIENT))


def pieces(spans: Sequence[tuple[int, int, FaultMode]] = PIECES) -> list[Finding]:
    """Findings of one sensor, one after the other."""
    return [
        Finding(a, b, Side.SENSOR, mode, 0.99, (Hypothesis("sensor", mode, 0.99),), None, None, (), Tier.DIRECT, a + 5)
        for a, b, mode in spans
    ]


def measured(change: Callable[[Array], Array]) -> Measured:
    y = change(X) + NOISE * RNG.standard_normal(SIZE)
    return Measured(y, X, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", NOISE, 0.02)


def test_pieces_with_a_healthy_second_between_them_are_not_joined() -> None:
    apart = pieces(((1000, 1400, FaultMode.STUCK), (1500, 1600, FaultMode.NOISY), (1900, 2100, FaultMode.NOISY)))
    where = (T >= 10.0) & (T < 16.0)
    found = with_one_cause(apart, measured(lambda x: x + 0.08 * (where | (T >= 19.0))))
    assert [(f.start, f.stop) for f in found] == [(1000, 1600), (1900, 2100)]
    assert "0.08" in found[0].evidence[0]


@pytest.mark.parametrize(
    ("change", "mode", "words"),
    [
        (lambda x: x + 0.08, FaultMode.OUTSIDE_TABLE, "0.08 {speed_unit} more than b all through it"),
        (lambda x: np.interp(T - 0.4, T, x), FaultMode.OUTSIDE_TABLE, "400 ms after b: a delay"),
        (lambda x: low_passed(x, 0.8, T[1] - T[0]), FaultMode.OUTSIDE_TABLE, "a time constant of 0.75 s: a lag"),
        (lambda x: 1.35 * x, FaultMode.OUTSIDE_TABLE, "1.35 of b"),
        (lambda x: 0.6 * x, FaultMode.INEFFICIENT, "0.60 of b"),
        (lambda x: (1.0 - 0.6 * (T - 10.0) / 14.0) * x, FaultMode.INEFFICIENT, "at first and"),
    ],
    ids=["offset", "delay", "lag", "too much", "loss", "fading"],
)
def test_one_cause_joins_its_pieces(change: Callable[[Array], Array], mode: FaultMode, words: str) -> None:
    (found,) = with_one_cause(pieces(), measured(change))
    assert (found.start, found.stop, found.mode) == (1000, 2400, mode)
    assert found.probability == pytest.approx(0.95)
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)
    assert len({h.mode for h in found.hypotheses}) == len(found.hypotheses)
    assert found.detected == 1005
    assert words in found.evidence[0]


@pytest.mark.parametrize(
    "change",
    [
        lambda x: 0.7 * x + 0.15,  # the row of noise: a loss with a bias
        lambda x: x + 0.15 * RNG.standard_normal(SIZE),
        lambda x: 0.3 + 0.0 * x,
        lambda x: 0.0 * x,
        lambda x: np.where(T < 15.0, x + 0.1, 0.5 * x),
    ],
    ids=["loss and bias", "noise", "stuck", "dead", "two faults"],
)
def test_nothing_else_is_joined(change: Callable[[Array], Array]) -> None:
    assert with_one_cause(pieces(), measured(change)) == pieces()


def test_a_cause_of_all_pieces_names_each_of_them_where_health_lies_between() -> None:
    spans = ((300, 420, FaultMode.NOISY), (1500, 1560, FaultMode.STUCK), (3000, 3300, FaultMode.NOISY))
    found = with_one_cause(pieces(spans), measured(lambda x: x + 0.1))
    assert [(f.start, f.stop, f.mode) for f in found] == [(a, b, FaultMode.OUTSIDE_TABLE) for a, b, _ in spans]


def test_an_offset_that_hardly_changes_is_no_drift() -> None:
    (found,) = with_one_cause(pieces(), measured(lambda x: x + 0.12 + 0.0005 * (T - 17.0)))
    assert "an offset" in found.evidence[0]


def test_what_already_has_its_name_keeps_its_evidence() -> None:
    own = pieces([(1000, 2400, FaultMode.INEFFICIENT)])
    assert with_one_cause(own, measured(lambda x: 0.6 * x)) == own


def test_a_moment_is_no_cause() -> None:
    own = pieces([(1000, 1030, FaultMode.NOISY)])
    assert with_one_cause(own, measured(lambda x: x + 0.2)) == own


def test_what_fades_while_the_reference_hardly_moves_is_told_from_a_drift() -> None:
    x = 0.3 + 0.08 * np.sin(0.9 * T)
    y = (1.0 - 0.6 * (T - 10.0) / 14.0) * x + 0.0005 * RNG.standard_normal(SIZE)
    one = Measured(y, x, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", 0.0005, 0.02)
    (found,) = with_one_cause(pieces(((1000, 1500, FaultMode.STUCK), (1500, 2400, FaultMode.NOISY))), one)
    assert found.mode is FaultMode.INEFFICIENT


@pytest.mark.parametrize("level", [0.0, 0.0155, 0.2])
def test_a_constant_stays_stuck(level: float) -> None:
    near = pieces(((1000, 2400, FaultMode.STUCK),))
    for x in (X, np.full(SIZE, level) + 0.01 * np.sin(T)):
        one = Measured(np.full(SIZE, level), x, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", NOISE, 0.02)
        assert with_one_cause(near, one) == near


def test_two_losses_of_different_sizes_far_apart_are_no_gain_that_fades() -> None:
    y = np.where(T < 12.0, 0.0, np.where(T > 20.0, 0.6, 1.0)) * X
    near = pieces(((1000, 1200, FaultMode.NO_SIGNAL), (2000, 2400, FaultMode.INEFFICIENT)))
    assert with_one_cause(near, measured(lambda _: y)) == near


def test_where_nothing_moves_a_loss_and_an_offset_are_alike() -> None:
    x = 0.5 + 0.0005 * np.sin(T)
    one = Measured(0.6 * x, x, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", NOISE, 0.02)
    (found,) = with_one_cause(pieces(((1000, 2400, FaultMode.NOISY),)), one)
    assert (found.mode, found.probability) == (FaultMode.INEFFICIENT, 0.5)
    assert {h.mode: h.p for h in found.hypotheses}[FaultMode.OUTSIDE_TABLE] == pytest.approx(0.4)
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)


def test_a_piece_that_began_too_early_does_not_hide_a_loss() -> None:
    one = measured(lambda x: np.where(T > 16.0, 0.5, 1.0) * x)
    (found,) = with_one_cause(pieces(((1000, 2400, FaultMode.NOISY),)), one)
    assert found.mode is FaultMode.INEFFICIENT
    assert found.start == pytest.approx(1600, abs=60)


def test_a_piece_that_ended_too_late_does_not_hide_an_offset() -> None:
    """Behind it the quick moves of a moment are as large."""
    there = (T >= 12.0) & (T < 20.0)

    def change(x: Array) -> Array:
        return x + 0.12 * there + 0.1 * ((T > 25.0) & (T < 25.05))

    (found,) = with_one_cause(pieces([(1000, 3600, FaultMode.NOISY)]), measured(change))
    assert found.mode is FaultMode.OUTSIDE_TABLE
    assert "an offset" in found.evidence[0]
    assert (found.start, found.stop) == (pytest.approx(1200, abs=3), pytest.approx(2000, abs=3))


def test_what_still_deviates_behind_an_offset_is_not_left_out() -> None:
    there = (T >= 12.0) & (T < 20.0)
    (found,) = with_one_cause(
        pieces([(1000, 3600, FaultMode.NOISY)]), measured(lambda x: np.where(T >= 22.0, 0.94 * x, x) + 0.12 * there)
    )
    assert found.stop == 3600


def test_noise_beside_a_loss_is_noise() -> None:
    disturbed = 0.015 * np.convolve(RNG.standard_normal(SIZE), np.exp(-np.arange(200) / 40.0), "same") / 4.5
    near = pieces(((1000, 2400, FaultMode.NOISY),))
    assert with_one_cause(near, measured(lambda x: 0.6 * x + disturbed)) == near


def test_a_channel_that_is_held_again_and_again_is_stuck_each_time() -> None:
    spans = [(k, k + 300) for k in (500, 1400, 2300, 3200)]
    y = X.copy()
    for a, b in spans:
        y[a:b] = X[a]
    near = pieces([(a, b, FaultMode.STUCK) for a, b in spans])
    one = Measured(y, X, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", NOISE, 0.02)
    assert with_one_cause(near, one) == near


def short(gain: Array, x: Array, every: int = 1) -> list[Finding]:
    """What is found of a noisy piece of three seconds, with a reading every so many steps."""
    use = np.zeros(SIZE, np.bool_)
    use[::every] = True
    y = np.where((T >= 10.0) & (T < 13.0), gain * x, x) + NOISE * RNG.standard_normal(SIZE)
    return with_one_cause(
        pieces([(1000, 1300, FaultMode.NOISY)]), Measured(y, x, use, DT, ("a", "b"), "m/s", NOISE, 0.02)
    )


@pytest.mark.parametrize("every", [1, 5])
def test_a_short_fade_at_a_steady_speed_may_be_a_drift_and_is_no_noise(every: int) -> None:
    (found,) = short(1.0 - 0.2 * (T - 10.0), 0.8 + 0.02 * np.sin(3.0 * T), every)
    assert (found.mode, found.probability) == (FaultMode.INEFFICIENT, pytest.approx(0.7))
    assert "a drift explains as much" in found.evidence[1]
    assert {h.mode: h.p for h in found.hypotheses}[FaultMode.OUTSIDE_TABLE] == pytest.approx(0.2)


def test_a_fade_that_a_controller_makes_up_for_is_unclear() -> None:
    gain = 1.0 - 0.2 * np.clip(T - 10.0, 0.0, 3.0)
    (found,) = short(gain, 0.5 / gain)
    assert (found.mode, found.probability) == (FaultMode.INEFFICIENT, pytest.approx(0.5))
    assert "other rows explain nearly as much" in found.evidence[1]
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)


def test_a_fade_begins_within_its_piece() -> None:
    gain = 1.0 - 0.25 * np.maximum(T - 11.0, 0.0)
    (found,) = short(gain, 0.7 + 0.25 * np.sin(2.0 * T))
    assert found.mode is FaultMode.INEFFICIENT
    assert 1080 <= found.start <= 1130
    assert found.epsilon is not None
    assert found.epsilon.high == pytest.approx(0.53, abs=0.03)


def test_a_gain_that_does_not_change_does_not_fade() -> None:
    """Where the gain that may change is the same at both ends, to the last digit, no cause changes."""
    seen, steady = measured(lambda x: 0.6 * x), Cause(FaultMode.INEFFICIENT, "", 0.0, 0.0, Epsilon(0.4, 0.3, 0.5))
    assert _fading(seen.y, seen.x, [steady, steady], 1.0, seen) is None


@pytest.mark.parametrize("disturbed", [False, True])
def test_a_share_of_what_stays_is_one_cause_unless_noise_is_left(disturbed: bool) -> None:
    x = 0.9 + 0.01 * np.sin(0.9 * T)
    y = 0.65 * x + (5.0 if disturbed else 1.0) * NOISE * RNG.standard_normal(SIZE)
    seen = Measured(y, x, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", NOISE, 0.02)
    (found,) = with_one_cause(pieces([(1000, 2400, FaultMode.NOISY)]), seen)
    assert found.mode is (FaultMode.NOISY if disturbed else FaultMode.INEFFICIENT)


def test_an_offset_behind_a_rest_is_no_loss() -> None:
    x = np.where(T < 14.0, 0.0, 0.8 + 0.05 * np.sin(0.9 * T))
    y = x - 0.12 * (T >= 14.0) + NOISE * RNG.standard_normal(SIZE)
    off = Measured(y, x, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", NOISE, 0.02)
    (found,) = with_one_cause(pieces([(1000, 2400, FaultMode.INEFFICIENT)]), off)
    assert found.start == pytest.approx(1400, abs=3)
    assert FaultMode.OUTSIDE_TABLE in {h.mode for h in found.hypotheses}
    lost = replace(
        off, y=np.where(T >= 14.0, 0.85, 1.0) * np.where(T < 14.0, 0.0, 0.4 + X) + NOISE * RNG.standard_normal(SIZE)
    )
    lost = replace(lost, x=np.where(T < 14.0, 0.0, 0.4 + X))
    (found,) = with_one_cause(pieces([(1000, 2400, FaultMode.INEFFICIENT)]), lost)
    assert found.mode is FaultMode.INEFFICIENT


def test_an_offset_beside_a_command_that_stays_is_told_by_what_follows() -> None:
    x = np.where(T < 18.0, 0.8 + 0.02 * np.sin(0.9 * T), 0.05)
    y = x - 0.12 * ((T >= 14.0) & (T < 22.0)) + NOISE * RNG.standard_normal(SIZE)
    off = Measured(y, x, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", NOISE, 0.02)
    (found,) = with_one_cause(pieces([(1400, 1800, FaultMode.INEFFICIENT)]), off)
    assert (found.mode, found.start, found.stop) == (FaultMode.OUTSIDE_TABLE, 1400, pytest.approx(2100, abs=2))


def test_two_values_at_which_a_valve_sticks_are_no_gain() -> None:
    """A command that asks for one side and then for the other one makes a gain of -0.15 of them, which leaves hardly anything."""
    x = np.where(T < 20.0, -0.6, 0.8) + 0.2 * np.sin(0.9 * T)
    y = np.where((T > 10.0) & (T < 18.0), 0.075, np.where((T > 26.0) & (T < 36.0), -0.12, x))
    stuck = Measured(
        y + NOISE * RNG.standard_normal(SIZE), x, np.ones(SIZE, np.bool_), DT, ("a", "b"), "1", NOISE, 0.02
    )
    told = with_one_cause(pieces([(1000, 1800, FaultMode.STUCK), (2600, 3600, FaultMode.STUCK)]), stuck)
    assert [f.mode for f in told] == [FaultMode.STUCK, FaultMode.STUCK]
