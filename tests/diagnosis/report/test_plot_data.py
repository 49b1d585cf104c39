from __future__ import annotations

import json
import zlib
from base64 import b64decode

import numpy as np
import pytest

from diagnosis.report.plot_data import axis_of, channels_of, figures_of, packed_intervals, worst
from diagnosis.report.plot_rows import loop_groups
from diagnosis.report.rows import derived
from diagnosis.results.machine_words import HYDRAULIC
from tests import report_samples as samples


@pytest.mark.parametrize(("rate", "per"), [(100.0, 1), (130.0, 1), (200.0, 4), (3200.0, 64)])
def test_rows_farther_apart_than_samples_are_extremes(rate: float, per: int) -> None:
    assert axis_of({"t": np.arange(50) / 100.0}, rate).per == per


def test_no_axis_without_time() -> None:
    assert axis_of({}, 100.0).rows == 0


def test_the_most_severe_faults_in_the_order_given() -> None:
    severities = ["low", "high", "info", "medium", "high"]
    faults = [samples.fault(id=f"F{i}", severity=s) for i, s in enumerate(severities)]
    assert [f["id"] for f in worst(faults, 3)] == ["F1", "F3", "F4"]
    assert worst(faults, 9) == faults


def test_faults_of_one_part_share_their_rows() -> None:
    report, columns = samples.five_faults()
    faults = [*report["intervals"], {**report["intervals"][0], "id": "F9"}]
    figures = figures_of(faults, report["machine"], derived(columns, report), 0.9)
    assert figures["F1"] is figures["F9"]
    assert figures["F1"] is not figures["F2"]


def test_columns_without_a_figure_get_what_is_left_of_the_budget() -> None:
    rng = np.random.default_rng(0)
    columns = {name: rng.standard_normal(60_000) for name in ("wheel.A.v", "gnss.speed")}
    report = samples.report_with()
    axis = axis_of({"t": np.arange(60_000) / 1000.0}, 1000.0)
    groups = loop_groups(["A"], [], columns, HYDRAULIC)
    shown, other = channels_of(report, columns, {}, groups, axis, 150_000)
    assert (shown.name, shown.segments[0].stride) == ("wheel.A.v", 1)
    assert other.segments[0].stride > 1
    assert shown.size + other.size <= 150_000 + 50_000


def test_intervals_come_back_as_they_were() -> None:
    fault = samples.fault(evidence=["</script>"], sat=None)
    assert json.loads(zlib.decompress(b64decode(packed_intervals([fault])))) == {"F1": fault}
