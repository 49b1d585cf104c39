from __future__ import annotations

import numpy as np

from diagnosis.report.rows import Row, Trace, derived, row_json
from tests import report_samples as samples

ROW = Row(
    "v", "Speed", "m/s", (Trace("a", "A", "measured"), Trace("b", "B", "peer")), band=("low", "high"), threshold="h"
)


def test_loss_and_its_bounds_are_those_of_the_fault() -> None:
    report, columns = samples.five_faults()
    shown = derived(columns, report)
    for fault in report["intervals"]:
        inside = (columns["t"] >= fault["start_s"]) & (columns["t"] < fault["stop_s"])
        base = f"evidence.{fault['component']}.{fault['side']}."
        for leaf, key in (("epsilon", "value"), ("epsilon_low", "low"), ("epsilon_high", "high")):
            np.testing.assert_allclose(shown[base + leaf][inside], fault["epsilon"][key], rtol=1e-6)
    assert not any(name.endswith("epsilon") for name in columns)


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
