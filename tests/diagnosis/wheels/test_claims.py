"""Claims of the wheel model are as sure as they turned out to be on machines of other build."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.candidates import candidates
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.claims import as_claimed
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.isolation import NOT_PREFERRED
from replay.faults import FaultMode, Side

CLEAR_AT = 0.25


def finding(side: Side, mode: FaultMode, p: float, epsilon: float | None = None) -> Finding:
    rows = (Hypothesis(side.value, mode.value, p), Hypothesis("none", "healthy", 1.0 - p))
    size = None if epsilon is None else Epsilon(epsilon, epsilon - 0.1, epsilon + 0.1)
    return Finding(1000, 2000, side, mode, p, rows, size, None, ("So it looks.",), Tier.MODEL)


def claimed(f: Finding, *, measured: bool = False) -> Finding:
    (got,) = as_claimed(WheelFindings([f]), CLEAR_AT, measured=measured).findings
    assert sum(h.p for h in got.hypotheses) == pytest.approx(1.0)
    assert "So it looks." in got.evidence
    assert [h.p for h in got.hypotheses] == sorted((h.p for h in got.hypotheses), reverse=True)
    assert sum(h.p for h in got.hypotheses if h.mode == "healthy") >= 1.0 - f.probability - 1e-9
    return got


@pytest.mark.parametrize(("p", "most"), [(0.97, 0.97), (0.92, 0.7), (0.81, 0.7)])
def test_a_stuck_valve_by_command_and_speed_alone_is_less_sure(p: float, most: float) -> None:
    got = claimed(finding(Side.ACTUATOR, FaultMode.STUCK, p))
    assert (got.side, got.mode, got.probability) == (Side.ACTUATOR, FaultMode.STUCK, pytest.approx(most))


def test_one_that_is_hardly_probable_has_no_majority() -> None:
    got = claimed(finding(Side.ACTUATOR, FaultMode.STUCK, 0.7, 1.0))
    assert (got.side, got.mode) == (Side.ACTUATOR, FaultMode.STUCK)
    assert got.probability == pytest.approx(0.32 * 0.7)
    assert sum(h.p for h in got.hypotheses if h.mode == "healthy") == pytest.approx(0.3)  # as before
    assert len(candidates(got.side.value, ((h.side, h.mode, h.p) for h in got.hypotheses))) == 3


def test_where_the_wheels_swing_together_it_is_left_open() -> None:
    flags = {side: np.zeros(3000, dtype=np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)}
    weak, sure = finding(Side.ACTUATOR, FaultMode.STUCK, 0.7), finding(Side.ACTUATOR, FaultMode.STUCK, 0.97)
    got = as_claimed(WheelFindings([weak, sure], flags, {}), CLEAR_AT, measured=False, swings=True)
    assert got.findings == [sure]
    assert flags[Side.ACTUATOR][1000:2000].all()
    assert not flags[Side.ACTUATOR][2000:].any()


def test_a_measured_position_decides() -> None:
    f = finding(Side.ACTUATOR, FaultMode.STUCK, 0.7)
    assert claimed(f, measured=True) is f


@pytest.mark.parametrize(("p", "epsilon", "most"), [(0.85, 0.15, 0.5), (0.95, 0.15, 0.85), (0.85, 0.3, 0.7)])
def test_a_small_loss_of_a_sensor_is_not_certain_enough_to_act_on(p: float, epsilon: float, most: float) -> None:
    assert claimed(finding(Side.SENSOR, FaultMode.INEFFICIENT, p, epsilon), measured=True).probability == most


@pytest.mark.parametrize("mode", [FaultMode.INEFFICIENT, FaultMode.NOISY])
def test_a_valve_that_answers_less_is_as_probably_another_wheel(mode: FaultMode) -> None:
    assert claimed(finding(Side.ACTUATOR, mode, 0.7, 0.5)).probability == pytest.approx(0.4)
    assert claimed(finding(Side.ACTUATOR, mode, 0.8, 0.5)).probability == 0.8
    assert claimed(finding(Side.ACTUATOR, mode, 0.7, 0.5), measured=True).probability == 0.7


@pytest.mark.parametrize(
    ("p", "measured", "side"),
    [(0.85, False, Side.SENSOR_OR_ACTUATOR), (0.95, False, Side.SENSOR), (0.85, True, Side.SENSOR)],
)
def test_a_loss_that_is_not_sure_is_of_the_sensor_or_the_valve(p: float, measured: bool, side: Side) -> None:
    """In a mission without valve positions the valve of the same wheel is as good a cause, and other rows are causes too."""
    got = claimed(finding(Side.SENSOR, FaultMode.INEFFICIENT, p, 0.5), measured=measured)
    either = side is Side.SENSOR_OR_ACTUATOR
    assert (got.side, got.mode, got.probability) == (
        side,
        FaultMode.INEFFICIENT,
        pytest.approx(0.85 if p == 0.95 else 0.7),
    )
    if either:
        assert [(h.side, h.p) for h in got.hypotheses[:2]] == [("sensor", 0.35), ("actuator", 0.35)]
        told = {(h.side, h.mode): h.p for h in got.hypotheses}
        assert told["actuator", "stuck"] == told["sensor", "outside_table"] == pytest.approx((p - 0.7) / 2)
        assert sum(told.values()) == pytest.approx(1.0)
    else:  # what lies behind the valve is in no row
        behind = [h.p for h in got.hypotheses if (h.side, h.mode) == ("actuator", "outside_table")]
        assert sum(behind) >= p - got.probability
        assert "behind" in got.evidence[-1]


@pytest.mark.parametrize(("mode", "p"), [(FaultMode.STUCK, 0.6), (FaultMode.NO_SIGNAL, 0.6), (FaultMode.NOISY, 0.9)])
def test_a_sensor_that_gives_one_value_by_the_trees_alone_is_less_sure(mode: FaultMode, p: float) -> None:
    f = finding(Side.SENSOR, mode, 0.9)
    assert claimed(f) is f
    assert claimed(replace(f, evidence=(*f.evidence, NOT_PREFERRED))).probability == pytest.approx(p)
