"""From a run to a finding: probabilities, rows that cannot be distinguished at standstill, limits, ε̂."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.wheels.isolation import Run, RunVerdict, judge
from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    ODD,
    ROW_OF_MODEL,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_STUCK,
    S_WHITE_8,
    Row,
    WheelFilterModel,
)
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

MODEL = WheelFilterModel(
    K=2.4,
    tau=0.25,
    noise=0.004,
    constant_noise=0.0005,
    rounding=0.0003,
    load=0.014,
    span=0.8,
    valve_span=0.15,
)
LIMITS, NAMES, DT = Limits(), ("wheel.FR.v", "wheel.FR.u"), 0.001
SIZE = 3000
Array = np.ndarray


def shares(given: dict[int, float]) -> dict[Row | None, float]:
    """Probabilities of rows by the models that stand for them; the rest is that of a healthy wheel."""
    rows = dict.fromkeys(ROW_OF_MODEL, 0.0)
    for m, p in given.items():
        rows[ROW_OF_MODEL[m]] += p
    rows[None] = 1.0 - sum(given.values())
    return rows


def run(model: int, given: dict[int, float], gain: float = 0.5, level: float = 0.2, gain_std: float = 0.01) -> Run:
    """A run with these probabilities, whose models have evidence in the same order, healthy 0 and the others far below."""
    log_evidence = np.full(MODELS, -1e4)
    log_evidence[HEALTHY] = 0.0
    for m, p in given.items():
        log_evidence[m] = 1000.0 * p
    mean, cov = np.zeros((MODELS, 4)), np.zeros((MODELS, 4, 4))
    mean[:, 1], mean[:, 3] = gain, level
    cov[:, 1, 1], cov[:, 3, 3] = gain_std**2, 0.01**2
    row = ROW_OF_MODEL[model]
    assert row is not None
    return Run(1000, 1000 + SIZE, row[0], shares(given), log_evidence, mean, cov)


def moving(level: float = 0.2) -> Array:
    return level + 0.05 * np.sin(np.arange(SIZE) / 300) + 0.004 * np.random.default_rng(1).normal(size=SIZE)


def judged(of: Run, y: Array | None = None, limits: Limits = LIMITS) -> RunVerdict:
    return judge(of, moving() if y is None else y, MODEL, limits, NAMES, DT)


@pytest.mark.parametrize(
    ("m", "side", "mode", "tier"),
    [
        (S_STUCK, Side.SENSOR, FaultMode.STUCK, "signal"),
        (S_GAIN, Side.SENSOR, FaultMode.INEFFICIENT, "model"),
        (S_WHITE_8, Side.SENSOR, FaultMode.NOISY, "model"),
        (S_OU_LARGE, Side.SENSOR, FaultMode.NOISY, "model"),
        (A_GAIN, Side.ACTUATOR, FaultMode.INEFFICIENT, "model"),
        (A_STUCK, Side.ACTUATOR, FaultMode.STUCK, "model"),
        (A_NONE, Side.ACTUATOR, FaultMode.NO_SIGNAL, "model"),
        (A_BIAS, Side.ACTUATOR, FaultMode.NOISY, "model"),
    ],
)
def test_each_model_gives_its_row(m: int, side: Side, mode: FaultMode, tier: str) -> None:
    got = judged(run(m, {m: 0.999})).finding
    assert got is not None
    assert (got.side, got.mode, got.tier) == (side, mode, tier)
    assert (got.start, got.stop) == (1000, 1000 + SIZE)
    assert 0.99 < got.probability <= 1.0
    assert sum(h.p for h in got.hypotheses) == pytest.approx(1.0, abs=0.01)
    assert [h.p for h in got.hypotheses] == sorted((h.p for h in got.hypotheses), reverse=True)
    assert "wheel.FR.v" in got.evidence[0]
    assert "3.000 s" in got.evidence[0]
    assert got.epsilon is not None
    assert got.epsilon.low <= got.epsilon.value <= got.epsilon.high
    if got.sat is not None:
        assert got.sat.low <= got.sat.mean <= got.sat.high
        assert got.sat.unit == ("m/s" if side is Side.SENSOR else "of full opening")


def test_alternatives_add_up_and_the_next_best_is_said() -> None:
    got = judged(run(A_STUCK, {A_STUCK: 0.85, A_BIAS: 0.15})).finding
    assert got is not None
    assert sum(h.p for h in got.hypotheses) == pytest.approx(1.0, abs=0.01)
    assert any(HYDRAULIC.fill(line).startswith("Next best: drive valve disturbed with 15 %") for line in got.evidence)


def test_stuck_at_zero_is_no_signal() -> None:
    still = 0.0003 * np.sin(np.arange(SIZE))
    for m in (S_STUCK, S_NONE):
        got = judged(run(m, {S_STUCK: 0.45, S_NONE: 0.549}, level=0.0), still).finding
        assert got is not None
        assert (got.side, got.mode) == (Side.SENSOR, FaultMode.NO_SIGNAL)
        assert got.probability > 0.99
        assert got.epsilon is not None
        assert got.epsilon.value == 1.0


def test_a_channel_without_a_sample_is_no_signal() -> None:
    got = judged(run(S_NONE, {S_NONE: 0.999}), np.full(SIZE, np.nan)).finding
    assert got is not None
    assert (got.mode, got.sat) == (FaultMode.NO_SIGNAL, None)


def test_the_last_readings_of_a_silent_channel_are_no_reading_of_it() -> None:
    y = np.full(SIZE, np.nan)
    y[:3] = 0.31
    got = judged(run(S_NONE, {S_NONE: 0.999}), y).finding
    assert got is not None
    assert (got.mode, got.sat) == (FaultMode.NO_SIGNAL, None)
    assert any(line.endswith("delivered nothing in this time.") for line in got.evidence)


def test_a_valve_stuck_open_keeps_its_opening() -> None:
    open_ = judged(run(A_STUCK, {A_STUCK: 0.999}, level=0.08 * MODEL.K)).finding
    assert open_ is not None
    assert open_.mode is FaultMode.STUCK
    assert open_.sat is not None
    assert open_.sat.mean == pytest.approx(0.08)


def test_gain_that_may_be_either_sides_is_the_unions() -> None:
    got = judged(run(S_GAIN, {S_GAIN: 0.55, A_GAIN: 0.445}))
    assert got.finding is not None
    assert got.finding.side is Side.SENSOR_OR_ACTUATOR
    assert got.finding.mode is FaultMode.INEFFICIENT
    assert got.finding.probability > 0.99
    assert any("cannot be distinguished" in line for line in got.finding.evidence)
    shares = {h.side: h.p for h in got.finding.hypotheses if h.mode == "inefficient"}
    assert shares["sensor"] == pytest.approx(shares["actuator"])
    assert not any("“speed sensor inefficient”" in HYDRAULIC.fill(line) for line in got.finding.evidence)
    # other rows of the two sides have no union
    other = judged(run(S_WHITE_8, {S_WHITE_8: 0.5, A_STUCK: 0.5}))
    assert other.finding is None


def test_small_losses_are_not_reported() -> None:
    for m in (S_GAIN, A_GAIN):
        assert judged(run(m, {m: 0.999}, gain=0.93)).finding is None
        found = judged(run(m, {m: 0.999}, gain=0.93), limits=Limits(min_epsilon=0.05)).finding
        assert found is not None
        assert found.epsilon is not None
        assert found.epsilon.value == pytest.approx(0.07)
        assert found.epsilon.high - found.epsilon.value == pytest.approx(0.0196)


@pytest.mark.parametrize(("side", "row", "stated"), [(0.75, 0.55, True), (0.75, 0.45, False), (0.65, 0.65, False)])
def test_what_is_stated_needs_a_probable_side_and_row(side: float, row: float, stated: bool) -> None:
    got = judged(run(A_STUCK, {A_STUCK: row, A_BIAS: side - row})).finding
    assert (got is not None) == stated


def test_what_an_unusual_load_explains_is_no_evidence() -> None:
    """Evidence is counted from a healthy wheel under any load; an unusual one has its price."""
    of = run(A_GAIN, {A_GAIN: 0.5, ODD: 0.4})
    assert of.ahead(A_GAIN) == pytest.approx(102.0)
    assert run(A_GAIN, {A_GAIN: 0.5}).ahead(A_GAIN) == pytest.approx(500.0)


def test_a_sensor_that_shows_hardly_anything_hides_its_valve() -> None:
    assert judged(run(S_GAIN, {S_GAIN: 0.999}, gain=0.2)).hidden
    assert not judged(run(S_GAIN, {S_GAIN: 0.999}, gain=0.5)).hidden
    assert not judged(run(A_GAIN, {A_GAIN: 0.999}, gain=0.2)).hidden


def test_saturation_terms() -> None:
    level = np.full(SIZE, 0.2)
    stuck = judged(run(S_STUCK, {S_STUCK: 0.999}), level).finding
    assert stuck is not None
    assert stuck.sat is not None
    assert (stuck.sat.mean, stuck.sat.rms) == pytest.approx((0.2, 0.2))
    # y = δ v + ε·sat: the part that is added, over the part that is lost
    white = judged(run(S_WHITE_8, {S_WHITE_8: 0.999}, gain=0.6, level=0.1)).finding
    assert white is not None
    assert white.epsilon is not None
    assert white.sat is not None
    assert white.epsilon.value == pytest.approx(0.4)
    assert white.sat.mean == pytest.approx(0.25)
    assert white.sat.rms > 0.25
    valve = judged(run(A_BIAS, {A_BIAS: 0.999}, gain=0.5, level=0.12)).finding
    assert valve is not None
    assert valve.sat is not None
    assert valve.sat.mean == pytest.approx(0.12 / MODEL.K / 0.5)


def test_a_sensor_that_moves_is_not_stuck() -> None:
    """Driven at one speed, with a ramp before: only its Kalman model could say more, and does not."""
    y = np.r_[np.linspace(0.0, 0.2, SIZE // 3), np.full(SIZE - SIZE // 3, 0.2)]
    y += 0.004 * np.random.default_rng(2).normal(size=SIZE)
    of = run(S_STUCK, {S_STUCK: 0.9})
    of.evidence[S_STUCK] = -10.0
    assert judged(of, y).finding is None
    resting = judged(of, np.full(SIZE, 0.2)).finding
    assert resting is not None
    assert resting.mode is FaultMode.STUCK


def test_a_row_that_the_wheels_own_model_does_not_prefer_is_no_certain_one() -> None:
    def with_evidence(m: int, ahead: float) -> float:
        of = run(m, {m: 0.97})
        evidence = of.evidence.copy()
        evidence[m] = ahead
        y = np.full(SIZE, 0.2) if m == S_STUCK else moving()
        got = judged(replace(of, evidence=evidence), y).finding
        assert got is not None
        assert sum(h.p for h in got.hypotheses) == pytest.approx(1.0, abs=0.01)
        return got.probability

    assert with_evidence(S_GAIN, 50.0) == pytest.approx(0.97)
    assert with_evidence(S_GAIN, -50.0) == pytest.approx(0.88)
    assert with_evidence(S_STUCK, -50.0) == pytest.approx(0.97)  # a value that is held is seen by itself
