"""Which faults explain why a check deviates: by time, and by what the check compares."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from diagnosis.decision.explained import When, explaining
from diagnosis.decision.intervals import intervals_of
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Kind
from replay.faults import FaultMode, Side
from replay.machine.config import haulotte
from tests.diagnosis.decision.findings import assessed, finding

Where = tuple[str, Side]


def faults_of(
    *parts: Where, mode: FaultMode = FaultMode.STUCK, at: tuple[int, int] = (1000, 3000)
) -> Sequence[FaultInterval]:
    found = {(c, side.value): assessed(finding(side, mode, *at)) for c, side in parts}
    return intervals_of(found, haulotte(), HYDRAULIC, 0, 1_000_000)


def check_of(component: str, check: Check, times: tuple[float, float] = (2.0, 5.0)) -> Checked:
    kind = Kind.STEER if component in ("front", "rear") else Kind.WHEEL
    return Checked(kind, component, Side.SENSOR_OR_ACTUATOR, check, 0.4, 0.1, *times)


@pytest.mark.parametrize(
    ("component", "check", "fault", "explained"),
    [
        ("FR", Check.RESPONSE, ("RR", Side.ACTUATOR), True),
        ("FR", Check.EXCESS, ("RR", Side.SENSOR), True),
        ("FR", Check.TRACKING, ("rear", Side.SENSOR), True),  # another curve
        ("front", Check.YAW, ("rear", Side.SENSOR), True),
        ("FR", Check.RESPONSE, ("FR", Side.ACTUATOR), False),  # its own
        ("FR", Check.ROUGHNESS, ("RR", Side.ACTUATOR), False),  # what a part does by itself
        ("front", Check.YAW, ("RR", Side.SENSOR), False),
        ("front", Check.RATE, ("rear", Side.ACTUATOR), False),
        ("front", Check.STILL, ("RR", Side.ACTUATOR), False),
    ],
)
def test_what_a_check_compares_decides_whether_a_fault_explains_it(
    component: str, check: Check, fault: Where, explained: bool
) -> None:
    why = explaining(check_of(component, check), faults_of(fault))
    assert why is not None  # it may be the cause at the least
    assert why.of_another is explained
    assert why.when is When.DURING


@pytest.mark.parametrize("check", [Check.SECOND_MEASUREMENT, Check.JUMP])
def test_two_measurements_of_a_part_and_jumps_are_no_other_parts_doing(check: Check) -> None:
    asked = check_of("front", check)
    assert explaining(asked, faults_of(("RR", Side.ACTUATOR))) is None
    assert explaining(asked, faults_of(("front", Side.SENSOR))) is not None


def test_of_several_faults_that_explain_it_all_are_named_and_its_own_is_told_alone() -> None:
    faults = faults_of(("RR", Side.SENSOR), ("FL", Side.SENSOR))
    why = explaining(check_of("FR", Check.EXCESS), faults)
    assert why is not None
    assert {f.component for f in why.faults} == {"RR", "FL"}
    own = explaining(check_of("RR", Check.EXCESS), faults)
    assert own is not None
    assert [f.component for f in own.faults] == ["RR"]
    assert not own.of_another


def test_a_small_loss_of_another_wheel_clears_nothing() -> None:
    found = {("RR", "sensor"): assessed(finding(Side.SENSOR, FaultMode.INEFFICIENT, 1000, 3000, epsilon=0.2))}
    why = explaining(check_of("FR", Check.EXCESS), intervals_of(found, haulotte(), HYDRAULIC, 0, 1_000_000))
    assert why is not None
    assert not why.of_another


def test_a_steering_rate_that_changes_in_the_mission_is_compared_with_the_other_axle() -> None:
    check = Checked(Kind.STEER, "front", Side.SENSOR_OR_ACTUATOR, Check.RATE, 0.9, 0.1)
    assert check.text == "the steering rate of the front axle per opening changes by a factor of 2.5 in the mission"
    why = explaining(check, faults_of(("rear", Side.SENSOR)))
    assert why is not None
    assert why.of_another
    assert why.when is When.MISSION
    assert explaining(check, faults_of(("RR", Side.SENSOR))) is None
