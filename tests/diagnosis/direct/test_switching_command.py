"""A dead valve whose command switches to and fro between its ends, at a log's rate: nothing of it is healthy, or silent while it moves."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.direct.findings import _unresolved
from diagnosis.direct.stated_row import not_silent
from diagnosis.estimation.fault_models import HEALTHY, INEFFICIENT, NO_SIGNAL, NOISY
from diagnosis.estimation.segments import Run
from diagnosis.pipeline import diagnose_signals
from replay.faults import Side
from replay.machine.config import haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import StructureOptions

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_a_channel_that_shows_something_isnot_silent() -> None:
    p = np.array([0.1, 0.1, 0.5, 0.1, 0.2])
    out = not_silent(p, Side.ACTUATOR)
    assert out[NO_SIGNAL] == 0.0
    assert out[HEALTHY] == p[HEALTHY]
    assert out[NOISY] > p[NOISY]
    assert out.sum() == pytest.approx(p.sum())


def test_a_dead_valve_under_a_switching_command_is_never_healthy(monkeypatch: pytest.MonkeyPatch) -> None:
    """The drives of this structure overshoot, so that the command of the dead one runs from end to end, and back in between."""
    monkeypatch.setattr(sys, "path", [str(BENCHMARKS), *sys.path])
    from variation import recorded_signals

    made = simulate_mission(
        SimulationOptions(
            scenario="random",
            seed=5102,
            duration_s=40.0,
            rate_hz=200.0,
            steering_faults=True,
            structure=StructureOptions("electric"),
        )
    )
    dead = next(
        f for f in made.truth.intervals if (f.component, f.side.value, f.mode.value) == ("FR", "actuator", "no_signal")
    )
    report = diagnose_signals(recorded_signals(made, "spool"), haulotte()).report
    healthy = sum(
        max(0.0, min(s["stop_s"], dead.stop_s) - max(s["start_s"], dead.start_s))
        for s in report["states"]
        if (s["component"], s["side"], s["state"]) == ("FR", "actuator", "healthy")
    )
    assert healthy < 0.02 * (dead.stop_s - dead.start_s)


@pytest.mark.parametrize(
    ("coarse", "stop", "size", "open_"),
    [(True, 30, 0.1, True), (True, 90, 0.1, False), (True, 30, 0.5, False), (False, 30, 0.1, False)],
)
def test_a_moment_below_the_threshold_of_a_log_too_slow_is_no_fault(
    coarse: bool, stop: int, size: float, open_: bool
) -> None:
    isolated: Any = SimpleNamespace(run=Run(0, stop, INEFFICIENT), seen=SimpleNamespace(deviation=size, noise=0.1))
    found: Any = SimpleNamespace(coarse=coarse, pair=SimpleNamespace(dt=0.01))
    assert _unresolved(isolated, found) is open_
