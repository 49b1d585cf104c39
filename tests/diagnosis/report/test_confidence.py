"""How sure the tool is, in words."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.report.confidence import (
    going_out,
    headline,
    judged,
    judged_means,
    percent,
    sure_of,
    sure_of_action,
    sure_of_verdict,
)
from diagnosis.report.tables import clearing_sentences
from diagnosis.results.document import IntervalRow, ReportDocument
from tests import report_samples as samples


def fault(p: float, **changes: Any) -> IntervalRow:
    own = {
        "side": "actuator",
        "tier": "direct",
        "probability": p,
        "hypotheses": [
            {"side": "actuator", "mode": "stuck", "p": p},
            {"side": "none", "mode": "healthy", "p": 0.0},
        ],
    }
    return samples.fault(**(own | changes))


def row(side: str, decided_s: float, component: str = "FR", tier: str = "direct") -> dict[str, Any]:
    return {
        "component": component,
        "side": side,
        "tier": tier,
        "seconds": {"healthy": decided_s},
        "driving_s": 100.0,
        "decided_driving_s": decided_s,
    }


@pytest.mark.parametrize(
    ("p", "words"),
    [(0.9999, "over 99.9 %"), (0.99, "99.0 %"), (0.95, "95.0 %"), (0.5, "50 %"), (0.896, "89.6 %")],
)
def test_no_certainty_that_is_not_there(p: float, words: str) -> None:
    assert percent(p) == words


def test_what_the_position_of_a_joint_shows_is_no_want_of_a_second_measurement() -> None:
    own = fault(0.96, side="sensor", tier="response", evidence=["It is 0.5 × what wheel.FR.v_position shows."])
    said = sure_of(own, samples.report_with(coverage=[]))
    assert said.endswith("against what the position of its own joint shows of the same speed")
    assert "without a second measurement" in sure_of({**own, "evidence": ["."]}, samples.report_with(coverage=[]))


def test_phrase_of_a_fault() -> None:
    report = samples.report_with(coverage=[row("actuator", 91.0), row("sensor", 100.0)])
    assert "Very likely (98 %, the highest that is ever stated), measured" in sure_of(fault(0.98), report)
    nothing = samples.report_with(coverage=[])
    assert sure_of(fault(0.995), report) == (
        "Practically certain (99.5 %), measured against the valve position; 91 % of its driving was judged"
    )
    unlike = samples.report_with(coverage=[row("actuator", 10.0), row("sensor", 98.0)])
    assert sure_of(fault(0.995, side="sensor_or_actuator"), unlike).endswith(
        "its speed sensor was judged for 98 % of the driving and its drive valve was judged for 10 % of the driving"
    )
    # certainly faulty, the row less so
    words = sure_of(fault(0.49, hypotheses=[{"side": "actuator", "mode": "stuck", "p": 0.49}]), nothing)
    assert words.startswith("Practically certain faulty (over 99.9 %), most likely stuck (49 %)")
    rows = [
        {"side": "actuator", "mode": m, "p": p} for m, p in (("inefficient", 0.35), ("stuck", 0.21), ("noisy", 0.44))
    ]
    assert sure_of(fault(0.21, hypotheses=rows), nothing).startswith(
        "Practically certain faulty (over 99.9 %), perhaps stuck (21 %)"
    )
    assert sure_of(fault(0.75, tier="model"), nothing).endswith("by the wheel model, not by a second measurement")


def test_both_sides_count_where_they_are_not_told_apart() -> None:
    report = samples.report_with(coverage=[row("actuator", 40.0), row("sensor", 100.0)])
    assert "for 100 % of the driving and its drive valve was judged for 40 % of the driving" in sure_of(
        fault(0.99, side="sensor_or_actuator", tier="tracking"), report
    )


def test_a_fault_of_a_part_that_was_hardly_judged_may_last_for_longer() -> None:
    def words(*rows: dict[str, Any], side: str = "actuator") -> str:
        return sure_of(fault(0.93, side=side), samples.report_with(coverage=list(rows)))

    assert words(row("actuator", 0.0)).endswith(
        "the rest of its driving was not judged, so that it may be faulty for longer"
    )
    assert words(row("actuator", 23.0)).endswith(
        "only 23 % of its driving was judged, so that it may be faulty for longer"
    )
    both = words(row("actuator", 0.0), row("sensor", 100.0), side="sensor_or_actuator")
    assert both.endswith("its speed sensor was judged for 100 % of the driving and its drive valve was not judged")


def test_phrase_of_a_verdict() -> None:
    done = samples.report_with(coverage=[row("sensor", 98.0), row("actuator", 90.0, tier="model")])
    del done["verdict"]["to_clear"]
    assert sure_of_verdict(done) == (
        "All 2 wheel parts were judged, each for at least 90 % of its driving, by second measurements and a model of the "
        "wheels."
    )
    assert judged(done) == "2 of 2 parts judged, none cleared, for this report does not say what is open"
    short = samples.report_with(coverage=[row("sensor", 98.0), row("actuator", 0.0, tier="none")])
    assert sure_of_verdict(short).startswith("1 of 2 wheel parts were judged long enough")
    assert sure_of_verdict(samples.report_with(coverage=[])) == ""


def with_verdict(status: str, **verdict: Any) -> ReportDocument:
    return samples.report_with(verdict={"status": status, **verdict})


def test_leave_to_go_out_is_given_only_where_nothing_stands_against_it() -> None:
    leave = ("Ready, with faults to watch", "may go out")
    assert headline(with_verdict("watch", cleared=True, not_cleared="")) == leave
    assert headline(with_verdict("watch", cleared=False, not_cleared="the log is damaged")) == (
        "Faults to watch",
        "check before it goes out: the log is damaged",
    )
    assert headline(with_verdict("stop")) == ("Stop and repair", "must not go out before repair")
    assert headline(with_verdict("ready")) == ("Ready for the next mission", "")
    assert headline(with_verdict("not_assessed")) == ("Not assessed", "check before it goes out")


def test_a_mission_that_judged_every_wheel_part_is_not_called_unassessed() -> None:
    """*Not assessed* stood above *all 8 wheel parts were judged*; the status in report.json stays."""
    for share, words in ((90.0, "Not cleared"), (10.0, "Not assessed")):
        rows = [row("sensor", 98.0), row("actuator", share)]
        report = samples.report_with(coverage=rows, verdict={"status": "not_assessed"})
        assert headline(report) == (words, "check before it goes out")


def test_what_the_verdict_says_with_its_remedy_stands_once() -> None:
    point = {"reason": "The speed of FR is low.", "act": "lift the machine", "parts": [], "fault": "", "why": ""}
    said = "This mission does not exclude one: the speed of FR is low. To clear it: lift the machine."
    verdict = {"text": said, "to_clear": [point], "actions": []}
    assert clearing_sentences(verdict) == []  # type: ignore[arg-type]
    other = {**verdict, "text": "No fault was identified."}
    assert clearing_sentences(other) == [("The speed of FR is low.", "lift the machine")]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("status", "more", "answer"),
    [
        ("stop", {}, ("No", ", not before repair")),
        ("watch", {"cleared": False, "not_cleared": "the log is damaged"}, ("No", ", it must be checked first: the log is damaged")),
        ("not_assessed", {}, ("No", ", it must be checked first")),
        ("watch", {"cleared": True, "not_cleared": ""}, ("Yes", "; the faults to watch are no reason to keep it in")),
        ("ready", {"cleared": True}, ("Yes", "")),
    ],
)  # fmt: skip
def test_the_page_says_plainly_whether_the_machine_may_go_out_again(
    status: str, more: dict[str, Any], answer: tuple[str, str]
) -> None:
    assert going_out(with_verdict(status, **({"cleared": False, "not_cleared": ""} | more))) == answer


def test_parts_that_were_judged_and_those_that_were_cleared_are_counted_apart() -> None:
    """What has a fault, or is named in what is open, is judged and not cleared."""
    rows = [row(side, 100.0, wheel) for wheel in ("FR", "FL") for side in ("sensor", "actuator")]
    watched = samples.fault(component="FR", side="sensor", severity="low")
    about = {"status": "watch", "cleared": True, "to_clear": []}
    found = samples.report_with(coverage=rows, intervals=[watched], verdict=about)
    assert judged(found) == "4 of 4 parts judged, 3 cleared"
    own = {"reason": "F1: the FR speed sensor may have lost up to 51 %.", "act": "check it", "fault": "F1"}
    about["to_clear"] = [own | {"parts": [{"component": "FR", "side": "sensor"}]}]
    assert judged(samples.report_with(coverage=rows, intervals=[watched], verdict=about)) == (
        "4 of 4 parts judged, 3 cleared"
    )
    either = [
        {"side": "sensor", "mode": "inefficient", "p": 0.6},
        {"side": "actuator", "mode": "inefficient", "p": 0.35},
    ]
    unclear = watched | {"hypotheses": either}
    assert judged(samples.report_with(coverage=rows, intervals=[unclear], verdict=about)) == (
        "4 of 4 parts judged, 2 cleared"  # the valve may be it as well
    )
    fl = [{"component": "FL", "side": side} for side in ("actuator", "sensor")]
    about["to_clear"] = [
        {"reason": "The speed of FL per opening is 30 % below the others'.", "act": "lift it", "parts": fl}
    ]
    assert judged(samples.report_with(coverage=rows, intervals=[watched], verdict=about)) == (
        "4 of 4 parts judged, 1 cleared"
    )
    for reason, parts, cleared in (
        ("Not judged: FL drive valve (its command is not logged).", fl[:1], 2),  # the sensor beside it is not named
        ("FL speed sensor or drive valve: no single fault explains the residual.", fl, 1),
    ):
        about["to_clear"] = [{"reason": reason, "act": "log it", "parts": parts}]
        assert judged(samples.report_with(coverage=rows, intervals=[watched], verdict=about)) == (
            f"4 of 4 parts judged, {cleared} cleared"
        )
    about["to_clear"] = [{"reason": "Several wheels swing together.", "act": "lower the gains", "parts": []}]
    assert judged(samples.report_with(coverage=rows, intervals=[watched], verdict=about)) == (
        "4 of 4 parts judged, none cleared, for something about the machine as a whole, or its log, is open, as said above"
    )
    brief = samples.report_with(coverage=[row("sensor", 20.0)], verdict=about)
    assert judged(brief).startswith("0 of 1 parts judged, none cleared, for none was judged long enough;")
    assert judged_means(found).startswith("Judged: decided, healthy or faulty, for at least ")
    assert judged_means(samples.report_with(coverage=[])) == ""


@pytest.mark.parametrize(
    ("tier", "logged", "how"),
    [
        ("signal", ("phi",), "from the channel alone"),
        ("signal", ("phi", "phi_true"), "by the steering model with a second angle sensor"),
        ("model", ("phi", "phi_true"), "by the steering model with a second angle sensor"),
        ("model", ("phi", "u"), "by the steering model, not by a second measurement"),
    ],
)
def test_a_second_angle_that_the_steering_model_weighed_is_named(tier: str, logged: tuple[str, ...], how: str) -> None:
    (one, *_) = samples.five_faults()[0]["signals"]
    report = samples.report_with(signals=[one | {"name": f"steer.front.{leaf}"} for leaf in logged])
    stuck = fault(0.93) | {"component": "front", "kind": "steer", "side": "sensor", "tier": tier}
    assert how in sure_of(stuck, report)  # type: ignore[arg-type]


def test_drives_without_a_command_in_the_log_answer_none() -> None:
    coverage = [row(side, 100.0) | {"tier": "response"} for side in ("sensor", "actuator")]
    assert "answer their commands" not in sure_of_verdict(samples.report_with(coverage=coverage))
    (one, *_) = samples.five_faults()[0]["signals"]
    told = samples.report_with(coverage=coverage, signals=[one | {"name": "cmd.v"}])
    assert "answer their commands" in sure_of_verdict(told)


def test_spells_of_one_fault_say_how_far_their_probabilities_go() -> None:
    report = samples.report_with(coverage=[])
    spells = [fault(0.6), fault(0.96), fault(0.7)]
    assert sure_of_action(spells, report).endswith("; its 3 spells: from 60 % to 96.0 %")
    assert sure_of_action(spells[:1], report) == sure_of(spells[0], report)
    assert "spells" not in sure_of_action([fault(0.6), fault(0.96, mode="inefficient")], report)
