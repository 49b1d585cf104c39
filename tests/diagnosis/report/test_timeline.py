from __future__ import annotations

from typing import Any

from diagnosis.report.timeline import Bar, causes, merged, side_by_side, ticks, timeline
from diagnosis.results.document import IntervalRow
from tests import report_samples as samples


def test_thousands_of_spans_merge_and_no_fault_is_lost() -> None:
    spans = [(("healthy", "not_excited")[i % 2], i * 0.01, (i + 1) * 0.01) for i in range(20_000)]
    spans.append(("stuck", 77.0001, 77.0002))
    runs = merged(spans, 200.0)
    assert len(runs) <= 2000
    assert [r for r in runs if r[0] == "stuck"] == [("stuck", 770, 771)]


def test_fault_at_the_very_end_is_drawn() -> None:
    assert merged([("noisy", 10.0, 10.0)], 10.0) == [("noisy", 1999, 2000)]


def test_lanes_with_and_without_faults() -> None:
    report, _ = samples.five_faults()
    t = timeline(report, 120.0)
    assert [(x.component, x.part) for x in t.lanes] == [
        ("FR", "speed sensor"),
        ("FL", "speed sensor"),
        ("RR", "drive valve"),
        ("RL", "drive valve"),
        ("front", "steering sensor"),
    ]
    assert len(t.quiet) == 7
    assert t.summary == "7 lanes without a fault: 6 cleared, 1 not judged"


def test_fault_that_is_not_isolated_stands_on_both_lanes() -> None:
    report, _ = samples.one_wheel()
    report["intervals"][0]["side"] = "sensor_or_actuator"
    assert [[b.fault for b in x.bars] for x in timeline(report, 120.0).lanes] == [["F1"], ["F1"]]


def test_ticks() -> None:
    assert [w for _, w in ticks(240.0)] == ["0:00", "0:30", "1:00", "1:30", "2:00", "2:30", "3:00", "3:30", "4:00"]
    assert ticks(0.0) == ()
    assert len(ticks(0.25)) == 3


def test_faults_that_may_follow_from_another_are_faded() -> None:
    def loss(**changes: Any) -> IntervalRow:
        own = {"id": "F2", "side": "actuator", "mode": "inefficient", "tier": "model", "start_s": 11.0, "stop_s": 16.0}
        return samples.fault(**(own | changes))

    stuck = samples.fault(tier="model", start_s=10.0, stop_s=20.0)
    assert causes([stuck, loss()]) == {"F2": "F1"}
    assert causes([stuck, loss(tier="direct")]) == {}, "measured by itself"
    assert causes([stuck, loss(start_s=19.0, stop_s=30.0)]) == {}, "mostly outside"
    assert causes([stuck, loss(component="FL")]) == {}


def test_a_part_that_was_not_judged_long_enough_does_not_count_as_healthy() -> None:
    rows = [("sensor", 60.0), ("actuator", 18.0)]
    report = samples.report_with(
        machine={"wheels": ["FR"]},
        verdict={"status": "watch", "cleared": False, "to_clear": []},
        states=[
            {"component": "FR", "side": side, "state": "healthy", "start_s": 0.0, "stop_s": s, "reason": ""}
            for side, s in rows
        ],
        coverage=[
            {
                "component": "FR",
                "side": side,
                "tier": "model",
                "seconds": {"healthy": s},
                "driving_s": 66.0,
                "decided_driving_s": s,
            }
            for side, s in rows
        ],
    )
    t = timeline(report, 66.0)
    assert [lane.state for lane in t.quiet] == ["healthy", "not_assessed"]
    assert t.summary == "2 lanes without a fault: 1 cleared, 1 not judged long enough"


def bar(left: float, width: float) -> Bar:
    return Bar("F1", "stuck", left, width, "F1", "F1")


def test_bars_that_would_cover_each_other_share_the_height() -> None:
    found = side_by_side([bar(10, 20), bar(15, 2), bar(16, 30), bar(60, 0.01), bar(60.1, 0.01), bar(80, 5)])
    assert [(b.row, b.rows) for b in found] == [(0, 3), (1, 3), (2, 3), (0, 2), (1, 2), (0, 1)]
    many = side_by_side([bar(10 + 0.01 * k, 5) for k in range(9)])
    assert {b.rows for b in many} == {3}
    assert len(many) == 9


def test_faults_at_the_same_time_make_it_faulty_once() -> None:
    report, _ = samples.one_wheel()
    first = report["intervals"][0] | {"start_s": 0.0, "stop_s": 90.0}
    report["intervals"] = [first, first | {"id": "F2", "start_s": 30.0, "stop_s": 96.0}]
    assert timeline(report, 120.0).lanes[0].faulty == "80.0 %"


def test_brief_noise_of_little_severity_is_drawn_and_paints_no_part() -> None:
    report, _ = samples.one_wheel()
    report["intervals"][0] |= {"mode": "noisy", "severity": "info", "start_s": 30.0, "stop_s": 30.013}
    lane = timeline(report, 120.0).lanes[0]
    assert lane.state != "noisy"
    assert lane.faulty == "remark"
    assert [b.slight for b in lane.bars] == [True]


def test_a_remark_gives_no_part_the_sign_of_health() -> None:
    report, _ = samples.one_wheel()
    report["intervals"] = [report["intervals"][0] | {"severity": "info"}]
    point = {"reason": "Not judged long enough.", "act": "drive", "parts": [], "fault": "", "why": ""}
    report["verdict"] |= {"to_clear": [point]}
    found = timeline(report, 120.0)
    assert {lane.state for lane in (*found.lanes, *found.quiet)} == {"not_assessed"}


def test_bars_that_touch_have_the_whole_height_each() -> None:
    first = bar(100 * 174.5 / 240, 100 * (185.08 - 174.5) / 240)
    second = bar(100 * 185.08 / 240, 3.0)
    assert [b.rows for b in side_by_side([first, second])] == [1, 1]
