from __future__ import annotations

import numpy as np

from diagnosis.report.rows import Row, Trace, derived, row_json
from tests import report_samples as samples

ROW = Row(
    "v", "Speed", "m/s", (Trace("a", "A", "measured"), Trace("b", "B", "peer")), band=("low", "high"), threshold="h"
)


def test_loss_and_its_bounds() -> None:
    columns = {"evidence.FR.sensor.delta": np.array([0.7]), "evidence.FR.sensor.delta_std": np.array([0.1])}
    result = derived(columns, [samples.fault()])
    np.testing.assert_allclose(result["evidence.FR.sensor.epsilon"], 0.3)
    np.testing.assert_allclose(result["evidence.FR.sensor.epsilon_low"], 0.3 - 0.1959964)
    np.testing.assert_allclose(result["evidence.FR.sensor.epsilon_high"], 0.3 + 0.1959964)
    assert set(columns) == {"evidence.FR.sensor.delta", "evidence.FR.sensor.delta_std"}


def test_what_does_not_exist_is_left_out() -> None:
    one = np.zeros(1)
    (row,) = ROW.shown({"a": one, "low": one, "h": one})
    assert ([t.column for t in row.traces], row.band, row.threshold) == (["a"], None, "h")
    assert ROW.shown({"low": one, "high": one}) == []


def test_columns_become_places_of_channels() -> None:
    data = row_json(ROW, {name: i for i, name in enumerate(ROW.columns())})
    assert data["traces"][1] == {"c": 1, "name": "B", "role": "peer", "k": 1.0, "right": False}
    assert (data["band"], data["threshold"], data["bandScale"]) == ([2, 3], 4, 1.0)
    assert "level" not in data
