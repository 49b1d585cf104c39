from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.decision.caveats import Reservations
from diagnosis.decision.intervals import intervals_of
from diagnosis.decision.to_clear import to_clear
from diagnosis.results.assessed import Cut, CutKind
from diagnosis.results.assessment import CODE, Assessment, Lack, unassessed
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits, haulotte
from tests.diagnosis.decision.findings import assessed, finding

N = 1000
OPEN = Assessment(np.full(N, CODE[State.NOT_ASSESSED]), {State.NOT_ASSESSED: "it may be either"}, tier=Tier.MODEL)
PARTS = {(w, s): OPEN for w in ("FR", "FL") for s in ("sensor", "actuator")}


def told(against: Reservations, parts: dict[tuple[str, str], Assessment] = PARTS, driven: float = 60.0) -> list[str]:
    rows = to_clear(against, parts, dict.fromkeys(parts, 20.0), dict.fromkeys(parts, driven), ["front"], Limits())
    assert all(row.reason.endswith(".") for row in rows)
    assert not any(row.act.endswith(".") or "{" in row.act for row in rows)
    return [f"{row.reason} {row.act}" for row in rows]


def test_parts_that_are_open_for_the_same_reason_stand_together_with_the_signal_that_decides() -> None:
    (one,) = told(Reservations(short=(("FR", "actuator"), ("FL", "actuator"))))
    assert one.startswith("FR and FL drive valve: judged for 20.0 s of driving, of 48 s needed (it may be either).")
    assert "log wheel.*.u_applied (the valve position)" in one
    (single,) = told(Reservations(short=(("FR", "sensor"),)))
    assert "log wheel.FR.v_true (a second speed)" in single


def test_a_short_drive_is_made_longer() -> None:
    (one,) = told(Reservations(short=tuple(PARTS)), driven=5.0)
    assert "move the machine faster than 0.05 m/s for at least 10 s" in one


def test_what_hides_a_part_is_repaired_first() -> None:
    hidden = replace(OPEN, states=np.full(N, CODE[State.MASKED]), reasons={State.MASKED: "the sensor is dead"})
    (one,) = told(Reservations(short=(("FR", "actuator"),)), {**PARTS, ("FR", "actuator"): hidden})
    assert "repair the speed sensor first" in one


def test_an_axle_that_was_hardly_steered_keeps_none_in_and_yet_says_what_has_it_judged() -> None:
    rested = replace(OPEN, states=np.full(N, CODE[State.NOT_EXCITED]), reasons={State.NOT_EXCITED: "not steered"})
    parts = {**PARTS, ("front", "actuator"): rested}
    of_wheels = (("FR", "sensor"),)
    first, last = told(Reservations(short=of_wheels, open_state={("front", "actuator"): State.NOT_EXCITED}), parts)
    assert first.startswith("FR speed sensor")
    assert last.startswith("front steering valve: judged for 20.0 s of driving, of 48 s needed (not steered).")
    assert last.endswith("steer from stop to stop several times while driving")


def test_what_deviates_most_comes_first_and_before_what_is_not_shown() -> None:
    checks = [
        Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.EXCESS, None, 0.1),
        Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.RESPONSE, 0.2, 0.1, 1.0, 4.0),
        Checked(Kind.WHEEL, "FL", Side.SENSOR_OR_ACTUATOR, Check.RESPONSE, 0.7, 0.1, 1.0, 4.0),
    ]
    (one,) = told(Reservations(open=tuple(checks)))
    first, second = one.split("; ")[:2]
    assert "FL" in first
    assert "FR" in second
    assert "is 18 % below" in second


def test_of_many_open_checks_each_component_has_one_line() -> None:
    checks = [
        Checked(Kind.WHEEL, w, Side.SENSOR_OR_ACTUATOR, check, worst, 0.1, 1.0, 4.0)
        for w in ("FR", "FL")
        for check, worst in ((Check.RESPONSE, 0.4), (Check.EXCESS, 0.2))
    ]
    (one,) = told(Reservations(open=tuple(checks)))
    assert "is 33 % below the other wheels' at 1.0–4.0 s" in one
    assert "22 %" not in one
    assert "hand tachometer" in one


def test_what_deviates_while_a_fault_lasts_is_told_as_its_possible_doing() -> None:
    parts = {("RR", "actuator"): assessed(finding(Side.ACTUATOR, FaultMode.STUCK, 1000, 3000))}
    faults = intervals_of(parts, haulotte(), HYDRAULIC, 0, 1_000_000)
    part = (Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.RESPONSE, 0.4, 0.1)
    during, after, lasting = (Checked(*part, a, b) for a, b in ((2.0, 5.0), (4.2, 7.2), (None, None)))
    rows = to_clear(Reservations(open=(during,)), PARTS, {}, {}, [], Limits(), faults)
    assert rows[0].reason.startswith("Explained by F1, the RR drive valve, at its time: the speed of FR per opening is")
    assert rows[0].reason.endswith(" This speaks against no part of FR, and clears none.")
    own = replace(during, component="RR")
    first, second = to_clear(Reservations(open=(during, own)), PARTS, {}, {}, [], Limits(), faults)
    assert first.reason == rows[0].reason
    assert second.reason.startswith("At the time of F1, which may explain it: the speed of RR per opening is")
    assert rows[0].act == "repair the RR drive valve (F1), then diagnose the next mission"
    for check in (after, lasting):
        (row,) = to_clear(Reservations(open=(check,)), PARTS, {}, {}, [], Limits(), faults)
        assert "F1" not in row.reason + row.act


def test_one_axle_against_the_other_over_the_mission_may_be_the_doing_of_a_fault_of_either() -> None:
    parts = {("rear", "actuator"): assessed(finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 1000, 3000, epsilon=0.6))}
    faults = intervals_of(parts, haulotte(), HYDRAULIC, 0, 1_000_000)
    front = Checked(Kind.STEER, "front", Side.SENSOR_OR_ACTUATOR, Check.LASTING_RATE, 0.3, 0.17)
    rows = to_clear(Reservations(open=(front,)), PARTS, {}, {}, [], Limits(), faults)
    (row,) = (r for r in rows if "steering rate" in r.reason)
    assert row.reason.startswith("Explained by F1, the rear steering valve: the steering rate of the front axle")
    assert row.reason.endswith("against no part of the front axle, and clears none.")
    assert "rear steering valve (F1)" in row.act


def test_what_deviates_after_a_fault_is_told_so_and_an_angle_that_jumps_then_is_not_its_doing() -> None:
    parts = {("RR", "actuator"): assessed(finding(Side.ACTUATOR, FaultMode.STUCK, 1000, 3000))}
    faults = intervals_of(parts, haulotte(), HYDRAULIC, 0, 1_000_000)
    wheel, times = (Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR), (3.2, 4.2)
    less, more = (Checked(*wheel, c, x, 0.1, *times) for c, x in ((Check.RESPONSE, 0.4), (Check.EXCESS, 0.9)))
    (row,) = to_clear(Reservations(open=(less, more)), PARTS, {}, {}, [], Limits(), faults)
    assert row.reason == (
        "Explained by F1, the RR drive valve, just after it: the speed of FR per opening is 2.5 times the other wheels' at 3.2–4.2 s. "
        "This speaks against no part of FR, and clears none."
    )  # of one wheel the check that is furthest beyond its limit, not two measures of one thing
    jump = Checked(Kind.STEER, "front", Side.SENSOR, Check.JUMP, 0.02, 0.01, 3.2, 3.4)
    (row,) = to_clear(Reservations(open=(jump,)), PARTS, {}, {}, [], Limits(), faults)
    assert "F1" not in row.reason + row.act


def test_a_speed_that_jumps_asks_for_its_sensor_and_for_no_other_wheel() -> None:
    (one,) = told(Reservations(open=(Checked(Kind.WHEEL, "FR", Side.SENSOR, Check.ROUGHNESS, 0.4, 0.15, 1.0, 4.0),)))
    assert "check the connector, the cable and the target of the speed sensor" in one
    assert "tachometer" not in one


def test_several_faults_that_may_be_the_cause_are_named_together_each_with_its_remedy() -> None:
    parts = {(w, "sensor"): assessed(finding(Side.SENSOR, FaultMode.STUCK, 1000, 3000)) for w in ("RR", "RL")}
    faults = intervals_of(parts, haulotte(), HYDRAULIC, 0, 1_000_000)
    more = Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.EXCESS, 0.9, 0.1, 1.5, 4.0)
    (row,) = to_clear(Reservations(open=(more,)), PARTS, {}, {}, [], Limits(), faults)
    assert row.reason.startswith(
        "Explained by F1 (RL speed sensor) and F2 (RR speed sensor), at their time: the speed of FR"
    )
    assert row.act.startswith("repair the RL speed sensor (F1) and the RR speed sensor (F2), then")


def test_a_log_without_commands_asks_for_them_first() -> None:
    first, *_ = told(Reservations(short=tuple(PARTS), uncommanded=True))
    assert first.startswith("No command is in the log")
    assert "record the commands as well (/cmd_vel of a ROS robot" in first


def test_commands_that_are_rarely_sent_are_asked_for_where_something_was_not_judged() -> None:
    rare = ("wheel.FR.u comes rarely", "add on_change = true")
    first, *_ = told(Reservations(short=tuple(PARTS), rarely_sent=rare))
    assert first.startswith("wheel.FR.u comes rarely.")
    assert "add on_change = true, and diagnose again" in first
    assert told(Reservations(rarely_sent=rare)) == []


def test_what_the_yaw_rate_shows_of_either_axle_is_said_once() -> None:
    checks = [
        Checked(Kind.STEER, axle, Side.SENSOR_OR_ACTUATOR, Check.YAW, 0.54, 0.06, 53.0, 56.0)
        for axle in ("front", "rear")
    ]
    (one,) = told(Reservations(open=tuple(checks)))
    assert "the front or rear axle" in one
    assert one.count("at 53.0–56.0 s") == 1


def test_unjudged_steering_has_one_reason() -> None:
    axle = {
        ("front", s): unassessed(N, State.NOT_ASSESSED, "nothing of it is in the log", Lack.SIGNALS)
        for s in ("sensor", "actuator")
    }
    (one,) = told(
        Reservations(scope=(Cut(CutKind.STEERING, ("front",), "the front steering was not judged"),)), {**PARTS, **axle}
    )
    assert "front steering sensor and front steering valve (nothing of it is in the log)" in one
    assert "log steer.*.phi" in one


def test_an_axle_that_was_hardly_steered_is_named_with_what_to_do() -> None:
    still = replace(OPEN, states=np.full(N, CODE[State.NOT_EXCITED]), reasons={State.NOT_EXCITED: "not steered"})
    (one,) = told(Reservations(), {("front", "actuator"): still})
    assert one.startswith("front steering valve: judged for 20.0 s of driving, of 48 s needed (not steered).")
    assert "steer from stop to stop" in one


def test_an_axle_that_was_hardly_steered_has_one_reason_and_one_remedy() -> None:
    """What has its parts judged lets its checks pass, so that these ask for nothing else."""
    nothing = unassessed(N, State.NOT_ASSESSED, "the axle was steered too little")
    parts = PARTS | {("front", s): nothing for s in ("sensor", "actuator")}
    still = Checked(Kind.STEER, "front", Side.ACTUATOR, Check.SECOND_MEASUREMENT, None, 0.1)
    (one,) = told(Reservations(open=(still,)), parts)
    assert one.startswith(
        "Not judged: front steering sensor and front steering valve (the axle was steered too little)."
    )
    assert one.endswith("twice at standstill and several times while driving, with the log running")
    deviates = replace(still, worst=0.5)
    assert len(told(Reservations(open=(deviates,)), parts)) == 2, "what deviates has a reason of its own"


def test_what_several_wheels_leave_unexplained_sends_nobody_to_healthy_parts() -> None:
    for wheels, act in (
        (("FR",), "inspect these parts, and log "),
        (("FR", "FL"), "log wheel.*.v_true (a second speed)"),
    ):
        rows = to_clear(Reservations(unexplained=tuple((w, "sensor") for w in wheels)), PARTS, {}, {}, [], Limits())
        (row,) = (r for r in rows if "no single fault explains" in r.reason)
        assert row.act.startswith(act)
        assert ("parts fail one at a time" in row.act) is (len(wheels) > 1)


def test_a_faulty_part_is_not_listed_as_judged_too_briefly() -> None:
    """The fault is what is to be checked of it."""
    parts = {("FR", "sensor"): assessed(finding(Side.SENSOR, FaultMode.INEFFICIENT, 1000, 3000, epsilon=0.3))}
    faults = intervals_of(parts, haulotte(), HYDRAULIC, 0, 1_000_000)
    about = Reservations(short=(("FR", "sensor"), ("FL", "sensor")))
    for found, named in ((faults, {("FL", "sensor")}), ((), {("FR", "sensor"), ("FL", "sensor")})):
        rows = to_clear(about, PARTS, {}, {}, [], Limits(), found)
        assert {part for row in rows for part in row.parts} == named
    (row,) = to_clear(Reservations(short=(("FR", "sensor"),)), PARTS, {}, {}, [], Limits(), faults)
    assert row.parts == (("FR", "sensor"),)  # else nobody would be told what clears the machine


def test_nobody_is_asked_to_log_what_is_in_the_log() -> None:
    """All speeds at once leave what neither measurement decides."""
    speeds = frozenset({("FR", "sensor"), ("FL", "sensor")})
    for twice, asked in ((frozenset(), "v_true"), (speeds, "u_applied"), (frozenset(PARTS), "a third one")):
        against = Reservations(unexplained=(("FR", "sensor"), ("FL", "sensor")), twice=frozenset(twice))
        (one,) = told(against)
        assert asked in one
        assert ("v_true" in one) is (not twice)
        check = Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.RESPONSE, 0.4, 0.1, 1.0, 4.0)
        (open_,) = told(Reservations(open=(check,), twice=frozenset(twice)))
        assert ("v_true" in open_) is (not twice)


def test_a_valve_that_is_off_its_command_is_not_sent_to_a_tachometer() -> None:
    for kind, part, side, asked in (
        (Kind.WHEEL, "FR", Side.SENSOR, "hand tachometer"),
        (
            Kind.WHEEL,
            "FR",
            Side.ACTUATOR,
            "give the valve a few steady commands and compare each with the valve position",
        ),
        (Kind.STEER, "front", Side.SENSOR, "protractor"),
        (Kind.STEER, "front", Side.ACTUATOR, "compare each with the valve position"),
    ):
        check = Checked(kind, part, side, Check.SECOND_MEASUREMENT, 0.4, 0.1, 1.0, 4.0)
        (row,) = to_clear(Reservations(open=(check,)), PARTS, {}, {}, [], Limits())
        assert asked in row.act
        assert ("tachometer" in row.act) is (asked == "hand tachometer")


def test_what_a_faulty_part_is_off_at_another_time_goes_with_its_fault() -> None:
    parts = {("RR", "actuator"): assessed(finding(Side.ACTUATOR, FaultMode.STUCK, 1000, 3000))}
    faults = intervals_of(parts, haulotte(), HYDRAULIC, 0, 1_000_000)
    check = Checked(Kind.WHEEL, "RR", Side.ACTUATOR, Check.SECOND_MEASUREMENT, 0.4, 0.1, 9.0, 12.0)
    (row,) = to_clear(Reservations(open=(check,)), PARTS, {}, {}, [], Limits(), faults)
    assert row.reason.startswith("Of the same part as F1, which may explain it: the RR drive valve is off its second")
    assert row.act == "repair the RR drive valve (F1), then diagnose the next mission"
    other = replace(check, side=Side.SENSOR)
    (row,) = to_clear(Reservations(open=(other,)), PARTS, {}, {}, [], Limits(), faults)
    assert "F1" not in row.reason + row.act


def test_a_wheel_of_which_no_model_was_found_is_driven_more_and_its_command_is_not_asked_for() -> None:
    silent = unassessed(N, State.NOT_ASSESSED, "no model of the wheels could be found in this mission", Lack.ANSWER)
    parts = {("FR", "sensor"): silent, ("FR", "actuator"): silent}
    for part, other in ((("FR", "sensor"), "v_true"), (("FR", "actuator"), "u_applied")):
        (row,) = to_clear(Reservations(short=(part,)), parts, {}, dict.fromkeys(parts, 60.0), [], Limits())
        assert row.act.startswith("drive for a minute and longer with several speeds")
        assert f"or log wheel.FR.{other}" in row.act
