"""How sure the tool is, in words."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.report.confidence import headline, judged, percent, sure_of, sure_of_verdict


def fault(p: float, **changes: Any) -> dict[str, Any]:
    return {
        "component": "FR",
        "kind": "wheel",
        "side": "actuator",
        "mode": "stuck",
        "tier": "direct",
        "probability": p,
        "hypotheses": [
            {"side": "actuator", "mode": "stuck", "p": p},
            {"side": "actuator", "mode": "healthy", "p": 0.0},
        ],
        **changes,
    }


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
    [(0.9999, "over 99.9 %"), (0.99, "99.0 %"), (0.95, "95.0 %"), (0.5, "50 %")],
)
def test_no_certainty_that_is_not_there(p: float, words: str) -> None:
    assert percent(p) == words


def test_phrase_of_a_fault() -> None:
    report = {"coverage": [row("actuator", 91.0), row("sensor", 100.0)]}
    assert sure_of(fault(0.995), report) == (
        "Practically certain (99.5 %), measured against the valve's position, 91 % of its driving was judged"
    )
    # certainly faulty, the row less so
    words = sure_of(fault(0.49, hypotheses=[{"side": "actuator", "mode": "stuck", "p": 0.49}]), {})
    assert words.startswith("Practically certain faulty (over 99.9 %), most likely stuck (49 %)")
    rows = [
        {"side": "actuator", "mode": m, "p": p} for m, p in (("inefficient", 0.35), ("stuck", 0.21), ("noisy", 0.44))
    ]
    assert sure_of(fault(0.21, hypotheses=rows), {}).startswith(
        "Practically certain faulty (over 99.9 %), perhaps stuck (21 %)"
    )
    assert sure_of(fault(0.75, tier="model"), {}).endswith("by the wheel model, without a second measurement")


def test_both_sides_count_where_they_are_not_told_apart() -> None:
    report = {"coverage": [row("actuator", 40.0), row("sensor", 100.0)]}
    assert "40 % of its driving" in sure_of(fault(0.99, side="sensor_or_actuator", tier="tracking"), report)


def test_phrase_of_a_verdict() -> None:
    done = {"machine": {"axles": []}, "coverage": [row("sensor", 98.0), row("actuator", 90.0, tier="model")]}
    assert sure_of_verdict(done) == (
        "All 2 wheel parts were judged, each for at least 90 % of its driving, by second measurements and a model of the "
        "wheels."
    )
    assert judged(done) == "2 of 2 parts"
    short = {**done, "coverage": [row("sensor", 98.0), row("actuator", 0.0, tier="none")]}
    assert sure_of_verdict(short).startswith("1 of 2 wheel parts were judged long enough")
    assert sure_of_verdict({}) == ""


def watched(**verdict: Any) -> dict[str, Any]:
    rows = [row("sensor", 98.0), row("actuator", 90.0)]
    return {"machine": {"axles": []}, "verdict": {"status": "watch", **verdict}, "coverage": rows}


def test_leave_to_go_out_is_given_only_where_nothing_stands_against_it() -> None:
    leave = ("Ready, with faults to watch", "may go out")
    assert headline(watched(cleared=True, not_cleared="")) == leave
    assert headline(watched(cleared=False, not_cleared="the log is damaged")) == (
        "Watch",
        "not cleared: the log is damaged",
    )
    assert headline({"verdict": {"status": "stop"}}) == ("Stop and repair", "must not go out as it is")
    assert headline({"verdict": {"status": "ready"}}) == ("Ready for the next mission", "")
    assert headline({}) == ("Not assessed", "whether it may go out is not known")


def test_leave_of_reports_that_do_not_say_it() -> None:
    assert headline(watched())[1] == "may go out"
    short = {**watched(), "coverage": [row("sensor", 98.0), row("actuator", 3.0)]}
    assert headline(short) == ("Watch", "not cleared: 1 part was not judged long enough")
    damaged = {**watched(), "log": {"files": [{"damage": ["chunk 7 is cut off"]}]}}
    assert headline(damaged)[1] == "not cleared: the log is damaged"
    assert headline({"verdict": {"status": "watch"}})[1].startswith("not cleared: ")
