"""A command that is logged much more rarely than the opening beside it: what it was in between is nobody's fault."""

from __future__ import annotations

from functools import cache

import pytest

from diagnosis.pipeline import diagnose_signals
from diagnosis.results.document import IntervalRow
from replay.faults import FaultMode, FaultSpec, Side
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission

_EVERY = 20  # of the commands' samples is kept: 50 Hz beside 1 kHz
FAULT = FaultSpec("FL", Side.ACTUATOR, FaultMode.INEFFICIENT, 20.0, 30.0, 0.5)


@cache
def _signals(*faults: FaultSpec) -> Signals:
    options = SimulationOptions(
        scenario="healthy", seed=701, duration_s=45.0, rate_hz=1000.0, evidence="spool", faults=faults or None
    )
    mission, items = simulate_mission(options), {}
    for name, values in mission.columns.items():
        step = _EVERY if name.endswith(".u") else 1
        items[name] = Signal(
            name, mission.stamps[::step], values[::step], SignalSource(column=name), "a.mcap", guessed=False
        )
    return Signals(items, {})


def _found(*faults: FaultSpec) -> list[IntervalRow]:
    report = diagnose_signals(_signals(*faults), haulotte()).report
    return [f for f in report["intervals"] if f["severity"] != "info"]


def test_a_command_that_switches_between_its_samples_blames_no_valve() -> None:
    assert _found() == []


def test_a_loss_is_found_with_its_time_and_size() -> None:
    (fault,) = _found(FAULT)
    assert (fault["component"], fault["side"], fault["mode"]) == ("FL", "actuator", "inefficient")
    assert fault["start_s"] == pytest.approx(FAULT.start_s, abs=0.1)
    assert fault["stop_s"] == pytest.approx(FAULT.stop_s, abs=0.1)
    assert fault["epsilon"] is not None
    assert fault["epsilon"]["value"] == pytest.approx(0.5, abs=0.05)
