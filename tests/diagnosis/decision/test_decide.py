"""A verdict that is never better than what was judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.decision.decide import decide
from diagnosis.decision.decided import Decision
from diagnosis.decision.intervals import intervals_of
from diagnosis.decision.severity import advised
from diagnosis.results.assessment import CODE, Assessment, Finding, unassessed
from diagnosis.results.detectability import Detectable, Deviation, Power, Powers
from diagnosis.results.machine_event import not_following
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.vocabulary import Kind, Tier
from diagnosis.results.wheel_model import WheelModelFit
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from replay.machine.quantities import OPENING
from tests.diagnosis.decision.findings import AXLES, LIMITS, MACHINE, SIDES, STEP, N, assessed, finding, machine


def verdict(
    assessments: dict[tuple[str, str], Assessment],
    decided: float | dict[tuple[str, str], float] = 20.0,
    damage: tuple[str, ...] = (),
    limits: Limits = LIMITS,
    model: WheelModelFit | None = None,
    shown: Sequence[Detectable] = (),
) -> Decision:
    seconds = decided if isinstance(decided, dict) else dict.fromkeys(assessments, decided)
    intervals = intervals_of(assessments, replace(MACHINE, limits=limits), HYDRAULIC, 0, STEP)
    return decide(intervals, assessments, seconds, AXLES, limits, damage, HYDRAULIC, model=model, shown=shown)


def test_healthy_machine_is_ready() -> None:
    got = verdict(machine())
    assert (got.status, got.title) == ("ready", "No fault found")
    assert "20 s of driving" in got.text
    assert got.actions == ()
    assert got.caveats == ()


@pytest.mark.parametrize(
    ("sides", "said"),
    [
        (
            ("sensor", "actuator"),
            "The speed sensor and the drive valve were judged healthy over at least 20 s of driving.",
        ),
        (("sensor",), "The speed sensor was judged healthy over at least 20 s of driving."),
    ],
)
def test_one_wheel_is_not_every_wheel(sides: tuple[str, ...], said: str) -> None:
    one = {part: a for part, a in machine().items() if part[0] == "FR" and part[1] in sides}
    assert verdict(one).text.startswith(said)


@pytest.mark.parametrize(
    ("part", "expected"),
    [
        (finding(Side.ACTUATOR, FaultMode.STUCK), "stop"),
        (finding(Side.ACTUATOR, FaultMode.INEFFICIENT, epsilon=0.5), "watch"),
        (finding(Side.ACTUATOR, FaultMode.NOISY, epsilon=0.1), "watch"),
        (finding(Side.ACTUATOR, FaultMode.STUCK, p=0.7), "watch"),
        (finding(Side.ACTUATOR, FaultMode.STUCK, p=0.5), "ready"),
    ],
)
def test_verdict_follows_the_worst_fault(part: Finding, expected: str) -> None:
    assert verdict(machine(FR_actuator=assessed(part))).status == expected


def test_a_valve_that_is_noisy_or_stuck_does_not_go_out() -> None:
    rows = (
        Hypothesis("actuator", "noisy", 0.5),
        Hypothesis("actuator", "stuck", 0.48),
        Hypothesis("none", "healthy", 0.02),
    )
    shaky = replace(finding(Side.ACTUATOR, FaultMode.NOISY, epsilon=0.4), hypotheses=rows)
    got = verdict(machine(FR_actuator=assessed(shaky)))
    assert (got.status, got.cleared, got.not_cleared) == ("watch", False, "the FR drive valve may not answer")
    assert got.actions[0]["text"].startswith("Before the machine goes out, check the FR drive valve")


def test_parts_that_the_sentence_leaves_out_are_those_to_repair_alone() -> None:
    stuck, weak = (
        assessed(finding(Side.ACTUATOR, FaultMode.STUCK)),
        assessed(finding(Side.SENSOR, FaultMode.INEFFICIENT, epsilon=0.2)),
    )
    stop = {f"{c}_actuator": stuck for c in ("FR", "FL", "front")}
    silent = assessed(finding(Side.SENSOR, FaultMode.NO_SIGNAL))
    all_to_repair = verdict(machine(**stop, FL_sensor=silent))
    assert all_to_repair.text.endswith("; 1 more part is listed below.")
    got = verdict(machine(**stop, FL_sensor=silent, FR_sensor=weak))
    assert got.title == "4 parts to repair, 1 to check"
    assert got.text.endswith("; 1 more part to repair is listed below.")


def test_a_gain_outside_the_tables_is_told_in_the_sentence() -> None:
    got = verdict(machine(FR_sensor=assessed(finding(Side.SENSOR, FaultMode.OUTSIDE_TABLE, epsilon=-0.9))))
    assert got.text == "The FR speed sensor was outside the tables (1.9 times what it should be) for 8.0 s."
    assert got.actions[0]["text"].endswith("outside the tables (1.9 times what it should be) for 8.0 s.")


def test_brief_and_persistent_loss_of_a_sensor() -> None:
    brief = finding(Side.SENSOR, FaultMode.NO_SIGNAL, 5000, 5800)
    assert verdict(machine(FL_sensor=assessed(brief))).status == "watch"
    assert verdict(machine(FL_sensor=assessed(replace(brief, stop=9000)))).status == "stop"


def test_steering_fault_counts_too() -> None:
    got = verdict(machine(front_sensor=assessed(finding(Side.SENSOR, FaultMode.STUCK))))
    assert got.status == "stop"
    assert "front steering sensor" in got.text.lower()


@pytest.mark.parametrize("side", SIDES)
def test_too_little_driving_is_not_assessed(side: str) -> None:
    seconds = dict.fromkeys(machine(), 20.0) | {("FL", side): 9.9}
    got = verdict(machine(), seconds)
    assert got.status == "not_assessed"
    assert HYDRAULIC.part_words("wheel", "FL", side) in got.text
    assert len(got.caveats) == 1
    assert "9.9 s of driving, of 10 s needed" in got.caveats[0]
    assert verdict(machine(), seconds, limits=Limits(min_assessed=9.0)).status == "ready"


def test_side_without_any_decision_is_not_assessed() -> None:
    got = verdict(machine(), {k: 20.0 for k in machine() if k != ("FR", "sensor")})
    assert got.status == "not_assessed"


def test_faults_are_stated_however_little_was_driven() -> None:
    got = verdict(machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.STUCK))), 0.0)
    assert got.status == "stop"
    assert any(c.startswith("Not judged: ") for c in got.caveats)


def test_unjudged_steering_is_said() -> None:
    reason = "steering is judged only where it is measured twice"
    nothing = unassessed(N, State.NOT_ASSESSED, reason)
    got = verdict(machine(front_sensor=nothing, front_actuator=nothing), dict.fromkeys(machine(), 20.0))
    assert got.status == "ready"
    assert got.caveats == (f"Not judged: front steering sensor and front steering valve ({reason}).",)


@pytest.mark.parametrize("decided", [20.0, 0.0])
def test_damaged_log_is_never_ready(decided: float) -> None:
    got = verdict(machine(), decided, damage=("chunk 7 is cut off", "footer is missing"))
    assert got.status != "ready"
    assert "The log is damaged: chunk 7 is cut off (and 1 more)" in got.caveats
    fault = machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.STUCK)))
    assert verdict(fault, damage=("chunk 7 is cut off",)).status == "stop"


def test_every_fault_above_info_has_an_action() -> None:
    parts = machine(
        FR_sensor=assessed(
            finding(Side.SENSOR, FaultMode.NO_SIGNAL, 1000, 1200),
            finding(Side.SENSOR, FaultMode.NO_SIGNAL, 5000, 9000),
            finding(Side.SENSOR, FaultMode.NOISY, 10_000, 11_000, p=0.5),
        ),
        FL_actuator=assessed(finding(Side.ACTUATOR, FaultMode.INEFFICIENT, epsilon=0.4)),
    )
    got = verdict(parts)
    intervals = intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP)
    named = {i for action in got.actions for i in action["faults"]}
    assert named == {f.id for f in intervals if f.severity != "info"}
    assert [a["n"] for a in got.actions] == list(range(1, len(got.actions) + 1))
    assert got.actions[0]["severity"] == "high"
    assert "FR speed sensor" in str(got.actions[0]["text"])
    assert "without signal" in str(got.actions[0]["text"])
    assert got.title == "1 part to repair, 1 to check, in 3 spells"


def test_deviations_that_nothing_explains_give_no_all_clear() -> None:
    parts = machine()
    parts["FR", "actuator"] = replace(parts["FR", "actuator"], unexplained_s=6.0)
    got = decide((), parts, dict.fromkeys(parts, 20.0), AXLES, Limits(), (), HYDRAULIC)
    assert got.status == "not_assessed"
    assert "FR speed sensor or drive valve" in got.text


@pytest.mark.parametrize(("seconds", "status"), [(6.0, "ready"), (12.0, "not_assessed")])
def test_a_steering_valve_that_is_off_for_long_without_a_fault_gives_no_all_clear(seconds: float, status: str) -> None:
    parts = machine()
    parts["front", "actuator"] = replace(parts["FR", "actuator"], unexplained_s=seconds)
    assert decide((), parts, dict.fromkeys(parts, 20.0), AXLES, Limits(), (), HYDRAULIC).status == status


def test_a_fifth_of_the_driving_undecided_gives_no_all_clear() -> None:
    parts = machine()
    driven = dict.fromkeys(parts, 30.0)
    assert (
        decide((), parts, dict.fromkeys(parts, 23.0), AXLES, Limits(), (), HYDRAULIC, driving_s=driven).status
        == "not_assessed"
    )
    assert (
        decide((), parts, dict.fromkeys(parts, 25.0), AXLES, Limits(), (), HYDRAULIC, driving_s=driven).status
        == "ready"
    )


WATCHED = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, epsilon=0.4)


def test_faults_to_watch_are_cleared_only_where_all_else_is_ready() -> None:
    parts = machine(FR_actuator=assessed(WATCHED))
    assert (verdict(parts).cleared, verdict(parts).not_cleared) == (True, "")
    short = verdict(parts, dict.fromkeys(parts, 20.0) | {("FL", "sensor"): 9.9, ("FL", "actuator"): 0.0})
    assert (short.status, short.cleared) == ("watch", False)
    assert short.not_cleared == "1 wheel part was not judged and 1 wheel part was not judged long enough"
    # the count is of those that are listed below: a faulty part is there as its fault
    faulty_too = verdict(parts, dict.fromkeys(parts, 20.0) | dict.fromkeys([("FL", "sensor"), ("FR", "actuator")], 9.9))
    assert faulty_too.not_cleared == "1 wheel part was not judged long enough"
    (listed,) = faulty_too.to_clear
    assert listed.reason.startswith("FL speed sensor: judged for 9.9 s")
    damaged = verdict(parts, damage=("chunk 7 is cut off",))
    assert (damaged.status, damaged.cleared, damaged.not_cleared) == ("watch", False, "the log is damaged")
    half = machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.INEFFICIENT, epsilon=0.6)))
    assert not verdict(half).cleared
    assert verdict(half).not_cleared == "the FR drive valve may have lost up to 61 %"
    assert [f.advice for f in intervals_of(half, MACHINE, HYDRAULIC, 0, STEP)] == [
        "It may have lost up to 61 %: check it before the machine goes out again."
    ]
    assert str(verdict(half).actions[0]["text"]).startswith("Before the machine goes out, check the FR drive valve")
    assert [x.act for x in verdict(half).to_clear] == [
        "check the FR drive valve (F1) and repair what is found, then diagnose the next mission"
    ]
    odd = parts | {("FL", "sensor"): replace(parts["FL", "sensor"], unexplained_s=6.0)}
    assert verdict(odd).not_cleared == "a residual is not explained by any fault"


def test_one_wording_where_a_mission_gives_no_leave_for_other_reasons() -> None:
    """*No reason to stop* and *check* stood below *it must be checked first*."""
    parts = machine(FR_actuator=assessed(WATCHED))
    faults = intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP)
    free, odd = verdict(parts), verdict(parts | {("FL", "sensor"): replace(parts["FL", "sensor"], unexplained_s=6.0)})
    for got, lead, says in (
        (free, "Check the FR", "no reason to stop"),
        (odd, "Before the machine goes out, check the FR", "before the machine goes out"),
    ):
        assert str(got.actions[0]["lead"]).startswith(lead)
        (fault,) = advised(faults, got.status, cleared=got.cleared)
        assert says in fault.advice


def test_a_valve_that_may_not_answer_is_not_cleared() -> None:
    got = verdict(machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.STUCK, p=0.7))))
    assert (got.status, got.cleared, got.not_cleared) == ("watch", False, "the FR drive valve may not answer")
    assert str(got.actions[0]["text"]).startswith("Before the machine goes out, check the FR drive valve")
    assert [x.reason for x in got.to_clear] == ["F1: the FR drive valve may not answer."]


def test_every_reason_against_a_leave_is_in_the_list_once() -> None:
    parts = machine(
        FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.STUCK, p=0.7)),
        FL_sensor=assessed(finding(Side.SENSOR, FaultMode.INEFFICIENT, epsilon=0.6)),
        FL_actuator=assessed(finding(Side.ACTUATOR, FaultMode.NOISY, epsilon=0.6)),
    )
    got = verdict(parts)
    first, second = "the FR drive valve may not answer", "the FL drive valve may follow noise more than its command"
    assert got.not_cleared == f"{first} and {second}; more below"
    reasons = [x.reason.partition(": ")[2] for x in got.to_clear]
    assert sorted(reasons) == [
        "the FL drive valve may follow noise more than its command.",
        "the FL speed sensor may have lost up to 61 %.",
        "the FR drive valve may not answer.",
    ]


def test_why_it_is_not_cleared_names_a_part_once() -> None:
    """With the most that it may have lost; the list of what clears the machine has every fault."""
    losses = [
        finding(Side.ACTUATOR, FaultMode.INEFFICIENT, start, stop, epsilon=e)
        for start, stop, e in ((1000, 2000, 0.55), (5000, 6000, 0.65))
    ]
    got = verdict(machine(FR_actuator=assessed(*losses)))
    assert got.not_cleared == "the FR drive valve may have lost up to 66 %"
    assert [x.fault for x in got.to_clear] == ["F1", "F2"]


def test_only_ready_and_watch_are_ever_cleared() -> None:
    assert verdict(machine()).cleared
    assert not verdict(machine(), 0.0).cleared
    damaged = verdict(machine(), damage=("chunk 7 is cut off",))
    assert not damaged.cleared
    assert "Parts of the log are lost: chunk 7 is cut off." in damaged.text
    assert not verdict(machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.STUCK)))).cleared


def test_no_action_and_no_advice_gives_leave_to_go_out() -> None:
    for side in Side:
        for mode in FaultMode:
            parts = machine(FR_sensor=assessed(finding(side, mode, epsilon=0.5)))
            words = [str(a["text"]) for a in verdict(parts, 0.0).actions]
            words += [f.advice for f in intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP)]
            assert not any("may go out" in w.lower() for w in words)


def test_a_model_of_this_mission_says_what_it_does_not_show() -> None:
    parts = {key: replace(a, tier=Tier.MODEL) for key, a in machine().items()}
    model = WheelModelFit((None,) * 4, 0.02, 30, reliable=True, note="")
    (words,) = verdict(parts, model=model).caveats
    assert "95 of 100" not in words

    def shown(of_sensors: tuple[float | None, ...], of_valves: tuple[float | None, ...]) -> list[Detectable]:
        return [
            Detectable(Kind.WHEEL, w, side, Deviation.INEFFICIENT, 10.0, size, "1", None, 9, side)
            for side, sizes in ((Side.SENSOR, of_sensors), (Side.ACTUATOR, of_valves))
            for w, size in zip(MACHINE.wheels, sizes, strict=True)
        ]

    none = (None,) * 4
    (some,) = verdict(parts, model=model, shown=shown((0.37, None, None, None), none)).caveats
    assert "may begin: on 1 of 2 speed sensors from 37 % on, on the other not; on no drive valve." in some
    (nothing,) = verdict(parts, model=model, shown=shown(none, none)).caveats
    assert "need not show, however large" in nothing
    rows = shown((0.12, 0.31, 0.2, 0.2), (0.4, None, None, 0.4))
    (told,) = verdict(parts, model=model, shown=rows).caveats
    assert (
        "on every speed sensor from 12 to 31 % on (by part); on 1 of 2 drive valves from 40 % on, on the other not."
        in told
    )
    assert verdict(parts, model=replace(model, identified=False)).caveats == ()
    assert verdict(machine(), model=model).caveats == ()


def test_stop_at_once_stands_before_other_stops() -> None:
    got = verdict(
        machine(
            FR_sensor=assessed(finding(Side.SENSOR, FaultMode.STUCK, 0, 9000)),
            FR_actuator=assessed(WATCHED),
            FL_actuator=assessed(finding(Side.ACTUATOR, FaultMode.NO_SIGNAL, 5000, 9000)),
        )
    )
    assert [str(a["text"]).split(" the ")[0] for a in got.actions] == [
        "Stop at once and repair",
        "Stop and repair",
        "Check",
    ]
    assert [a["n"] for a in got.actions] == [1, 2, 3]


def test_the_worst_open_time_is_named_truly() -> None:
    parts = machine()
    driven = dict.fromkeys(parts, 60.0)
    decided = dict.fromkeys(parts, 60.0) | {("FL", "sensor"): 50.0}
    only = decide((), parts, decided, AXLES, LIMITS, (), HYDRAULIC, driving_s=driven)
    assert any("10.0 s of its 60.0 s" in c and "this is the most of all parts of wheels." in c for c in only.caveats)
    worse = decide((), parts, decided | {("FR", "sensor"): 20.0}, AXLES, LIMITS, (), HYDRAULIC, driving_s=driven)
    assert any("FL" in c and "this is the most of all parts of wheels judged long enough." in c for c in worse.caveats)


def test_a_short_drive_is_the_reason_not_the_standstill() -> None:
    states = np.full(N, CODE[State.HEALTHY])
    states[:20_000] = CODE[State.NOT_EXCITED]
    parts = {k: replace(a, states=states, reasons={State.NOT_EXCITED: "nothing moves"}) for k, a in machine().items()}
    got = decide(
        (), parts, dict.fromkeys(parts, 4.7), AXLES, LIMITS, (), HYDRAULIC, driving_s=dict.fromkeys(parts, 5.0)
    )
    (one,) = got.caveats
    assert "FR and FL speed sensor and drive valve" in one
    assert "driven for less than 10 s" in one
    assert "for at least 10 s" in got.text
    states = states.copy()
    states[20_000:25_000] = CODE[State.MASKED]
    reasons = {State.NOT_EXCITED: "nothing moves", State.MASKED: "F1 hides it"}
    parts["FR", "sensor"] = replace(parts["FR", "sensor"], states=states, reasons=reasons)
    seconds = dict.fromkeys(parts, 30.0) | {("FR", "sensor"): 5.0}
    got = decide((), parts, seconds, AXLES, LIMITS, (), HYDRAULIC, driving_s=dict.fromkeys(parts, 30.0))
    assert "F1 hides it" in got.caveats[0]


def test_a_machine_that_did_not_follow_is_neither_ready_nor_at_fault() -> None:
    text = "For 12.0 s all drives stood still together while they were commanded to move."
    event = not_following(text)
    found = decide([], machine(), dict.fromkeys(machine(), 60.0), AXLES, LIMITS, (), HYDRAULIC, events=(event,))
    assert (found.status, found.title) == ("not_assessed", "The machine did not follow its commands")
    assert found.text.startswith(f"{text} To clear it: enable the drives")
    assert not found.cleared


def test_the_sentence_names_parts_in_the_order_of_the_actions_with_what_they_lost() -> None:
    got = verdict(
        machine(
            FR_sensor=assessed(finding(Side.SENSOR, FaultMode.STUCK, 0, 9000)),
            FL_actuator=assessed(
                finding(Side.ACTUATOR, FaultMode.NO_SIGNAL, 5000, 9000),
                finding(Side.ACTUATOR, FaultMode.STUCK, 12_000, 14_000),
                finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 16_000, 19_000, epsilon=0.4),
            ),
        )
    )
    assert got.text == ("The FL drive valve was faulty for 9.0 s in 3 spells; the FR speed sensor was stuck for 9.0 s.")
    assert "without signal for 4.0 s, stuck for 2.0 s" in str(got.actions[0]["text"])
    assert "inefficient (40 % lost, 95 % bounds 39 to 41 %) for 3.0 s" in str(got.actions[0]["text"])


def test_a_part_that_is_two_things_at_once_is_not_faulty_for_longer_than_the_mission() -> None:
    dead = finding(Side.SENSOR, FaultMode.NO_SIGNAL, 3000, 9000)
    off = finding(Side.SENSOR, FaultMode.OUTSIDE_TABLE, 0, 28_000, epsilon=None)
    assert (
        "without signal for 6.0 s and outside the tables for 28.0 s, 6.0 s of it at the same time"
        in verdict(machine(FR_sensor=assessed(dead, off))).text
    )


def test_what_comes_again_and_again_is_one_fault_with_its_course() -> None:
    gaps = [finding(Side.SENSOR, FaultMode.NO_SIGNAL, 1000 * k, 1000 * k + 100) for k in range(1, 8)]
    alone = verdict(machine(FR_sensor=assessed(*gaps)))
    assert alone.title == "1 part to watch, in 7 spells"
    assert alone.text == "The FR speed sensor was without signal for 700 ms in 7 gaps from 1.0 to 7.1 s."
    assert "in 7 gaps from 1.0 to 7.1 s" in str(alone.actions[0]["text"])
    few = verdict(machine(FR_sensor=assessed(*gaps[:2])))
    assert few.title == "1 part to watch, in 2 spells"
    beside = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 3000, 9000, epsilon=0.3)
    both = verdict(machine(FR_sensor=assessed(*gaps), FL_actuator=assessed(beside)))
    assert both.title == "2 parts to watch, in 8 spells"


def test_what_is_unclear_in_several_ways_is_said_once_and_losses_have_bounds() -> None:
    def unclear(start: int, *modes: str) -> Finding:
        rows = [Hypothesis("actuator", mode, 0.9 / len(modes)) for mode in modes]
        found = finding(Side.ACTUATOR, FaultMode.STUCK, start, start + 500)
        return replace(found, hypotheses=(*rows, Hypothesis("none", "healthy", 0.1)))

    parts = (
        unclear(0, "stuck", "inefficient", "noisy"),
        unclear(2000, "stuck", "no_signal", "noisy"),
        finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 9_000, 139_000, epsilon=0.4),
        finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 200_000, 201_000, epsilon=0.5),
    )
    text = str(verdict(machine(FR_actuator=assessed(*parts))).actions[0]["text"])
    assert "faulty, kind unclear for 1.0 s in 2 spells (at 0.0–0.5 and 2.0–2.5 s)" in text
    assert "inefficient (40 to 50 % lost, from fault to fault, 95 % bounds 39 to 51 %) for 2.2 min in 2 spells" in text


def test_a_sensor_that_lost_something_reads_too_little() -> None:
    found = finding(Side.SENSOR, FaultMode.INEFFICIENT, 9_000, 19_000, epsilon=0.47)
    got = verdict(machine(FR_sensor=assessed(found)))
    assert got.text == (
        "The FR speed sensor was inefficient (reads 47 % too little, 95 % bounds 46 to 48 %) for 10.0 s."
    )


def test_where_a_valve_is_stuck_stands_in_the_verdict() -> None:
    def held(start: int, at: float, half: float = 0.01) -> Finding:
        found = finding(Side.ACTUATOR, FaultMode.STUCK, start, start + 2000)
        return replace(found, sat=Sat(at, abs(at), at - half, at + half, OPENING))

    def said(*found: Finding) -> str:
        return verdict(machine(FR_actuator=assessed(*found))).text

    assert said(held(0, 0.341)) == "The FR drive valve was stuck at +34 % of opening (forward) for 2.0 s."
    assert "stuck at +34 % of opening (forward) and −20 % of opening (reverse) for 4.0 s" in said(
        held(0, 0.341), held(5000, -0.2)
    )
    for unknown in ([held(0, 0.3, half=0.2)], [held(k * 5000, 0.1 * k) for k in range(3)]):
        assert "stuck for" in said(*unknown)
    axle = verdict(machine(front_actuator=assessed(held(0, 0.341)))).text
    assert "stuck at +34 % of opening for" in axle


def test_a_loss_of_which_nothing_is_known_has_no_size() -> None:
    vague = replace(finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 9_000, 19_000), epsilon=Epsilon(0.5, 0.0, 1.0))
    text = str(verdict(machine(FR_actuator=assessed(vague))).actions[0]["text"])
    assert "inefficient (how much is lost is not known) for 10.0 s" in text
    assert "50 %" not in text


def test_open_driving_has_the_reason_that_it_has_while_driving() -> None:
    parts = machine()
    driven = dict.fromkeys(parts, 60.0)
    states = np.full(N, CODE[State.HEALTHY])
    states[:9000] = CODE[State.NOT_EXCITED]
    states[9000:9500] = CODE[State.NOT_ASSESSED]
    reasons = {State.NOT_EXCITED: "the valve rests", State.NOT_ASSESSED: "too quick"}
    parts["FL", "actuator"] = replace(assessed(), states=states, reasons=reasons)
    decided = dict.fromkeys(parts, 60.0) | {("FL", "actuator"): 50.0}
    for state, reason in reasons.items():
        got = decide(
            (),
            parts,
            decided,
            AXLES,
            LIMITS,
            (),
            HYDRAULIC,
            driving_s=driven,
            open_state={("FL", "actuator"): state},
        )
        assert any(f"were not judged ({reason})" in c for c in got.caveats)


def test_what_an_all_clear_by_effort_does_not_see_stands_in_its_text() -> None:
    row = Power(Deviation.INEFFICIENT, None, 0.22, "1", 1.0, 1)
    drive = replace(assessed(), tier=Tier.DRIVE, powers=Powers((row,), Side.ACTUATOR))
    got = verdict(machine(FR_actuator=drive))
    assert got.status == "ready"
    assert "lasts the whole mission shows from 22 % of the effort on" in got.text
    assert not any("of the effort on" in c for c in got.caveats)


def test_what_does_not_show_of_sensors_that_are_called_healthy_is_said_with_them() -> None:
    hidden = "A factor would not show in this log."
    parts = machine(FR_sensor=replace(assessed(), hidden=hidden), FL_sensor=replace(assessed(), hidden=hidden))
    got = verdict(parts)
    assert got.text.count("; a factor would not show in this log.") == 1
    assert hidden not in got.caveats
    stuck = verdict(
        parts
        | machine(FR_actuator=assessed(finding(Side.ACTUATOR, FaultMode.STUCK)))
        | {("FL", "sensor"): parts["FL", "sensor"]}
    )
    assert hidden not in stuck.text
    assert stuck.caveats.count(hidden) == 1
