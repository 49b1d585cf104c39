"""Figures by severity and excitation, detection delay and DAMADICS rates, of missions small enough to count by hand."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_allclose

from diagnosis.evaluation.confusion import confusion_figures, damadics_rates
from diagnosis.evaluation.counts import (
    COLUMNS,
    EPSILON_BANDS,
    TRUE_STATES,
    Counts,
    FaultOutcome,
    ReportOutcome,
    add,
    band_of,
)
from diagnosis.evaluation.evaluate import evaluate_report
from diagnosis.evaluation.excitation import Speeds, read_speeds, speeds_of
from diagnosis.evaluation.scores import figures
from replay.faults import FaultMode, Side
from replay.truth import MissionTruth, TruthInterval, TruthSpan

SENSOR, ACTUATOR = Side.SENSOR, Side.ACTUATOR


def truth_of(*faults: tuple[Any, ...], **changes: Any) -> MissionTruth:
    """20 s at 100 Hz with one wheel that drives all the time; faults are (side, mode, start, stop, ε)."""
    base = MissionTruth(
        wheels=("A",),
        rate_hz=100.0,
        start_ns=0,
        duration_s=20.0,
        intervals=tuple(
            TruthInterval("A", "wheel", side, FaultMode(mode), start, stop, epsilon, 0.0, 0.0)
            for side, mode, start, stop, epsilon in faults
        ),
        driving=(TruthSpan("A", 0.0, 20.0),),
    )
    return replace(base, **changes)


def report_of(*rows: tuple[Any, ...], start_ns: int = 0) -> dict[str, Any]:
    """A report of 20 s; its faults are (side, mode, start, stop, ε̂, detected), all else is healthy."""
    intervals, states = [], []
    for k, (side, mode, start, stop, epsilon, detected) in enumerate(rows):
        row = {"id": f"F{k + 1}", "component": "A", "side": side, "mode": mode, "start_s": start, "stop_s": stop}
        row |= {"probability": 0.9, "severity": "high", "tier": "direct", "detected_s": detected}
        intervals.append(
            row | {"epsilon": None if epsilon is None else {"value": epsilon, "low": epsilon, "high": epsilon}}
        )
    for side in ("sensor", "actuator"):
        at = 0.0
        for r in sorted((r for r in intervals if r["side"] == side), key=lambda r: r["start_s"]):
            states.append((side, "healthy", at, r["start_s"]))
            states.append((side, r["mode"], r["start_s"], r["stop_s"]))
            at = r["stop_s"]
        states.append((side, "healthy", at, 20.0))
    keys = ("component", "side", "state", "start_s", "stop_s")
    return {
        "log": {"start_ns": start_ns, "duration_s": 20.0},
        "states": [dict(zip(keys, ("A", *s), strict=True)) for s in states],
        "intervals": intervals,
    }


def wheel(report: dict[str, Any], truth: MissionTruth, **more: Any) -> Counts:
    return evaluate_report(report, truth, **more).groups["wheel"]


def band(rows: list[dict[str, Any]], low: Any) -> dict[str, Any]:
    return next(r for r in rows if low in (r.get("low"), r.get("contact")))


def fault(outcome: str, **more: Any) -> FaultOutcome:
    return FaultOutcome("A", "sensor", "stuck", 0.0, 1.0, 1.0, 1.0, outcome, **more)


def told(outcome: str, *, false_alarm: bool = False, severity: str = "high", **more: Any) -> ReportOutcome:
    return ReportOutcome("F1", "A", "sensor", "stuck", severity, 0.0, 1.0, 0.9, outcome, false_alarm, **more)


def test_detection_delay_is_the_causal_moment_after_the_first_excited_sample() -> None:
    truth = truth_of(
        (SENSOR, "stuck", 2.0, 4.0, 1.0),  # raised 30 ms late
        (SENSOR, "noisy", 6.0, 8.0, 0.3),  # called inefficient, yet raised: 50 ms
        (SENSOR, "noisy", 10.0, 12.0, 0.3),  # found looking back alone
        (SENSOR, "stuck", 13.0, 15.0, 1.0),  # the wheel drives from 14 s on: 10 ms before its first excited sample
        (SENSOR, "stuck", 16.0, 18.0, 1.0),  # missed
        driving=(TruthSpan("A", 0.0, 13.0), TruthSpan("A", 14.0, 20.0)),
    )
    report = report_of(
        ("sensor", "stuck", 2.0, 4.0, 1.0, 2.03),
        ("sensor", "inefficient", 6.0, 8.0, 0.3, 6.05),
        ("sensor", "noisy", 10.0, 12.0, 0.3, None),
        ("sensor", "stuck", 13.5, 15.0, 1.0, 13.99),
    )
    counts = wheel(report, truth)
    assert [f.outcome for f in counts.faults] == ["right", "wrong_mode", "right", "right", "missed"]
    assert_allclose([f.detection_delay_s for f in counts.faults if f.detection_delay_s], [0.03, 0.05, -0.01], atol=1e-9)
    delay = figures(counts)["detection_delay_s"]
    assert (delay["n"], delay["without"]) == (3, 1)
    assert delay["median"] == pytest.approx(0.03)
    assert delay["p95"] == pytest.approx(0.03 + 0.9 * 0.02)  # of −0.01, 0.03, 0.05, linear between them


def test_a_fault_that_began_masked_has_no_delay() -> None:
    truth = truth_of((ACTUATOR, "stuck", 3.0, 9.0, 1.0), masked=(TruthSpan("A", 2.0, 5.0),))
    counts = wheel(report_of(("actuator", "stuck", 5.0, 9.0, 1.0, 5.02)), truth)
    assert [(f.outcome, f.onset_seen, f.detection_delay_s) for f in counts.faults] == [("right", False, None)]
    delay = figures(counts)["detection_delay_s"]
    assert (delay["n"], delay["without"]) == (0, 0)


def test_reports_that_do_not_know_their_moment_of_detection() -> None:
    report = report_of(("sensor", "stuck", 2.0, 4.0, 1.0, None))
    del report["intervals"][0]["detected_s"], report["intervals"][0]["tier"]
    counts = wheel(report, truth_of((SENSOR, "stuck", 2.0, 4.0, 1.0)))
    assert figures(counts)["detection_delay_s"] == {"n": 0, "median": None, "p95": None, "bias": None, "without": 1}
    assert counts.reports[0].tier == ""


def test_isolation_and_wrong_wheel_rate_are_of_what_was_detected() -> None:
    faults = tuple(fault(o) for o in ("right", "right", "wrong_mode", "wrong_side", "wrong_part", "missed"))
    events = figures(Counts(faults=faults))["events"]
    assert (events["faults"], events["detected"]) == (6, 5)
    assert events["isolation_rate"] == pytest.approx(3 / 5)  # right component and side: two right, one wrong row
    assert events["identification_rate"] == pytest.approx(2 / 5)
    assert events["wrong_wheel_rate"] == pytest.approx(1 / 5)


def test_event_figures() -> None:
    faults = tuple(fault(o) for o in ("right", "right", "right", "missed", "not_excited"))
    reports = tuple(told(o) for o in ("right", "right", "right", "surplus", "surplus", "ignored"))
    events = figures(Counts(faults=faults, reports=reports))["events"]
    assert (events["precision"], events["recall"]) == (pytest.approx(3 / 5), pytest.approx(3 / 4))
    assert events["f1"] == pytest.approx(2 * 3 / (5 + 4))
    assert figures(Counts(faults=faults))["events"]["f1"] == 0.0


def test_false_alarms_per_healthy_hour_and_their_poisson_bound() -> None:
    alarms = [told("surplus", false_alarm=True), told("wrong_part", false_alarm=True)]
    quiet = told("surplus", false_alarm=True, severity="info")
    none = figures(Counts(healthy_s=7200.0))["false_alarms"]
    assert (none["count"], none["per_hour"]) == (0, 0.0)
    assert none["per_hour_high"] == pytest.approx(-np.log(0.05) / 2)  # the rule of three: 3/T
    found = figures(Counts(reports=(*alarms, quiet, told("surplus")), healthy_s=7200.0))["false_alarms"]
    assert (found["count"], found["info"], found["per_hour"]) == (2, 1, 1.0)
    assert found["per_hour_high"] == pytest.approx(6.2958 / 2, rel=1e-4)


def test_damadics_rates_by_time() -> None:
    seconds = np.zeros((5, 7))
    seconds[TRUE_STATES.index("healthy")] = [90.0, 4.0, 0.0, 0.0, 0.0, 1.0, 5.0]  # 5 of 100 s told faulty
    seconds[TRUE_STATES.index("stuck")] = [2.0, 14.0, 0.0, 3.0, 0.0, 0.0, 1.0]  # 17 of 20 s, 14 of them as stuck
    rates = damadics_rates(seconds)
    assert rates == {
        "r_fd": pytest.approx(0.05),
        "r_td": pytest.approx(17 / 20),
        "r_fi": pytest.approx(3 / 20),
        "r_ti": pytest.approx(14 / 20),
    }
    found = confusion_figures(seconds)
    assert found["damadics"] == rates
    assert found["undecided_share"] == pytest.approx(6 / 120)
    assert found["decided_share"] == pytest.approx(114 / 120)
    assert damadics_rates(np.zeros((5, 7))) == dict.fromkeys(("r_fd", "r_td", "r_fi", "r_ti"))


def test_severity_divides_faults_by_epsilon_and_keeps_all_healthy_time() -> None:
    truth = truth_of((SENSOR, "noisy", 2.0, 4.0, 0.1), (SENSOR, "inefficient", 6.0, 10.0, 0.5))
    report = report_of(
        ("sensor", "inefficient", 6.0, 10.0, 0.48, 6.0),
        ("sensor", "noisy", 12.0, 13.0, 0.15, 12.0),  # nothing there
    )
    found = figures(wheel(report, truth))
    small, middle = band(found["by_epsilon"], 0.0), band(found["by_epsilon"], 0.4)
    # ε < 0.2: the missed fault, the false report of ε̂ = 0.15, and 14 s without fault of which 13 were called healthy
    assert (small["faults"], small["right"], small["recall"], small["events"]["precision"]) == (1, 0, 0.0, 0.0)
    assert small["false_alarms"]["count"] == 1
    rows = small["sides"]["sensor"]["rows"]
    assert (rows["healthy"]["seconds"], rows["noisy"]["seconds"], rows["inefficient"]["seconds"]) == (14.0, 2.0, 0.0)
    assert rows["healthy"]["recall"] == pytest.approx(13 / 14)
    assert rows["noisy"]["recall"] == 0.0
    assert small["sides"]["sensor"]["macro_f1"] == pytest.approx((2 * 13 / (14 + 15) + 0.0) / 2)
    # 0.4 ≤ ε < 0.7: found as it is
    assert (middle["faults"], middle["right"], middle["events"]["precision"]) == (1, 1, 1.0)
    assert middle["epsilon"]["mae"] == pytest.approx(0.02)
    assert middle["sides"]["sensor"]["rows"]["inefficient"]["recall"] == 1.0
    assert middle["false_alarms"]["count"] == 0
    assert [b["faults"] for b in found["by_epsilon"]] == [1, 0, 1, 0]


def test_rows_of_the_tables_have_all_event_figures() -> None:
    truth = truth_of((SENSOR, "stuck", 2.0, 4.0, 1.0), (SENSOR, "stuck", 6.0, 8.0, 1.0))
    report = report_of(("sensor", "stuck", 2.0, 4.0, 1.0, 2.02), ("sensor", "stuck", 12.0, 13.0, 1.0, 12.0))
    (mode,) = figures(wheel(report, truth))["modes"]
    assert (mode["side"], mode["mode"], mode["faults"], mode["right"], mode["recall"]) == ("sensor", "stuck", 2, 1, 0.5)
    assert mode["events"]["precision"] == 0.5
    assert mode["false_alarms"]["count"] == 1
    assert mode["detection_delay_s"]["median"] == pytest.approx(0.02)
    assert mode["time"]["recall"] == pytest.approx(0.5)
    assert mode["time"]["precision"] == pytest.approx(2 / 3)


def test_excitation_divides_time_and_faults_by_commanded_speed() -> None:
    t = np.arange(2000) / 100
    speed = np.where(t < 5, 0.06, np.where(t < 15, -0.2, 0.3))  # slow, middle (in reverse), fast
    speeds = speeds_of({"t": t, "wheel.A.v_ref": speed}, ("A",))
    truth = truth_of((SENSOR, "stuck", 2.0, 4.0, 1.0), (SENSOR, "stuck", 6.0, 8.0, 1.0))
    report = report_of(("sensor", "stuck", 6.0, 8.0, 1.0, 6.0), ("sensor", "stuck", 16.0, 17.0, 1.0, 16.0))
    found = figures(wheel(report, truth, speeds=speeds))["by_speed"]
    assert [(b["low"], b["high"]) for b in found] == [(0.0, 0.12), (0.12, 0.24), (0.24, None)]
    assert [b["sides"]["sensor"]["driving_s"] for b in found] == pytest.approx([5.0, 10.0, 5.0])
    assert [(b["faults"], b["right"]) for b in found] == [(1, 0), (1, 1), (0, 0)]
    assert [b["events"]["precision"] for b in found] == [None, 1.0, 0.0]
    assert [b["false_alarms"]["count"] for b in found] == [0, 0, 1]
    # without a fault: 5 − 2, 10 − 2 and 5 s
    assert [b["false_alarms"]["healthy_h"] * 3600 for b in found] == pytest.approx([3.0, 8.0, 5.0])
    assert found[0]["sides"]["sensor"]["rows"]["stuck"]["recall"] == 0.0


def test_excitation_divides_free_slipping_and_masked() -> None:
    truth = truth_of(
        (SENSOR, "stuck", 2.0, 4.0, 1.0),  # behind it the actuator is masked
        (ACTUATOR, "stuck", 2.5, 3.5, 1.0),  # never seen
        (ACTUATOR, "inefficient", 6.0, 8.0, 0.5),  # while the tyre slips
        slip=(TruthSpan("A", 5.5, 9.0),),
        masked=(TruthSpan("A", 2.0, 4.0),),
    )
    report = report_of(("sensor", "stuck", 2.0, 4.0, 1.0, 2.0), ("actuator", "inefficient", 6.0, 8.0, 0.5, 6.0))
    counts = wheel(report, truth)
    free, slip, masked = figures(counts)["by_contact"]
    assert [b["contact"] for b in (free, slip, masked)] == ["free", "slip", "masked"]
    assert [b["sides"]["actuator"]["driving_s"] for b in (free, slip, masked)] == pytest.approx([14.5, 3.5, 2.0])
    assert [b["sides"]["sensor"]["driving_s"] for b in (free, slip, masked)] == pytest.approx([16.5, 3.5, 0.0])
    assert [(b["faults"], b["right"]) for b in (free, slip, masked)] == [(1, 1), (1, 1), (0, 0)]
    assert masked["events"]["masked"] == 1
    # in masked time the stuck actuator was called healthy; the totals do not hold it
    assert masked["sides"]["actuator"]["rows"]["stuck"] == masked["sides"]["actuator"]["rows"]["stuck"] | {
        "seconds": pytest.approx(1.0),
        "recall": 0.0,
    }
    assert counts.seconds["actuator"].sum() == pytest.approx(18.0)
    assert counts.seconds["actuator"][TRUE_STATES.index("stuck")].sum() == 0.0


def test_parts_of_the_time_are_the_whole() -> None:
    """Bands of speed and contact without the masked time add up to all driving time, those of ε to all faulty time."""
    rng = np.random.default_rng(3)
    t = np.arange(2000) / 100
    speeds = speeds_of({"t": t, "replay.A.v_ref": 0.2 + 0.15 * np.sin(t) + 0.01 * rng.normal(size=2000)}, ("A",))
    truth = truth_of(
        (SENSOR, "noisy", 2.0, 7.0, 0.1),
        (ACTUATOR, "inefficient", 5.0, 12.0, 0.5),
        (SENSOR, "stuck", 14.0, 16.0, 1.0),
        slip=(TruthSpan("A", 3.3, 5.5), TruthSpan("A", 11.0, 15.0)),
        masked=(TruthSpan("A", 14.0, 16.0),),
    )
    report = report_of(("sensor", "noisy", 2.2, 6.0, 0.1, 2.3), ("actuator", "noisy", 5.0, 11.0, None, None))
    counts = wheel(report, truth, speeds=speeds)
    for side in ("sensor", "actuator"):
        whole = counts.seconds[side]
        assert_allclose(counts.parts["speed"][side].sum(axis=0), whole, atol=1e-9)
        assert_allclose(counts.parts["contact"][side][:2].sum(axis=0), whole, atol=1e-9)
        assert_allclose(counts.parts["epsilon"][side].sum(axis=0)[1:], whole[1:], atol=1e-9)
    both = add([counts, counts])
    assert_allclose(both.parts["speed"]["sensor"], 2 * counts.parts["speed"]["sensor"])
    assert_allclose(both.healthy_parts["speed"].sum(), 2 * 8.0)  # 2 to 12 and 14 to 16 s are faulty


def test_without_columns_nothing_is_divided_by_speed() -> None:
    counts = wheel(report_of(), truth_of((SENSOR, "stuck", 2.0, 4.0, 1.0)))
    assert figures(counts)["by_speed"] == []
    assert counts.faults[0].speed is None


def test_speeds_are_shifted_with_the_report() -> None:
    """The log begins 10 s into the truth's mission and moves at once; the fault of 12 s lies in its first 5 s."""
    t = np.arange(1000) / 100
    speeds = speeds_of({"t": t, "wheel.A.v_ref": np.where(t < 5, 0.06, 0.3)}, ("A",))
    report = report_of(("sensor", "stuck", 2.0, 4.0, 1.0, 2.01), start_ns=10_000_000_000)
    report["log"]["duration_s"] = 10.0
    counts = wheel(report, truth_of((SENSOR, "stuck", 12.0, 14.0, 1.0)), speeds=speeds)
    (one,) = counts.faults
    assert (one.outcome, one.speed) == ("right", pytest.approx(0.06))
    assert one.detection_delay_s == pytest.approx(0.01)
    assert counts.reports[0].speed == pytest.approx(0.06)
    assert counts.parts["speed"]["sensor"].sum(axis=(1, 2)) == pytest.approx([5.0, 0.0, 5.0])


def test_speeds_of_a_part_that_is_no_wheel_are_the_mean() -> None:
    t = np.arange(4.0)
    speeds = Speeds(t, {"A": np.array([0.1, 0.3, np.nan, np.nan]), "B": np.array([0.3, 0.3, 0.2, np.nan])})
    assert_allclose(speeds.of("front"), [0.2, 0.3, 0.2, np.nan])
    assert speeds.bands("front", 1.0) == [(1.0, 2.0, 1), (2.0, 3.0, 2), (3.0, 4.0, 1)]
    assert speeds.mean("front", [(3.0, 4.0)], 0.0) is None
    assert speeds.mean("front", [], 0.0) is None


def test_recorded_commands_go_before_replayed_ones(tmp_path: Any) -> None:
    t = np.arange(3.0)
    columns = {"t": t, "wheel.A.v_ref": t - 1, "replay.A.v_ref": t, "wheel.B.v_ref": t * np.nan, "replay.B.v_ref": t}
    speeds = speeds_of(columns, ("A", "B", "C"))
    assert speeds is not None
    assert {k: v.tolist() for k, v in speeds.by_wheel.items()} == {"A": [1.0, 0.0, 1.0], "B": [0.0, 1.0, 2.0]}
    assert speeds_of({"t": t}, ("A",)) is None
    assert read_speeds(tmp_path / "absent.parquet", ("A",)) is None


def test_columns_without_numbers_hold_no_commands(tmp_path: Any) -> None:
    words, numbers, path = ["x", "y"], [1.0, 2.0], tmp_path / "report.parquet"
    for columns in (
        {"t": words, "wheel.A.v_ref": numbers},
        {"t": numbers, "wheel.A.v_ref": words},
        {"t": [[1.0], [2.0]], "wheel.A.v_ref": numbers},
    ):
        pq.write_table(pa.table(columns), path)
        assert read_speeds(path, ("A",)) is None


@pytest.mark.parametrize(("value", "expected"), [(0.0, 0), (0.19, 0), (0.2, 1), (0.7, 3), (1.0, 3), (1.2, 3)])
def test_bands_hold_their_lower_end(value: float, expected: int) -> None:
    assert band_of(value, EPSILON_BANDS) == expected
    assert band_of(inf, EPSILON_BANDS) == 3


def test_names_of_the_columns() -> None:
    assert COLUMNS[: len(TRUE_STATES)] == TRUE_STATES
    assert COLUMNS[-1] == "undecided"
