"""Where commands or all samples are missing, nothing is known: no fault, and no health either."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.pipeline import diagnose_signals
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission

HOLE = (15.0, 25.0)


@pytest.fixture(scope="module")
def healthy() -> Signals:
    options = SimulationOptions(scenario="healthy", seed=3, duration_s=60.0, rate_hz=200.0, evidence="base")
    mission = simulate_mission(options)
    items = {}
    for name, values in mission.columns.items():
        rows = mission.rows(name)
        items[name] = Signal(name, mission.stamps[rows], values[rows], SignalSource(column=name), "a.csv", False)
    return Signals(items, {})


def with_hole(signals: Signals, *leaves: str) -> Signals:
    first = min(int(s.stamps[0]) for s in signals.items.values())
    items = {}
    for name, signal in signals.items.items():
        t = (signal.stamps - first) * 1e-9
        hole = (t >= HOLE[0]) & (t < HOLE[1]) & (name.endswith(leaves) if leaves else True)
        items[name] = replace(signal, values=np.where(hole, np.nan, signal.values))
    return replace(signals, items=items)


@pytest.mark.parametrize("leaves", [(".u",), ()], ids=["no valve commands", "no samples at all"])
def test_hole_is_neither_fault_nor_health(healthy: Signals, leaves: tuple[str, ...]) -> None:
    report = diagnose_signals(with_hole(healthy, *leaves), haulotte()).report
    assert [i for i in report["intervals"] if i["severity"] != "info"] == []
    for span in report["states"]:
        inside = min(span["stop_s"], HOLE[1] - 0.3) - max(span["start_s"], HOLE[0] + 0.3)
        if inside > 0:
            assert span["state"] in ("no_data", "not_assessed", "not_excited"), span
    said = " ".join(report["verdict"]["caveats"])
    assert "were not judged" in said if leaves else "No speed of any wheel was recorded for 10.0 s" in said
