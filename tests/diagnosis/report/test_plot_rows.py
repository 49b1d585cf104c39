from __future__ import annotations

import numpy as np

from diagnosis.report.plot_rows import derived, fault_rows, loop_groups
from tests import report_samples as samples

WHEELS = ["FR", "FL", "RR", "RL"]


def test_rows_of_a_sensor_fault() -> None:
    report, columns = samples.five_faults()
    fault = report["intervals"][0]
    rows = fault_rows(fault, WHEELS, derived(columns, [fault]))
    assert [r.key for r in rows] == ["v", "residual", "epsilon", "sat", "modes", "psi", "u", "peers"]
    assert [t.role for t in rows[0].traces] == ["commanded", "reference", "expected", "measured"]
    assert all(r.unit for r in rows)


def test_steering_is_shown_in_degrees() -> None:
    report, columns = samples.five_faults()
    fault = report["intervals"][3]
    rows = fault_rows(fault, ["front", "rear"], derived(columns, [fault]))
    assert rows[0].unit == "°"
    assert rows[0].traces[-1].scale == 180 / np.pi


def test_directly_measured_valve_is_compared_with_its_command() -> None:
    report, columns = samples.five_faults()
    fault = {**report["intervals"][1], "tier": "direct"}
    rows = {r.key: r for r in fault_rows(fault, WHEELS, derived(columns, [fault]))}
    assert "expected" in [t.role for t in rows["u"].traces]
    assert "expected" not in [t.role for t in rows["v"].traces]
    assert rows["residual"].unit == "of full opening"


def test_loss_and_its_bounds() -> None:
    fault = {"component": "FR", "side": "sensor"}
    columns = {"evidence.FR.sensor.delta": np.array([0.7]), "evidence.FR.sensor.delta_std": np.array([0.1])}
    result = derived(columns, [fault])
    np.testing.assert_allclose(result["evidence.FR.sensor.epsilon"], 0.3)
    np.testing.assert_allclose(result["evidence.FR.sensor.epsilon_low"], 0.3 - 0.1959964)
    np.testing.assert_allclose(result["evidence.FR.sensor.epsilon_high"], 0.3 + 0.1959964)
    assert set(columns) == {"evidence.FR.sensor.delta", "evidence.FR.sensor.delta_std"}


def test_only_existing_columns_make_rows() -> None:
    assert fault_rows({"component": "FR", "kind": "wheel", "side": "sensor", "tier": "signal"}, ["FR"], {}) == ()
    (group,) = loop_groups(["FR"], [], {"wheel.FR.u": np.zeros(3)})
    assert (group.key, [r.title for r in group.rows]) == ("drive", ["u_a FR"])
