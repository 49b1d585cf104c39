from __future__ import annotations

import math

import numpy as np

from diagnosis.report.plot_data import figures_of
from diagnosis.report.plot_rows import loop_groups
from diagnosis.report.rows import derived
from diagnosis.report.units import units_of
from diagnosis.results.machine_words import HYDRAULIC
from tests import report_samples as samples


def test_units_of_columns_with_and_without_a_figure() -> None:
    report, columns = samples.five_faults()
    shown = derived(columns, report)
    figures = figures_of(report["intervals"], report["machine"], shown, None)
    groups = loop_groups(report["machine"]["wheels"], report["machine"]["axles"], shown, HYDRAULIC)
    assert report["coverage"]
    for row in report["coverage"]:
        if (row["component"], row["side"]) == ("FR", "actuator"):
            row["tier"] = "direct"
    names = [
        "wheel.FR.v",
        "steer.front.phi",
        "imu.yaw_rate",
        "replay.FR.u_difference",
        "evidence.front.sensor.residual",
        "evidence.FR.actuator.expected",
        "evidence.RL.actuator.expected",
        "evidence.rear.actuator.threshold",
        "evidence.rear.actuator.sat",
        "path.x",
        "made.up",
    ]
    units = units_of(names, report, {}, ())
    assert [u for u, _ in units_of(names[:5], report, figures, groups)] == ["m/s", "°", "°/s", "% of opening", "°"]
    opening = "% of opening"
    assert [u for u, _ in units] == ["m/s", "°", "°/s", opening, "°", opening, "m/s", "°", opening, "m", "unknown unit"]
    np.testing.assert_allclose([units[1][1], units[2][1], units[0][1]], [180 / math.pi, 180 / math.pi, 1.0])
