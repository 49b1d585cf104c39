"""From a run to a finding: probabilities, rows that cannot be distinguished at standstill, limits, ε̂."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.wheels.isolation import Run, RunVerdict, judge
from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    ODD,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_STUCK,
    S_WHITE_8,
    WheelFilterModel,
)
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.wheels.weights import CONTEXT, STEEP, by_evidence

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


@pytest.fixture(autouse=True)
def _weights_by_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("diagnosis.wheels.calibration.calibration", by_evidence)


def run(model: int, evidence: dict[int, float], gain: float = 0.5, level: float = 0.2, gain_std: float = 0.01) -> Run:
    """A run whose models have this log-evidence, healthy 0 and the others far below."""
    log_evidence = np.full(MODELS, -1e4)
    log_evidence[HEALTHY] = 0.0
    for m, value in evidence.items():
        log_evidence[m] = value
    mean, cov = np.zeros((MODELS, 4)), np.zeros((MODELS, 4, 4))
    mean[:, 1], mean[:, 3] = gain, level
    cov[:, 1, 1], cov[:, 3, 3] = gain_std**2, 0.01**2
    return Run(1000, 1000 + SIZE, model, log_evidence, mean, cov, CONTEXT)


def moving(level: float = 0.2) -> Array:
    return level + 0.05 * np.sin(np.arange(SIZE) / 300) + 0.004 * np.random.default_rng(1).normal(size=SIZE)


def judged(of: Run, y: Array | None = None, gains: bool = True, limits: Limits = LIMITS) -> RunVerdict:
    return judge(of, moving() if y is None else y, MODEL, limits, NAMES, DT, gains=gains)


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
    got = judged(run(m, {m: 1e5})).finding
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
    got = judged(run(A_STUCK, {A_STUCK: 5000.0, A_BIAS: 4998.3})).finding
    assert got is not None
    assert sum(h.p for h in got.hypotheses) == pytest.approx(1.0, abs=0.01)
    assert any(line.startswith("Next best: drive valve disturbed with 1") for line in got.evidence)


def test_stuck_at_zero_is_no_signal() -> None:
    still = 0.0003 * np.sin(np.arange(SIZE))
    for m in (S_STUCK, S_NONE):
        got = judged(run(m, {S_STUCK: 1000.0, S_NONE: 1001.0}, level=0.0), still).finding
        assert got is not None
        assert (got.side, got.mode) == (Side.SENSOR, FaultMode.NO_SIGNAL)
        assert got.probability > 0.99
        assert got.epsilon is not None
        assert got.epsilon.value == 1.0


def test_a_channel_without_a_sample_is_no_signal() -> None:
    got = judged(run(S_NONE, {S_NONE: 1000.0}), np.full(SIZE, np.nan)).finding
    assert got is not None
    assert (got.mode, got.sat) == (FaultMode.NO_SIGNAL, None)


def test_a_valve_stuck_open_keeps_its_opening() -> None:
    open_ = judged(run(A_STUCK, {A_STUCK: 5000.0}, level=0.08 * MODEL.K)).finding
    assert open_ is not None
    assert open_.mode is FaultMode.STUCK
    assert open_.sat is not None
    assert open_.sat.mean == pytest.approx(0.08)


def test_gain_that_may_be_either_sides_is_the_unions() -> None:
    got = judged(run(S_GAIN, {S_GAIN: 5000.0, A_GAIN: 4999.7}))
    assert got.finding is not None
    assert got.finding.side is Side.SENSOR_OR_ACTUATOR
    assert got.finding.mode is FaultMode.INEFFICIENT
    assert got.finding.probability > 0.99
    assert any("cannot be distinguished" in line for line in got.finding.evidence)
    # other rows of the two sides have no union: both sides stay open
    other = judged(run(S_WHITE_8, {S_WHITE_8: 5000.0, A_STUCK: 5000.0}))
    assert other.finding is None
    assert set(other.open_sides) == {Side.SENSOR, Side.ACTUATOR}


def test_small_losses_are_not_reported() -> None:
    for m in (S_GAIN, A_GAIN):
        assert judged(run(m, {m: 5000.0}, gain=0.93)).finding is None
        found = judged(run(m, {m: 5000.0}, gain=0.93), limits=Limits(min_epsilon=0.05)).finding
        assert found is not None
        assert found.epsilon is not None
        assert found.epsilon.value == pytest.approx(0.07)
        assert found.epsilon.high - found.epsilon.value == pytest.approx(0.0196)


def test_a_disturbance_that_loses_nothing_leaves_its_valve_open() -> None:
    got = judged(run(A_BIAS, {A_BIAS: 5000.0}, gain=1.5))
    assert got.finding is None
    assert Side.ACTUATOR in got.open_sides


def test_what_is_stated_is_what_the_calibration_holds_for_probable(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same evidence, and a calibration that trusts valves less: their side stays open instead."""
    of = run(A_STUCK, {A_STUCK: 60.0})
    trusted = judged(of).finding
    assert trusted is not None
    assert trusted.probability > 0.99
    doubting = by_evidence(valves=-np.log(61.0) * STEEP)
    monkeypatch.setattr("diagnosis.wheels.calibration.calibration", lambda: doubting)
    got = judged(of)
    assert got.finding is None
    assert got.open_sides == (Side.ACTUATOR,)
    assert not got.usual
    assert judged(run(S_STUCK, {S_STUCK: 60.0})).finding is not None


def test_healthy_runs_give_nothing() -> None:
    for of in (run(S_GAIN, {S_GAIN: -500.0}), run(A_GAIN, {A_GAIN: -500.0, ODD: 0.0})):
        assert judged(of) == RunVerdict(None, (), usual=True)


def test_an_improbable_fault_leaves_its_side_open() -> None:
    got = judged(run(S_GAIN, {S_GAIN: 0.2}))
    assert got.finding is None
    assert got.open_sides == (Side.SENSOR,)
    assert not got.usual
    weaker = judged(run(S_GAIN, {S_GAIN: -1.0}))
    assert weaker.finding is None
    assert weaker.open_sides == (Side.SENSOR,)
    assert weaker.usual


def test_what_an_unusual_load_explains_is_no_evidence() -> None:
    """Evidence is counted from a healthy wheel under any load; an unusual one has its price."""
    of = run(A_GAIN, {A_GAIN: 500.0, ODD: 400.0})
    assert of.ahead(A_GAIN) == pytest.approx(102.0)
    assert run(A_GAIN, {A_GAIN: 500.0, ODD: -400.0}).ahead(A_GAIN) == pytest.approx(500.0)
    got = judged(run(A_GAIN, {A_GAIN: 500.0, ODD: 510.0}))
    assert got.finding is None
    assert got.usual


def test_without_a_model_of_the_wheel_only_what_needs_none_is_stated() -> None:
    for m in (S_GAIN, A_GAIN, A_STUCK, A_NONE, A_BIAS):
        got = judged(run(m, {m: 1e5}), gains=False)
        assert got.finding is None
        assert set(got.open_sides) == {Side.SENSOR, Side.ACTUATOR}
    for m in (S_STUCK, S_WHITE_8):
        assert judged(run(m, {m: 1e5}), gains=False).finding is not None


def test_saturation_terms() -> None:
    level = np.full(SIZE, 0.2)
    stuck = judged(run(S_STUCK, {S_STUCK: 1e5}), level).finding
    assert stuck is not None
    assert stuck.sat is not None
    assert (stuck.sat.mean, stuck.sat.rms) == pytest.approx((0.2, 0.2))
    # y = δ v + ε·sat: the part that is added, over the part that is lost
    white = judged(run(S_WHITE_8, {S_WHITE_8: 1e5}, gain=0.6, level=0.1)).finding
    assert white is not None
    assert white.epsilon is not None
    assert white.sat is not None
    assert white.epsilon.value == pytest.approx(0.4)
    assert white.sat.mean == pytest.approx(0.25)
    assert white.sat.rms > 0.25
    valve = judged(run(A_BIAS, {A_BIAS: 1e5}, gain=0.5, level=0.12)).finding
    assert valve is not None
    assert valve.sat is not None
    assert valve.sat.mean == pytest.approx(0.12 / MODEL.K / 0.5)
