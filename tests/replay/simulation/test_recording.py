"""Late stamps and lost rows reach every format of a log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from replay.export.mission import FORMATS, write_mission
from replay.log.source_options import SourceOptions
from replay.machine.config import haulotte
from replay.readers.registry import read_log, summarise_log
from replay.signals.mapping import map_signals, plan_topics
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_holds_the_recorded_rows_at_their_stamps(tmp_path: Path, name: str) -> None:
    mission = simulate_mission(
        SimulationOptions(duration_s=4.0, rate_hz=100, jitter=0.7, drop_share=0.2, drop_burst_s=0.05)
    )
    assert all(0.3 < rows.mean() < 1.0 for rows in mission.kept.values())
    path = tmp_path / "log"
    write_mission(mission, path, name)
    summary = summarise_log(path, SourceOptions())
    log = read_log(path, SourceOptions(), plan_topics([summary], haulotte())[summary.source])
    signals = map_signals([log], haulotte()).items
    for key, stamps, values in mission.series():
        # A table leaves the cells of lost rows empty; they are no samples.
        sample = np.isfinite(signals[key].values)
        assert_array_equal(signals[key].stamps[sample], stamps, err_msg=key)
        assert_allclose(signals[key].values[sample], values, rtol=1e-12, atol=1e-12, err_msg=key)
