"""What keeps a machine from being cleared though no fault is stated."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from diagnosis.decision.decide import decide
from diagnosis.decision.decided import Decision
from diagnosis.decision.intervals import intervals_of
from diagnosis.results.assessed import Cut, CutKind
from diagnosis.results.assessment import Assessment
from diagnosis.results.clearing import CHECK_WORDS, Check, Checked, clearing_rows
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Kind
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.decision.findings import AXLES, LIMITS, MACHINE, STEP, assessed, finding, machine

_BEYOND = Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.RESPONSE, 0.62, 0.3, 12.0, 15.0, 0.33)
_WITHIN = replace(_BEYOND, worst=0.1)
_UNSHOWN = Checked(Kind.STEER, "front", Side.SENSOR_OR_ACTUATOR, Check.LASTING_RATE, None, 0.3)


def verdict(assessments: dict[tuple[str, str], Assessment], limits: Limits = LIMITS, **more: Any) -> Decision:
    intervals = intervals_of(assessments, replace(MACHINE, limits=limits), HYDRAULIC, 0, STEP)
    return decide(intervals, assessments, dict.fromkeys(assessments, 20.0), AXLES, limits, (), HYDRAULIC, **more)


def test_a_check_beyond_its_limit_clears_nothing() -> None:
    got = verdict(machine(), checks=(_WITHIN, _BEYOND))
    assert (got.status, got.cleared, got.title) == ("not_assessed", False, "No fault found, not cleared")
    assert "the speed of FR per opening is 46 % below the other wheels' at 12.0–15.0 s" in got.text
    assert verdict(machine(), checks=(_WITHIN,)).status == "ready"


def test_what_the_mission_does_not_show_clears_nothing() -> None:
    got = verdict(machine(), checks=(_UNSHOWN, _BEYOND))
    assert "46 % below" in got.text  # what deviates is said before what is not shown
    assert "other checks of the all-clear are open" in got.text
    (alone,) = verdict(machine(), checks=(_UNSHOWN,)).to_clear
    assert alone.reason.startswith("Front steering sensor or valve: ")


def test_faults_to_watch_are_not_cleared_beside_an_open_check() -> None:
    parts = machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.INEFFICIENT, epsilon=0.3)))
    assert verdict(parts, checks=(_WITHIN,)).cleared
    got = verdict(parts, checks=(_BEYOND,))
    assert (got.status, got.cleared) == ("watch", False)
    assert "46 %" in got.not_cleared


def test_what_a_fault_to_watch_explains_of_other_parts_is_no_suspicion_against_them() -> None:
    loss = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, epsilon=0.6)
    parts = machine(FR_actuator=assessed(loss))
    (fault,) = intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP)
    beside = replace(_BEYOND, component="RL", start_s=fault.start_s, stop_s=fault.stop_s)
    got = verdict(parts, checks=(beside,))
    assert (fault.severity, got.cleared) == ("medium", False)
    assert "46 %" not in got.not_cleared
    assert "beside a fault nothing shows whether RL is healthy" in got.not_cleared


def test_what_a_faulty_part_is_off_at_another_time_is_no_second_reason() -> None:
    """*It may have lost up to 61 % and is off its second measurement by 44 %* was said of one valve; a small loss alone is still not enough."""
    check = Checked(Kind.WHEEL, "FR", Side.ACTUATOR, Check.SECOND_MEASUREMENT, 0.44, 0.25, 12.0, 15.0)
    large, small = (
        verdict(
            machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.INEFFICIENT, epsilon=e))), checks=(check,)
        )
        for e in (0.6, 0.2)
    )
    assert (large.cleared, small.cleared) == (False, False)
    assert "44 %" not in large.not_cleared
    assert "lost up to" in large.not_cleared
    assert "44 %" in small.not_cleared


def test_a_part_of_a_mission_clears_nothing() -> None:
    got = verdict(machine(), scope=(Cut(CutKind.LOG, (), "only 29.5 s of 60.0 s of the log were judged"),))
    assert (got.status, got.cleared) == ("not_assessed", False)
    assert "29.5 s of 60.0 s" in got.text


def test_limits_that_clear_more_are_named() -> None:
    got = verdict(machine(), limits=Limits(min_epsilon=0.9, min_assessed=0.0))
    (line,) = [c for c in got.caveats if "limits" in c]
    assert "min_epsilon = 0.9 (0.1 is usual)" in line
    assert "min_assessed = 0 (10 is usual)" in line
    assert not verdict(machine(), limits=Limits(min_epsilon=0.05)).caveats


def test_an_offset_that_nothing_would_show_is_said() -> None:
    rate = replace(_UNSHOWN, worst=0.1)
    yaw = replace(rate, check=Check.LASTING_YAW, worst=0.01, limit=0.04)
    hidden = verdict(machine(), checks=(rate,))
    assert "a yaw rate (imu.yaw_rate) would show it" in hidden.text
    assert not hidden.caveats
    assert any("yaw rate" in c for c in verdict(machine(), checks=(rate, _BEYOND)).caveats)
    shown = verdict(machine(), checks=(rate, yaw))
    assert "yaw rate" not in shown.text
    assert not shown.caveats


def test_what_all_axles_lose_is_said_where_they_are_held_against_each_other_alone() -> None:
    beside = replace(_UNSHOWN, check=Check.LASTING_RATE, worst=0.01, limit=0.17)
    plant, twice = (
        replace(beside, check=Check.PLANT_RATE),
        replace(beside, check=Check.SECOND_MEASUREMENT, side=Side.ACTUATOR),
    )
    said = [verdict(machine(), checks=(beside, *more)).text for more in ((), (plant,), (twice,))]
    assert ["What all steering valves lose from start to end" in text for text in said] == [True, False, False]


def test_steering_that_was_judged_for_part_of_the_driving_is_said_beside_ready() -> None:
    parts = machine()
    decided = {part: 20.0 if part != ("front", "actuator") else 11.0 for part in parts}
    got = decide(
        (), parts, decided, AXLES, LIMITS, (), HYDRAULIC, driving_s=dict.fromkeys(parts, 20.0), checks=(_WITHIN,)
    )
    assert got.status == "ready"
    assert "The front steering valve was judged for 11 of 20 s only" in got.text
    assert "the checks of its axle over the whole mission passed" in got.text
    whole = decide(
        (), parts, dict.fromkeys(parts, 20.0), AXLES, LIMITS, (), HYDRAULIC, driving_s=dict.fromkeys(parts, 20.0)
    )
    assert "only" not in whole.text


@pytest.mark.parametrize("check", list(Check))
def test_every_check_has_words(check: Check) -> None:
    one = Checked(Kind.WHEEL, "FR", Side.SENSOR, check, 0.5, 0.1)
    (row,) = clearing_rows([one])
    assert row["asked"] == HYDRAULIC.fill(CHECK_WORDS[check][0])
    assert "{" not in row["text"]
    assert not row["passed"]


@pytest.mark.parametrize(
    ("check", "worst", "words"),
    [
        (Check.RESPONSE, 0.62, "the speed of FR per opening is 46 % below the other wheels'"),
        (
            Check.LASTING_RESPONSE,
            6.9,
            "the speed of FR per opening is over 99 % below the other wheels' over the mission",
        ),
        (Check.EXCESS, 0.4, "the speed of FR per opening is 49 % above the other wheels'"),
        (Check.EXCESS, 3.15, "the speed of FR per opening is 23.3 times the other wheels'"),
        (Check.RATE, 0.5, "the steering rate of the FR axle per opening changes by a factor of 1.65 in the mission"),
        (
            Check.TRACKING,
            1.78,
            "the error of FR against its commanded speed exceeds the other wheels' by 178 % of that speed",
        ),
        (Check.ROUGHNESS, 0.2, "the speed of FR changes quickly, in the mean of 3 s by 20 % of itself"),
    ],
)
def test_ratios_are_told_as_such_and_nothing_is_below_by_more_than_all(check: Check, worst: float, words: str) -> None:
    assert Checked(Kind.WHEEL, "FR", Side.SENSOR, check, worst, 0.1).text == words


def test_what_stands_out_by_far_is_named_in_the_reason_of_a_mission_that_was_not_judged_long_enough() -> None:
    far = Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.LASTING_RESPONSE, 1.7, 0.33)
    near = replace(far, component="FL", worst=0.5)
    short = replace(LIMITS, min_assessed=60.0)
    told = verdict(machine(), short, checks=(near, far))
    assert told.title == "Not judged long enough"
    assert (
        "healthy, and the speed of FR per opening is 82 % below the other wheels' over the mission. To clear"
        in told.text
    )
    assert "per opening" not in verdict(machine(), short, checks=(near,)).text


@pytest.mark.parametrize(("worst", "said"), [(0.002, "less than 1 % below"), (0.03, "3 % below")])
def test_no_share_of_nothing_is_told(worst: float, said: str) -> None:
    check = Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.LASTING_RESPONSE, worst, 0.001)
    assert said in check.text
