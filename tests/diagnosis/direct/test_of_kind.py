"""What valves of one kind are off by: none of it makes a disturbance that lasts a healthy valve's noise."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from diagnosis.pipeline import diagnose_signals
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.parametrize("seed", [603, 615])
def test_a_valve_disturbed_from_start_to_end_is_noisy(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its slow deviations are what a lag would leave, and the other valves seem to have them until all lag alike."""
    monkeypatch.setattr(sys, "path", [str(BENCHMARKS), *sys.path])
    from variation import recorded_signals

    disturbed = FaultSpec(
        "FR", Side.ACTUATOR, FaultMode.NOISY, 0.0, 40.0, epsilon=0.4, sat=0.08, sat_std=0.08, sat_tau_s=0.8
    )
    made = simulate_mission(
        SimulationOptions(scenario="random", seed=seed, duration_s=40.0, rate_hz=200.0, faults=(disturbed,))
    )
    report = diagnose_signals(recorded_signals(made, "spool"), haulotte()).report
    found = [f for f in report["intervals"] if f["severity"] != "info"]
    assert [(f["component"], f["side"], f["mode"]) for f in found] == [("FR", "actuator", "noisy")]
