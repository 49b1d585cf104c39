"""A machine that is larger and as much faster is judged alike: nothing in the wheel model is a speed of its own."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.pipeline import diagnose_signals
from diagnosis.results.document import IntervalRow
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import Machine, haulotte
from replay.signals.signal import Signals
from tests.diagnosis.clearing.missions import LENGTH, signals_of, simulated

FAULTS = (
    FaultSpec("RL", Side.SENSOR, FaultMode.INEFFICIENT, 10.0, 25.0, 0.5),
    FaultSpec("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL, 35.0, LENGTH, 1.0),
)
SPEEDS = (".v", ".v_ref")


def larger(machine: Machine, times: float) -> Machine:
    geometry = machine.geometry
    assert geometry is not None
    assert machine.plant.flow is not None
    wheels = {
        name: replace(w, x=w.x * times, y=w.y * times, offset=w.offset * times) for name, w in geometry.wheels.items()
    }
    return replace(
        machine,
        max_speed=machine.max_speed * times,
        geometry=replace(geometry, wheels=wheels, wheel_diameter=geometry.wheel_diameter * times),
        limits=replace(machine.limits, driving_speed=machine.limits.driving_speed * times),
        plant=replace(machine.plant, flow=machine.plant.flow * times),
    )


def findings(signals: Signals, times: float) -> list[IntervalRow]:
    items = {n: replace(s, values=s.values * times) if n.endswith(SPEEDS) else s for n, s in signals.items.items()}
    report = diagnose_signals(replace(signals, items=items), larger(haulotte(), times)).report
    return [f for f in report["intervals"] if f["severity"] != "info"]


def test_a_larger_machine_is_judged_alike() -> None:
    signals = signals_of(simulated(*FAULTS), base=True)
    signals = replace(signals, items={n: s for n, s in signals.items.items() if not n.startswith(("gnss", "imu"))})
    usual, large = findings(signals, 1.0), findings(signals, 4.0)
    names = [(f["component"], f["side"], f["mode"], f["severity"]) for f in usual]
    assert {component for component, *_ in names} == {"RL", "FR"}
    assert [(f["component"], f["side"], f["mode"], f["severity"]) for f in large] == names
    for a, b in zip(usual, large, strict=True):
        assert a["probability"] == pytest.approx(b["probability"], abs=0.1)  # trees turn at thresholds
        assert a["start_s"] == pytest.approx(b["start_s"], abs=0.2)
