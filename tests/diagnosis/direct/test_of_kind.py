"""What lasts: a disturbance is no healthy valve's noise, and what a healthy one drifts by is none of a fault's."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from diagnosis.direct.fault_runs import _where_it_deviates
from diagnosis.direct.identification import identify
from diagnosis.direct.isolation import isolate
from diagnosis.estimation.fault_models import NOISY, STUCK
from diagnosis.estimation.segments import Run
from diagnosis.pipeline import diagnose_signals
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import Limits, haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from tests.diagnosis.direct.test_assess import pair

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_a_valve_disturbed_from_start_to_end_is_noisy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its slow deviations are what a lag would leave, and the other valves seem to have them until all lag alike."""
    monkeypatch.setattr(sys, "path", [str(BENCHMARKS), *sys.path])
    from variation import recorded_signals

    disturbed = FaultSpec(
        "FR", Side.ACTUATOR, FaultMode.NOISY, 0.0, 40.0, epsilon=0.4, sat=0.08, sat_std=0.08, sat_tau_s=0.8
    )
    made = simulate_mission(
        SimulationOptions(scenario="random", seed=615, duration_s=40.0, rate_hz=200.0, faults=(disturbed,))
    )
    report = diagnose_signals(recorded_signals(made, "spool"), haulotte()).report
    found = [f for f in report["intervals"] if f["severity"] != "info"]
    assert [(f["component"], f["side"], f["mode"]) for f in found] == [("FR", "actuator", "noisy")]


@pytest.mark.parametrize("disturbed", [False, True])
def test_a_noisy_run_is_cut_to_where_the_valve_is_off(disturbed: bool) -> None:
    """Slow drift that is none of a fault makes noise the better explanation of a whole mission, once something else is off for a while."""
    dt, n, start, stop = 0.005, 15_000, 6760, 9160
    t, rng = np.arange(n) * dt, np.random.default_rng(2)
    command = np.full(n, 0.25)
    opening = command + 0.004 * np.sin(t / 9.0) + (0.05 * np.sin(2.0 * t) if disturbed else 0.0)
    opening[start:stop] += 0.052
    fresh = np.arange(n) % 10 == 0  # a position of 20 Hz beside a command of 200 Hz
    y = np.repeat((opening + 0.0008 * rng.normal(size=n))[fresh], 10)
    found = identify(pair(Side.ACTUATOR, y, command, dt, fresh=fresh), Limits(), most=0.0008)
    whole = Run(0, n, NOISY)
    runs = _where_it_deviates(whole, found.samples, found.model)
    if disturbed:
        assert runs == [whole]
    else:
        (run,) = runs
        assert (run.start, run.stop) == pytest.approx((start, stop), abs=50)
        isolated = isolate(run, found, 0.02)
        assert isolated is not None
        assert isolated.run.row == STUCK  # or off by a constant: the command rests
        assert isolated.p[NOISY] < 0.1
