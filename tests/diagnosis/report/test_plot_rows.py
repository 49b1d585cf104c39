from __future__ import annotations

import numpy as np
import pytest

from diagnosis.report.compared_channels import pair_of
from diagnosis.report.evidence_rows import _lowest, small_stretches, untold_stretches
from diagnosis.report.plot_rows import course_rows, fault_rows, loop_groups
from diagnosis.report.rows import derived
from diagnosis.results.machine_words import HYDRAULIC
from tests import report_samples as samples

WHEELS = ["FR", "FL", "RR", "RL"]


def test_rows_of_a_sensor_fault() -> None:
    report, columns = samples.five_faults()
    fault = report["intervals"][0]
    rows = fault_rows(fault, WHEELS, derived(columns, report), HYDRAULIC)
    assert [r.key for r in rows] == ["v", "residual", "epsilon", "sat", "modes", "psi", "u", "peers"]
    assert [t.role for t in rows[0].traces] == ["commanded", "reference", "expected", "measured"]
    assert all(r.unit for r in rows)


def test_a_side_that_is_healthy_is_not_called_as_a_wheel_without_fault() -> None:
    report, columns = samples.five_faults()
    elsewhere = {"side": "actuator", "mode": "stuck", "p": 0.04}
    fault = report["intervals"][0]
    own_side = [h for h in fault["hypotheses"] if h["side"] != "actuator"]
    for hypotheses, words in (
        (own_side, "healthy"),
        ([*own_side, elsewhere], "speed sensor healthy: drive valve faulty, or neither"),
    ):
        own = {**fault, "hypotheses": hypotheses}
        modes = next(r for r in fault_rows(own, WHEELS, derived(columns, report), HYDRAULIC) if r.key == "modes")
        assert next(t.label for t in modes.traces if t.column.endswith("p_healthy")) == words


def test_steering_is_shown_in_degrees() -> None:
    report, columns = samples.five_faults()
    fault = report["intervals"][3]
    rows = fault_rows(fault, ["front", "rear"], derived(columns, report), HYDRAULIC)
    assert rows[0].unit == "°"
    assert rows[0].traces[-1].scale == 180 / np.pi


def test_directly_measured_valve_is_compared_with_its_command() -> None:
    report, columns = samples.five_faults()
    fault = {**report["intervals"][1], "tier": "direct"}
    rows = {r.key: r for r in fault_rows(fault, WHEELS, derived(columns, report), HYDRAULIC)}
    assert "expected" in [t.role for t in rows["u"].traces]
    assert "expected" not in [t.role for t in rows["v"].traces]
    assert rows["residual"].unit == "% of opening"


def test_a_drive_that_pulls_nothing_is_shown_by_its_effort_and_the_law_only_beside_a_recorded_command() -> None:
    report, columns = samples.five_faults()
    fault = {**report["intervals"][1], "tier": "response", "kind": "wheel", "component": "FR", "side": "actuator"}
    fault["evidence"], fault["about"] = ["wheel.FR.effort is next to nothing for 12.2 s."], ["effort"]
    size = len(columns["t"])
    logged = {n: c for n, c in columns.items() if not n.endswith((".u", ".u_applied"))}
    logged |= {f"wheel.{w}.effort": np.ones(size) for w in WHEELS} | {"replay.FR.u": np.ones(size)}
    rows = {r.key: r for r in fault_rows(fault, WHEELS, logged, HYDRAULIC)}
    assert [t.role for t in rows["effort"].traces] == ["peer"] * 3 + ["measured"]
    assert not {"u", "psi"} & rows.keys()
    pair = pair_of(fault, logged, HYDRAULIC)
    assert pair is not None
    assert (pair.measured, pair.reference) == ("wheel.FR.effort", None)


def test_an_axis_of_losses_holds_a_part_that_gives_more_than_it_should() -> None:
    report, columns = samples.five_faults()
    fault = report["intervals"][0]
    columns = {**columns, "evidence.FR.sensor.epsilon": np.full(len(columns["t"]), -2.34)}
    (row,) = (r for r in fault_rows(fault, WHEELS, columns, HYDRAULIC) if r.key == "epsilon")
    assert row.clip is not None
    assert row.clip[0] < -2.34


def test_only_existing_columns_make_rows() -> None:
    assert fault_rows(samples.fault(), ["FR"], {}, HYDRAULIC) == ()
    (group,) = loop_groups(["FR"], [], {"wheel.FR.u": np.zeros(3)}, HYDRAULIC)
    assert (group.key, [r.title for r in group.rows]) == ("drive", ["u_a FR"])


def test_small_pictures_show_what_the_evidence_compares() -> None:
    report, columns = samples.five_faults()
    fault = report["intervals"][0]
    columns["evidence.FR.sensor.probability"] = 1.0 - columns["evidence.FR.sensor.p_healthy"]
    pair = pair_of(fault, columns, HYDRAULIC)
    assert pair is not None
    motion, residual, probability = course_rows(fault, pair, columns, 0.9)
    assert [(t.column, t.role) for t in motion.traces] == [(pair.reference, "reference"), (pair.measured, "measured")]
    assert (residual.threshold, residual.unit) == ("evidence.FR.sensor.threshold", "m/s")
    assert (probability.level, probability.unit) == (0.9, "1")


def test_both_figures_draw_the_same_residual() -> None:
    report, columns = samples.five_faults()
    fault = report["intervals"][3]
    pair = pair_of(fault, columns, HYDRAULIC)
    assert pair is not None
    linked = {r.key: r for r in fault_rows(fault, ["front", "rear"], derived(columns, report), HYDRAULIC)}
    assert course_rows(fault, pair, columns, None)[1] == linked["residual"]


def test_time_that_deviates_by_less_than_a_fault_is_told_apart_in_the_probability() -> None:
    t = np.arange(10.0)
    columns = {
        "t": t,
        "evidence.FR.sensor.probability": np.array([0.1, 0.9, 0.9, 0.9, 0.9, 0.1, 0.9, np.nan, 0.1, 0.1]),
        "evidence.FR.sensor.epsilon": np.array([0.0, 0.0, 0.0, 0.4, 0.4, 0.0, 0.0, np.nan, 0.0, 0.0]),
    }
    assert small_stretches("evidence.FR.sensor.", columns) == ((1.0, 3.0), (6.0, 7.0))
    assert small_stretches("evidence.FL.sensor.", columns) == ()


def test_what_is_most_probably_stuck_is_never_tinted_as_too_little_for_a_fault() -> None:
    base = "evidence.RR.actuator."
    columns = {"t": np.arange(40) * 0.1, f"{base}epsilon": np.zeros(40), f"{base}probability": np.ones(40)}
    stuck = np.where(np.arange(40) < 20, 1.0, 0.0)
    columns |= {f"{base}p_stuck": stuck, f"{base}p_inefficient": 1.0 - stuck}
    assert untold_stretches(base, columns) == ((0.0, 2.0),)
    assert small_stretches(base, columns) == ((2.0, 4.0),)


def test_the_axis_of_a_loss_ends_below_every_finite_one() -> None:
    for least, end in ((0.2, -1.0), (-2.0, -2.2)):
        losses = np.array([np.nan, least, 0.5])
        assert _lowest(losses) == _lowest(np.append(losses, -np.inf)) == pytest.approx(end)
    assert _lowest(None) == _lowest(np.full(3, np.nan)) == -1.0
