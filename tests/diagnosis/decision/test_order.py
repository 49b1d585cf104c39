"""What comes first: the part that stops the machine, then what may follow from it, or is of low severity."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.decision.behind_events import with_faults_behind
from diagnosis.decision.decide import decide
from diagnosis.decision.decided import Decision
from diagnosis.decision.intervals import intervals_of
from diagnosis.results.assessment import Assessment
from diagnosis.results.machine_event import gyro_otherwise
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Epsilon
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side
from tests.diagnosis.decision.findings import AXLES, LIMITS, MACHINE, STEP, assessed, finding, machine


def verdict(parts: dict[tuple[str, str], Assessment]) -> Decision:
    faults = intervals_of(parts, replace(MACHINE, limits=LIMITS), HYDRAULIC, 0, STEP)
    return decide(faults, parts, dict.fromkeys(parts, 20.0), AXLES, LIMITS, (), HYDRAULIC)


def test_of_a_machine_that_is_stopped_what_is_of_low_severity_comes_after_the_repair() -> None:
    unsure = finding(Side.SENSOR, FaultMode.INEFFICIENT, 9000, 12_000, p=0.7, epsilon=0.34)
    unsure = replace(unsure, epsilon=Epsilon(0.34, 0.0, 1.0))
    stuck = assessed(finding(Side.ACTUATOR, FaultMode.STUCK, 1000, 4000))
    both = verdict(machine(FR_actuator=stuck, front_sensor=assessed(unsure)))
    assert [str(a["lead"]).split(" the ")[0] for a in both.actions] == ["Stop at once and repair", "Then check"]
    alone = verdict(machine(front_sensor=assessed(unsure)))
    assert alone.actions[0]["lead"].startswith("Before the machine goes out, check")
    assert "anything from nothing to all" in alone.not_cleared


def test_what_lies_in_the_time_of_a_stuck_part_may_be_its_consequence() -> None:
    weak = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 1200, 4100, epsilon=0.2)
    later = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 6000, 9000, epsilon=0.2)
    stuck = assessed(finding(Side.ACTUATOR, FaultMode.STUCK, 1000, 4000))
    for of, told in ((weak, True), (later, False)):
        got = verdict(machine(FR_actuator=stuck, FL_actuator=assessed(replace(of, tier=Tier.MODEL))))
        assert ("may be no more than its consequence" in got.actions[1]["text"]) is told


def test_an_event_in_the_time_of_a_stuck_part_points_to_it_first() -> None:
    parts = machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.STUCK, 1000, 4000)))
    gyro = gyro_otherwise("By the gyro the machine turns the other way").worded(HYDRAULIC)
    faults = intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP)
    within, apart = with_faults_behind([gyro.at([(1.0, 5.0)]), gyro.at([(7.0, 9.0)])], faults, HYDRAULIC)
    assert within.act.startswith("repair the FR drive valve (F1)")
    assert "F1 (FR drive valve stuck) lasts in that time" in within.text
    assert (apart.text, apart.act) == (gyro.text, gyro.act)
