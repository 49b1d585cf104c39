"""Faults are numbered by urgency, and states leave no gap."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from diagnosis.decision.intervals import intervals_of, spans_of
from diagnosis.decision.wording import fault_words, sentence_of
from diagnosis.results.assessment import unassessed
from diagnosis.results.ending import Ending
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from tests.diagnosis.decision.findings import MACHINE, STEP, N, assessed, finding, machine


def test_intervals_are_numbered_worst_first_then_by_time() -> None:
    parts = machine(
        FL_sensor=assessed(finding(Side.SENSOR, FaultMode.NOISY, 500, 900, epsilon=0.1)),
        FR_actuator=assessed(
            finding(Side.ACTUATOR, FaultMode.STUCK, 8000, 9000),
            finding(Side.ACTUATOR, FaultMode.NO_SIGNAL, 3000, 4000),
            finding(Side.ACTUATOR, FaultMode.NOISY, 100, 200, p=0.5),
        ),
        front_sensor=assessed(finding(Side.SENSOR, FaultMode.INEFFICIENT, 6000, 7000, epsilon=0.5)),
    )
    got = intervals_of(parts, MACHINE, HYDRAULIC, 5_000_000_000, STEP)
    assert [(f.id, f.component, f.severity, f.start_s) for f in got] == [
        ("F1", "FR", "high", 3.0),
        ("F2", "FR", "high", 8.0),
        ("F3", "front", "medium", 6.0),
        ("F4", "FL", "low", 0.5),
        ("F5", "FR", "info", 0.1),
    ]
    assert [f.kind for f in got] == ["wheel", "wheel", "steer", "wheel", "wheel"]
    assert (got[0].start_ns, got[0].stop_ns) == (8_000_000_000, 9_000_000_000)


def test_what_lasts_to_the_end_is_the_fault_that_does() -> None:
    parts = machine(
        FR_actuator=assessed(
            finding(Side.ACTUATOR, FaultMode.NO_SIGNAL, 3000, 8400), finding(Side.ACTUATOR, FaultMode.STUCK, 25_200, N)
        )
    )
    faults = intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP)
    said = sentence_of(faults, HYDRAULIC, {faults[1].id: Ending.LASTS})
    assert said.endswith("for 4.8 s, the last, stuck, to the end of the log.")
    alone = sentence_of(faults[1:], HYDRAULIC, {faults[1].id: Ending.LASTS})
    assert alone.endswith("stuck for 4.8 s, to the end of the log.")


def test_time_of_detection_is_the_samples() -> None:
    causal = replace(finding(Side.SENSOR, FaultMode.STUCK, 1000, 9000), detected=1004)
    parts = machine(FR_sensor=assessed(causal), FL_sensor=assessed(finding(Side.SENSOR, FaultMode.STUCK)))
    got = {f.component: f.detected_s for f in intervals_of(parts, MACHINE, HYDRAULIC, 5_000_000_000, STEP)}
    assert got == {"FR": pytest.approx(1.004), "FL": None}


def test_shared_finding_counts_once() -> None:
    shared = finding(Side.SENSOR_OR_ACTUATOR, FaultMode.INEFFICIENT, epsilon=0.5)
    got = intervals_of(machine(FR_sensor=assessed(shared), FR_actuator=assessed(shared)), MACHINE, HYDRAULIC, 0, STEP)
    assert [f.id for f in got] == ["F1"]


def test_what_was_measured_for_longer_than_a_fault_lasts_says_so() -> None:
    cut = replace(
        finding(Side.SENSOR, FaultMode.INEFFICIENT, 5000, 9000), evidence=("v was -0.7 × u, over {14.62 s}.",)
    )
    (got,) = intervals_of(machine(FR_sensor=assessed(cut)), MACHINE, HYDRAULIC, 0, STEP)
    assert got.evidence == ("v was −0.7 × u, over 14.62 s in and around it.",)


def test_spans_leave_no_gap() -> None:
    parts = machine(FR_sensor=assessed(finding(Side.SENSOR, FaultMode.STUCK, 0, 100)))
    parts["front", "actuator"] = unassessed(N, State.NO_DATA, "the valve is not in the log")
    spans = spans_of(parts, STEP)
    for component, side in parts:
        mine = [s for s in spans if (s.component, s.side) == (component, side)]
        assert mine[0].start_s == 0.0
        assert mine[-1].stop_s == pytest.approx(30.0)
        assert all(a.stop_s == b.start_s for a, b in pairwise(mine))
    first, second = (s for s in spans if (s.component, s.side) == ("FR", "sensor"))
    assert (first.state, first.stop_s, second.state) == (State.STUCK, 0.1, State.HEALTHY)
    assert spans[-1].reason == "the valve is not in the log"


def test_a_fault_without_a_majority_is_called_by_its_candidates() -> None:
    rows = (
        ("actuator", "inefficient", 0.45),
        ("actuator", "stuck", 0.4),
        ("actuator", "no_signal", 0.1),
        ("none", "healthy", 0.05),
    )
    part = replace(finding(Side.ACTUATOR, FaultMode.INEFFICIENT), hypotheses=tuple(Hypothesis(*row) for row in rows))
    (fault,) = intervals_of({("FR", "actuator"): assessed(part)}, MACHINE, HYDRAULIC, 0, STEP)
    assert fault_words(fault) == "faulty, kind unclear (inefficient or stuck)"


def test_bounds_of_a_loss_by_a_wheels_model_allow_for_the_model() -> None:
    direct = finding(Side.SENSOR, FaultMode.INEFFICIENT, epsilon=0.4)
    for tier, bounds in ((Tier.DIRECT, (0.39, 0.41)), (Tier.MODEL, (0.0, 0.85))):
        parts = machine(FR_sensor=assessed(replace(direct, tier=tier)))
        (got,) = intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP)
        assert got.epsilon is not None
        assert (got.epsilon.low, got.epsilon.high) == pytest.approx(bounds)


@pytest.mark.parametrize(("low", "high", "ends"), [(0.0, 1.0, (0.02, 0.6)), (0.49, 0.51, (0.0392, 0.1225))])
def test_bounds_of_a_noise_hold_for_every_share_that_may_be_lost(
    low: float, high: float, ends: tuple[float, float]
) -> None:
    noise = replace(
        finding(Side.SENSOR, FaultMode.NOISY), epsilon=Epsilon(0.5, low, high), sat=Sat(0.08, 0.2, 0.04, 0.12, "m/s")
    )
    (got,) = intervals_of(machine(FR_sensor=assessed(noise)), MACHINE, HYDRAULIC, 0, STEP)
    assert got.sat is not None
    assert (got.sat.mean, got.sat.rms) == (0.08, 0.2)
    assert (got.sat.low, got.sat.high) == pytest.approx(ends, rel=0.01)


def test_advice_goes_by_the_bounds_that_are_stated() -> None:
    seen = replace(finding(Side.SENSOR, FaultMode.INEFFICIENT, epsilon=0.39), tier=Tier.MODEL)
    (got,) = intervals_of(machine(FL_sensor=assessed(seen)), MACHINE, HYDRAULIC, 0, STEP)
    assert got.epsilon is not None
    assert (
        got.advice
        == f"It may have lost up to {100 * got.epsilon.high:.0f} %: check it before the machine goes out again."
    )
