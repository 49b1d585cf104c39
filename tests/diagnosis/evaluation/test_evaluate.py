"""Scores of tiny missions, counted by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.evaluation.confusion import confusion_figures
from diagnosis.evaluation.counts import COLUMNS, TRUE_STATES, Counts, ReportOutcome, add
from diagnosis.evaluation.evaluate import evaluate_report
from diagnosis.evaluation.matching import assign
from diagnosis.evaluation.scores import figures
from diagnosis.evaluation.spans import codes_at, covered, merged, without
from replay.errors import ConfigError, LogError
from replay.faults import FaultMode, Side
from replay.truth import MissionTruth, TruthInterval, TruthSpan

START = 1_760_000_000_000_000_000
SENSOR, ACTUATOR = Side.SENSOR, Side.ACTUATOR


def fault(component: str, side: Side, mode: str, start: float, stop: float, epsilon: float = 1.0) -> TruthInterval:
    kind = "steer" if component == "front" else "wheel"
    return TruthInterval(component, kind, side, FaultMode(mode), start, stop, epsilon, 0.0, 0.0)


def truth_of(*faults: TruthInterval, **changes: Any) -> MissionTruth:
    """20 s at 100 Hz with wheels A and B; A drives from 2 to 18 s, B all the time."""
    base = MissionTruth(
        wheels=("A", "B"),
        rate_hz=100.0,
        start_ns=START,
        duration_s=20.0,
        intervals=faults,
        driving=(TruthSpan("A", 2.0, 18.0), TruthSpan("B", 0.0, 20.0)),
    )
    return replace(base, **changes)


def row(
    component: str, side: str, mode: str, start: float, stop: float, p: float = 0.95, **more: Any
) -> dict[str, Any]:
    out = {"component": component, "side": side, "mode": mode, "start_s": start, "stop_s": stop, "probability": p}
    return {"id": f"{component}{start:g}", "severity": "high", "epsilon": None, **out, **more}


def report_of(
    *rows: dict[str, Any], parts: tuple[str, ...] = ("A", "B"), states: dict[tuple[str, str], list[Any]] | None = None
) -> dict[str, Any]:
    """A report of 20 s; the states of each part and side follow from its rows, healthy between them."""
    spans = []
    for part in parts:
        for side in ("sensor", "actuator"):
            given = [
                (r["start_s"], r["stop_s"], r["mode"])
                for r in rows
                if r["component"] == part and r["side"] in (side, "sensor_or_actuator")
            ]
            given += (states or {}).get((part, side), [])
            t = 0.0
            for start, stop, state in [*sorted(given), (20.0, 20.0, "healthy")]:
                if start > t:
                    spans.append((part, side, "healthy", t, start))
                if stop > start:
                    spans.append((part, side, state, start, stop))
                t = stop
    keys = ("component", "side", "state", "start_s", "stop_s")
    return {
        "log": {"start_ns": START, "duration_s": 20.0},
        "states": [dict(zip(keys, s, strict=True)) for s in spans],
        "intervals": list(rows),
    }


def wheels(report: dict[str, Any], truth: MissionTruth) -> Counts:
    return evaluate_report(report, truth).groups["wheel"]


def seconds(counts: Counts, side: str) -> dict[tuple[str, str], float]:
    """Cells of a confusion that are not empty."""
    matrix = counts.seconds[side]
    return {
        (TRUE_STATES[i], COLUMNS[j]): round(float(matrix[i, j]), 9) for i, j in zip(*np.nonzero(matrix), strict=True)
    }


def test_a_perfect_report() -> None:
    truth = truth_of(fault("A", SENSOR, "stuck", 4.0, 8.0), fault("B", ACTUATOR, "inefficient", 10.0, 15.0, 0.4))
    report = report_of(
        row("A", "sensor", "stuck", 4.0, 8.0, epsilon={"value": 1.0, "low": 1.0, "high": 1.0}),
        row("B", "actuator", "inefficient", 10.0, 15.0, epsilon={"value": 0.43, "low": 0.39, "high": 0.47}),
    )
    counts = wheels(report, truth)
    # A drives 16 s, 4 of them stuck; B drives 20 s.
    assert seconds(counts, "sensor") == {("healthy", "healthy"): 32.0, ("stuck", "stuck"): 4.0}
    assert seconds(counts, "actuator") == {("healthy", "healthy"): 31.0, ("inefficient", "inefficient"): 5.0}
    found = figures(counts)
    for side in found["sides"].values():
        assert side["macro_f1"] == side["balanced_accuracy"] == side["decided_share"] == pytest.approx(1.0)
    assert (found["events"]["precision"], found["events"]["recall"], found["events"]["f1"]) == (1.0, 1.0, 1.0)
    assert found["epsilon"]["mae"] == pytest.approx((0.0 + 0.03) / 2)
    assert found["epsilon"]["mae_partial"] == pytest.approx(0.03)
    assert (found["reliability"][0]["bounds"], found["reliability"][0]["bounds_hold"]) == (1, 1.0)
    # 20 s less 4 s on A, less 5 s on B
    assert found["false_alarms"]["healthy_h"] == pytest.approx((16.0 + 15.0) / 2 / 3600)
    assert found["false_alarms"]["per_hour"] == 0.0


def test_confusion_is_weighted_with_driving_time() -> None:
    truth = truth_of(fault("A", SENSOR, "noisy", 4.0, 10.0, 0.3))
    report = report_of(
        row("A", "sensor", "noisy", 5.0, 8.0),
        row("B", "sensor", "outside_table", 1.0, 2.0),
        states={("A", "sensor"): [(0.0, 3.0, "not_excited"), (8.0, 10.0, "not_assessed"), (10.0, 11.0, "slip")]},
    )
    counts = wheels(report, truth)
    assert seconds(counts, "sensor") == {
        ("noisy", "healthy"): 1.0,  # 4 to 5 s
        ("noisy", "noisy"): 3.0,
        ("noisy", "undecided"): 2.0,  # 8 to 10 s
        ("healthy", "undecided"): 2.0,  # 2 to 3 and 10 to 11 s; before 2 s A stands
        ("healthy", "healthy"): 1.0 + 7.0 + 19.0,  # A from 3 to 4 and 11 to 18 s, B less one second
        ("healthy", "outside_table"): 1.0,
    }


@pytest.mark.parametrize("seed", range(5))
def test_confusion_equals_counting_sample_by_sample(seed: int) -> None:
    rng = np.random.default_rng(seed)
    names = [*TRUE_STATES[1:], "healthy", "slip", "not_excited", "outside_table"]

    def spans(count: int, words: list[str]) -> list[tuple[float, float, str]]:
        """Spans that are apart, on the 100 Hz grid."""
        edges = np.sort(rng.choice(2000, 2 * count, replace=False)) / 100
        return [(edges[2 * i], edges[2 * i + 1], str(rng.choice(words))) for i in range(count)]

    true = {(p, s): spans(4, list(TRUE_STATES[1:])) for p in "AB" for s in ("sensor", "actuator")}
    told = {(p, s): spans(6, names) for p in "AB" for s in ("sensor", "actuator")}
    driving, masked = {p: spans(3, ["x"]) for p in "AB"}, {p: spans(2, ["x"]) for p in "AB"}
    truth = truth_of(
        *(fault(p, Side(s), m, a, b) for (p, s), rows in true.items() for a, b, m in rows),
        driving=tuple(TruthSpan(p, a, b) for p in "AB" for a, b, _ in driving[p]),
        masked=tuple(TruthSpan(p, a, b) for p in "AB" for a, b, _ in masked[p]),
    )

    def at(t: float, rows: list[tuple[float, float, str]], default: str) -> str:
        return next((m for a, b, m in rows if a <= t < b), default)

    counted = {s: np.zeros((5, 7)) for s in ("sensor", "actuator")}
    for (p, s), rows in true.items():
        for t in np.arange(2000) / 100 + 0.005:
            if at(t, driving[p], "") and not (s == "actuator" and at(t, masked[p], "")):
                word = at(t, told[p, s], "healthy")
                column = COLUMNS.index(word if word in COLUMNS else "undecided")
                counted[s][TRUE_STATES.index(at(t, rows, "healthy")), column] += 0.01
    scored = wheels(report_of(states=dict(told)), truth)
    for s, matrix in counted.items():
        assert_allclose(scored.seconds[s], matrix, atol=1e-9)


def test_figures_of_a_confusion() -> None:
    matrix = np.zeros((5, 7))
    matrix[0, [0, 1, 6]] = 80.0, 5.0, 15.0  # healthy: 80 right, 5 called stuck, 15 undecided
    matrix[1, [1, 0]] = 6.0, 4.0  # stuck: 6 right, 4 called healthy
    found = confusion_figures(matrix)
    assert found["driving_s"] == 110.0
    f1_healthy = 2 * 80 / (100 + 84)
    f1_stuck = 2 * 6 / (10 + 11)
    assert found["macro_f1"] == pytest.approx((f1_healthy + f1_stuck) / 2)
    assert found["balanced_accuracy"] == pytest.approx((80 / 100 + 6 / 10) / 2)
    assert found["balanced_accuracy_decided"] == pytest.approx((80 / 85 + 6 / 10) / 2)
    assert found["decided_share"] == pytest.approx(95 / 110)
    assert found["rows"]["noisy"]["recall"] is None


def test_nothing_driven_gives_no_figures() -> None:
    found = figures(wheels(report_of(), truth_of(driving=())))
    assert found["sides"]["sensor"]["macro_f1"] is None
    assert found["sides"]["sensor"]["decided_share"] is None
    assert found["events"]["precision"] is None


@pytest.mark.parametrize(
    ("true", "mode", "sensor", "actuator", "outcome"),
    [
        # The one pair that cannot be told apart: right on the faulty side, and nothing bad of the other.
        ((SENSOR, "inefficient"), "inefficient", ("inefficient", "inefficient"), ("healthy", "healthy"), "right"),
        ((ACTUATOR, "inefficient"), "inefficient", ("healthy", "healthy"), ("inefficient", "inefficient"), "right"),
        # Any other union names no side.
        ((SENSOR, "stuck"), "stuck", ("stuck", "undecided"), ("healthy", "undecided"), "wrong_side"),
        ((ACTUATOR, "noisy"), "inefficient", ("healthy", "undecided"), ("noisy", "undecided"), "wrong_mode"),
        # Without any fault it is wrong on both sides.
        (None, "inefficient", ("healthy", "inefficient"), ("healthy", "inefficient"), None),
    ],
)
def test_union_of_sensor_and_actuator(
    true: tuple[Side, str] | None, mode: str, sensor: Any, actuator: Any, outcome: str | None
) -> None:
    truth = truth_of(*([fault("B", *true, 5.0, 9.0, 0.5)] if true else []))
    counts = wheels(report_of(row("B", "sensor_or_actuator", mode, 5.0, 9.0)), truth)
    for side, cell in (("sensor", sensor), ("actuator", actuator)):
        healthy = 36.0 - 4.0 + (4.0 if cell == ("healthy", "healthy") else 0.0)
        expected = {("healthy", "healthy"): healthy} | ({} if cell == ("healthy", "healthy") else {cell: 4.0})
        assert seconds(counts, side) == expected
    assert [f.outcome for f in counts.faults] == ([outcome] if outcome else [])
    assert [r.false_alarm for r in counts.reports] == [true is None]


def test_masked_time_of_an_actuator_counts_nowhere() -> None:
    truth = truth_of(
        fault("B", SENSOR, "stuck", 4.0, 8.0),
        fault("B", ACTUATOR, "noisy", 6.0, 12.0, 0.4),  # seen from 8 s on
        fault("B", ACTUATOR, "stuck", 5.0, 5.5),  # never seen
        masked=(TruthSpan("B", 4.0, 8.0),),
    )
    report = report_of(
        row("B", "sensor", "stuck", 4.0, 8.0),
        row("B", "actuator", "noisy", 9.0, 12.0),
        row("B", "actuator", "no_signal", 4.0, 5.0),
    )
    counts = wheels(report, truth)
    # Of the actuators' 36 driving seconds 4 are masked.
    assert seconds(counts, "actuator") == {
        ("healthy", "healthy"): 28.0,
        ("noisy", "healthy"): 1.0,
        ("noisy", "noisy"): 3.0,
    }
    assert [f.outcome for f in counts.faults] == ["right", "right", "masked"]
    noisy = counts.faults[1]
    assert noisy.overlap == pytest.approx(3 / 4)  # 8 to 12 s against 9 to 12 s
    assert noisy.onset_error_s is None  # it began unseen
    assert noisy.end_error_s == pytest.approx(0.0)
    assert [r.outcome for r in counts.reports] == ["right", "right", "ignored"]
    assert figures(counts)["events"]["reported"] == 2


@pytest.mark.parametrize(("stop", "outcome"), [(8.2, "ignored"), (14.0, "surplus")])
def test_a_report_mostly_behind_a_dead_sensor_is_not_held_against_it(stop: float, outcome: str) -> None:
    truth = truth_of(fault("B", SENSOR, "stuck", 4.0, 8.0), masked=(TruthSpan("B", 4.0, 8.0),))
    report = report_of(row("B", "sensor", "stuck", 4.0, 8.0), row("B", "actuator", "noisy", 5.0, stop, 0.4))
    assert [r.outcome for r in wheels(report, truth).reports] == ["right", outcome]


def test_onset_counts_from_the_first_excited_sample() -> None:
    # The fault begins at 1 s, A drives from 2 s on; at 100 Hz 7.003 s is first seen at 7.01 s.
    truth = truth_of(
        fault("A", ACTUATOR, "stuck", 1.0, 4.0),
        fault("A", SENSOR, "stuck", 7.003, 9.0),
        fault("A", SENSOR, "noisy", 18.5, 19.5, 0.3),  # A stands
    )
    report = report_of(
        row("A", "actuator", "stuck", 2.03, 4.5),
        row("A", "sensor", "stuck", 7.01, 8.98),
        row("A", "sensor", "noisy", 18.5, 19.5),
    )
    counts = wheels(report, truth)
    assert [f.outcome for f in counts.faults] == ["right", "right", "not_excited"]
    assert_allclose([f.onset_error_s for f in counts.faults[:2]], [0.03, 0.0], atol=1e-9)
    assert_allclose([f.end_error_s for f in counts.faults[:2]], [0.5, -0.02], atol=1e-9)
    found = figures(counts)
    assert found["onset_error_s"]["median"] == pytest.approx(0.015)
    assert found["onset_error_s"]["p95"] == pytest.approx(0.95 * 0.03)  # linear between the two
    assert found["end_error_s"]["bias"] == pytest.approx((0.5 - 0.02) / 2)
    assert found["events"] | {"faults": 2, "reported": 2, "not_excited": 1} == found["events"]


def test_every_way_to_be_wrong() -> None:
    truth = truth_of(
        fault("A", SENSOR, "stuck", 4.0, 6.0),
        fault("A", SENSOR, "inefficient", 8.0, 10.0, 0.3),
        fault("A", ACTUATOR, "noisy", 12.0, 14.0, 0.4),
        fault("B", SENSOR, "stuck", 16.0, 17.0),
    )
    report = report_of(
        row("A", "sensor", "noisy", 4.0, 6.0),  # wrong row
        row("A", "actuator", "inefficient", 8.0, 10.0),  # wrong side
        row("B", "actuator", "noisy", 12.0, 14.0),  # wrong wheel
        row("B", "sensor", "stuck", 16.8, 18.0, 0.6),  # overlaps 0.2 s of 2 s: too little
        row("A", "sensor", "noisy", 5.5, 6.0),  # a piece of a fault that is matched already
        row("B", "sensor", "noisy", 1.0, 2.0, severity="info"),
    )
    counts = wheels(report, truth)
    assert [f.outcome for f in counts.faults] == ["wrong_mode", "wrong_side", "wrong_part", "missed"]
    assert [r.outcome for r in counts.reports] == [
        "wrong_mode",
        "wrong_side",
        "wrong_part",
        "surplus",
        "surplus",
        "surplus",
    ]
    # B's valve and the two on a healthy B; the piece on A lies within a fault.
    assert [r.false_alarm for r in counts.reports] == [False, False, True, True, False, True]
    found = figures(counts)
    events = found["events"]
    # Of the three that were reported, the first alone names the right part and side, and none the right row too.
    assert (events["isolation_rate"], events["identification_rate"]) == (pytest.approx(1 / 3), 0.0)
    assert events["wrong_wheel_rate"] == pytest.approx(1 / 3)
    assert (events["missed"], events["surplus"], events["recall"], events["precision"]) == (1, 3, 0.0, 0.0)
    alarms = found["false_alarms"]
    hours = ((20 - 6) + (20 - 1)) / 2 / 3600
    assert (alarms["count"], alarms["info"]) == (2, 1)
    assert alarms["per_hour"] == pytest.approx(2 / hours)
    assert alarms["per_hour_high"] == pytest.approx(6.2958 / hours, rel=1e-4)  # Poisson, 2 seen, one-sided 95 %
    assert [(s["severity"], s["reported"]) for s in found["by_severity"] if s["reported"]] == [("high", 5), ("info", 1)]


def test_no_adjustment_for_points_found() -> None:
    """A fault reported in two halves is found once; the smaller half is surplus."""
    truth = truth_of(fault("B", SENSOR, "stuck", 4.0, 14.0))
    report = report_of(row("B", "sensor", "stuck", 4.0, 8.0), row("B", "sensor", "stuck", 9.0, 14.0))
    counts = wheels(report, truth)
    assert [r.outcome for r in counts.reports] == ["surplus", "right"]
    assert counts.faults[0].overlap == pytest.approx(0.5)


def test_most_overlap_in_all() -> None:
    # Greedily fault 0 would take report 0 (.6) and leave fault 1 with nothing.
    overlap = np.array([[0.6, 0.5], [0.4, 0.0]])
    assert assign(overlap, [["right", "right"], ["right", "right"]]) == {0: 1, 1: 0}
    # A right one goes before one that only overlaps more.
    assert assign(np.array([[0.9, 0.4]]), [["wrong_mode", "right"]]) == {0: 1}
    assert assign(np.zeros((0, 3)), []) == {}


def test_a_report_of_a_part_of_the_mission() -> None:
    """Times are compared on the log's clock, faults outside the part are left out."""
    truth = truth_of(fault("B", SENSOR, "stuck", 2.0, 4.0), fault("B", SENSOR, "stuck", 11.0, 14.0))
    report = report_of(row("B", "sensor", "stuck", 1.0, 4.0))
    report["log"] = {"start_ns": START + 10_000_000_000, "duration_s": 10.0}
    counts = wheels(report, truth)
    assert [(f.start_s, f.stop_s, f.outcome) for f in counts.faults] == [(11.0, 14.0, "right")]
    assert counts.faults[0].onset_error_s == pytest.approx(0.0)
    assert seconds(counts, "sensor") == {("healthy", "healthy"): 8.0 + 7.0, ("stuck", "stuck"): 3.0}


def test_steering_is_a_group_of_its_own_and_drives_with_any_wheel() -> None:
    truth = truth_of(fault("front", SENSOR, "stuck", 4.0, 8.0), driving=(TruthSpan("A", 2.0, 18.0),))
    report = report_of(row("front", "sensor", "stuck", 4.0, 8.0), parts=("A", "front"))
    scores = evaluate_report(report, truth)
    assert seconds(scores.groups["steer"], "sensor") == {("healthy", "healthy"): 12.0, ("stuck", "stuck"): 4.0}
    assert scores.groups["wheel"].faults == ()
    assert scores.left_out == ()


def test_faults_of_parts_that_the_report_left_out_are_named() -> None:
    truth = truth_of(fault("A", SENSOR, "stuck", 4.0, 8.0), fault("B", SENSOR, "stuck", 4.0, 8.0))
    scores = evaluate_report(report_of(parts=("A",)), truth)
    assert scores.left_out == ("B",)
    assert [f.outcome for f in scores.groups["wheel"].faults] == ["missed"]


def test_counts_of_missions_add_up() -> None:
    first = wheels(report_of(), truth_of(fault("A", SENSOR, "stuck", 4.0, 8.0)))
    second = wheels(report_of(row("B", "sensor", "stuck", 1.0, 2.0)), truth_of())
    both = add([first, second])
    assert seconds(both, "sensor") == {
        ("healthy", "healthy"): 32.0 + 35.0,
        ("stuck", "healthy"): 4.0,
        ("healthy", "stuck"): 1.0,
    }
    assert both.healthy_s == pytest.approx(18.0 + 20.0)
    assert figures(both)["events"] == figures(both)["events"] | {"faults": 1, "missed": 1, "surplus": 1}
    assert figures(add([]))["false_alarms"]["per_hour"] is None


def test_stated_probability_against_the_share_that_was_right() -> None:
    def told(p: float, outcome: str) -> ReportOutcome:
        return ReportOutcome("F1", "A", "sensor", "stuck", "high", 0.0, 1.0, p, outcome, False)

    counts = Counts(reports=(told(0.82, "right"), told(0.88, "surplus"), told(1.0, "right"), told(0.5, "ignored")))
    bins = {(b["low"], b["high"]): b for b in figures(counts)["calibration"]}
    assert len(bins) == 10
    assert bins[0.8, 0.9]["probability"] == pytest.approx(0.85)
    assert (bins[0.8, 0.9]["reported"], bins[0.8, 0.9]["right"]) == (2, 0.5)
    assert (bins[0.9, 1.0]["reported"], bins[0.9, 1.0]["right"]) == (1, 1.0)
    assert (bins[0.5, 0.6]["reported"], bins[0.5, 0.6]["right"]) == (0, None)


def test_recall_by_epsilon_and_by_excitation() -> None:
    truth = truth_of(
        fault("A", SENSOR, "noisy", 0.0, 4.0, 0.3),  # half of it driving
        fault("A", SENSOR, "stuck", 6.0, 8.0, 1.0),
    )
    found = figures(wheels(report_of(row("A", "sensor", "stuck", 6.0, 8.0)), truth))
    assert [(b["faults"], b["right"]) for b in found["by_epsilon"]] == [(0, 0), (1, 0), (0, 0), (1, 1)]
    assert [(b["faults"], b["right"]) for b in found["by_excitation"]] == [(0, 0), (1, 0), (1, 1)]


def test_truth_of_another_mission_is_refused() -> None:
    late = report_of()
    late["log"]["start_ns"] = START + 3_600_000_000_000
    with pytest.raises(ConfigError, match=r"mission\.json: begins 3600\.0 s after the truth file's mission"):
        evaluate_report(late, truth_of(), "mission.json")
    longer = report_of()
    longer["log"]["duration_s"] = 35.0
    with pytest.raises(
        ConfigError, match=r"mission\.json: 15\.0 s of its 35\.0 s lie outside .* lasts 20\.0 s; .* --truth"
    ):
        evaluate_report(longer, truth_of(), "mission.json")
    with pytest.raises(ConfigError, match="its components are X, the truth file's wheels A, B"):
        evaluate_report(report_of(parts=("X",)), truth_of())
    with pytest.raises(ConfigError, match="rate_hz is 0; expected the recorded rate"):
        evaluate_report(report_of(), truth_of(rate_hz=0.0))


@pytest.mark.parametrize("part", ["log", "states", "intervals"])
def test_an_incomplete_report_is_refused(part: str) -> None:
    report = report_of()
    del report[part]
    with pytest.raises(LogError, match=f"is not a complete report .*{part}"):
        evaluate_report(report, truth_of())
    with pytest.raises(LogError, match="is not a complete report"):
        evaluate_report(report_of() | {part: 5}, truth_of())


def test_sets_of_spans() -> None:
    assert merged([(3.0, 4.0), (0.0, 1.0), (0.5, 2.0), (5.0, 5.0)]) == [(0.0, 2.0), (3.0, 4.0)]
    assert without([(0.0, 10.0)], [(2.0, 3.0), (9.0, 12.0)]) == [(0.0, 2.0), (3.0, 9.0)]
    assert_allclose(covered(np.array([0.0, 2.5, 20.0]), [(2.0, 3.0), (9.0, 12.0)]), [0.0, 0.5, 4.0])
    assert covered(1.0, []) == 0.0
    assert codes_at(np.array([0.5, 1.5, 2.5]), [(1.0, 2.0, 7)], -1).tolist() == [-1, 7, -1]


def test_faults_outside_of_driving_are_named() -> None:
    """A drives from 2 to 18 s, B all the time; of the front axle nothing is known."""
    faults = (
        fault("A", SENSOR, "no_signal", 18.5, 19.0),
        fault("A", ACTUATOR, "stuck", 1.0, 2.5),
        fault("B", SENSOR, "stuck", 0.0, 1.0),
        fault("front", SENSOR, "stuck", 0.0, 1.0),
    )
    scores = evaluate_report(report_of(), truth_of(*faults))
    assert scores.not_driven == ("A sensor no signal from 18.5 to 19 s",)
