from __future__ import annotations

import math

import numpy as np

from diagnosis.report.plot_data import figures_of
from diagnosis.report.plot_rows import loop_groups
from diagnosis.report.rows import derived
from diagnosis.report.units import units_of
from tests import report_samples as samples


def test_units_of_columns_with_and_without_a_figure() -> None:
    report, columns = samples.five_faults()
    shown = derived(columns, report["intervals"])
    figures = figures_of(report["intervals"], report["machine"], shown, None)
    groups = loop_groups(report["machine"]["wheels"], report["machine"]["axles"], shown)
    names = [
        "wheel.FR.v",
        "steer.front.phi",
        "imu.yaw_rate",
        "replay.FR.u_difference",
        "evidence.front.sensor.residual",
    ]
    units = units_of([*names, "evidence.FR.actuator.expected", "path.x", "made.up"], report, figures, groups)
    assert [u for u, _ in units] == ["m/s", "°", "°/s", "of full opening", "°", "of full opening", "m", "unknown unit"]
    np.testing.assert_allclose([units[1][1], units[2][1], units[0][1]], [180 / math.pi, 180 / math.pi, 1.0])
