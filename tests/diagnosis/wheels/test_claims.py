"""Claims of the wheel model are as sure as they turned out to be on machines of other build."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.candidates import candidates
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, Sentence
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.claims import as_claimed
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.isolation import NOT_PREFERRED
from diagnosis.wheels.models import WheelFilterModel
from diagnosis.wheels.onset import only_a_sensor, onset_sentence
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
        pytest.approx({(0.95, False): 0.85, (0.85, False): 0.8, (0.85, True): 0.7}[p, measured]),
    )
    if either:
        assert [(h.side, h.p) for h in got.hypotheses[:2]] == [("sensor", 0.4), ("actuator", 0.4)]
        told = {(h.side, h.mode): h.p for h in got.hypotheses}
        assert told["actuator", "stuck"] == told["sensor", "outside_table"] == pytest.approx((p - 0.8) / 2)
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


def with_rows(*texts: str) -> Finding:
    """A loss of a sensor, hardly one of its valve, with some evidence."""
    rows = (
        Hypothesis("sensor", "inefficient", 0.65),
        Hypothesis("actuator", "inefficient", 0.05),
        Hypothesis("none", "healthy", 0.3),
    )
    said = (
        Sentence(About.CASES, "v and u fit “speed sensor inefficient”: it was this in ", "65", " of 100 cases."),
        Sentence(About.RIVAL, "Next best: drive valve inefficient with 5 %."),
        "So it looks.",
        *texts,
    )
    return Finding(
        1000, 2000, Side.SENSOR, FaultMode.INEFFICIENT, 0.65, rows, Epsilon(0.5, 0.4, 0.6), None, said, Tier.MODEL
    )


def unsure(f: Finding) -> Finding:
    """The same by command and speed alone."""
    (got,) = as_claimed(WheelFindings([f]), CLEAR_AT, measured=False).findings
    assert sum(h.p for h in got.hypotheses) == pytest.approx(1.0)
    return got


def test_a_jump_that_no_wheel_can_do_is_the_sensors() -> None:
    """What the sentence says reaches side and probabilities, and what was said of either is said no more."""
    y = np.full(3000, 2.0) + 0.001 * np.arange(3000)
    y[1000:] -= 1.0
    model = WheelFilterModel(2.4, 0.25, 0.004, 0.0005, 0.0003, 0.014, 0.8, 0.15)
    got = unsure(with_rows(onset_sentence(1000, y, model, 0.001, "v", Side.SENSOR)))
    assert (got.side, got.mode, got.probability) == (Side.SENSOR, FaultMode.INEFFICIENT, pytest.approx(0.7))
    told = {(h.side, h.mode): h.p for h in got.hypotheses}
    assert ("actuator", "inefficient") not in told
    assert told["none", "healthy"] == pytest.approx(0.3)
    either = unsure(with_rows(onset_sentence(1000, y, model, 0.1, "v", Side.SENSOR)))  # within 0.1 s a wheel can
    assert either.side is Side.SENSOR_OR_ACTUATOR
    for f in (got, either):
        words = " ".join(f.evidence)
        assert "of 100 cases" not in words
        assert "Next best" not in words


def test_what_a_quick_wheel_may_do_is_no_jump() -> None:
    """A wheel of another build may be twice as quick as its model: a motor that lost half stopped its wheel within 30 ms."""
    y = np.full(3000, 1.2) + 0.001 * np.arange(3000)
    y[1000:] -= 0.5
    model = WheelFilterModel(2.4, 0.25, 0.004, 0.0005, 0.0003, 0.014, 0.8, 0.15)
    assert [only_a_sensor([onset_sentence(1000, y, model, dt, "v", Side.SENSOR)]) for dt in (0.01, 0.02)] == [
        True,
        False,
    ]


def test_a_reading_that_came_late_may_have_moved_on() -> None:
    """A value that stood for half a second before its step is one that came seldom: what a wheel does meanwhile is no jump."""
    y = np.full(3000, 2.0) + 0.001 * np.arange(3000)
    y[1000:] -= 1.0
    model = WheelFilterModel(2.4, 0.25, 0.004, 0.0005, 0.0003, 0.014, 0.8, 0.15)
    assert only_a_sensor([onset_sentence(1000, y, model, 0.001, "v", Side.SENSOR)])
    y[500:1000] = y[500]
    assert not only_a_sensor([onset_sentence(1000, y, model, 0.001, "v", Side.SENSOR)])
