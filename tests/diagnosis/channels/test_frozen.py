"""A speed that never changes while the machine drives is a dead sensor, and costs no other wheel its name."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.frozen import frozen_sensor, frozen_speeds
from diagnosis.pipeline import diagnose_signals
from diagnosis.results.assessment import CODE
from replay.faults import FaultMode, FaultSpec, Side, State
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign

DT, SIZE = 0.01, 3000


def speeds() -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(SIZE) * DT
    command = np.tile((0.3 * np.sin(2 * np.pi * t / 9))[:, None], (1, 4))
    return command + np.random.default_rng(0).normal(0, 0.005, command.shape), command


@pytest.mark.parametrize("block", [1 << 19, 100])
@pytest.mark.parametrize("value", [0.0, 0.21])
def test_a_number_that_never_changes(monkeypatch: pytest.MonkeyPatch, block: int, value: float) -> None:
    monkeypatch.setattr("replay.arrays.blocks.BLOCK", block)
    v, command = speeds()
    v[:, 2] = value
    v[:50, 2] = np.nan
    assert frozen_speeds(v, command, 0.05, DT) == {2: value}


def test_what_is_no_dead_sensor() -> None:
    v, command = speeds()
    assert frozen_speeds(v, command, 0.05, DT) == {}
    v[:, 1] = 0.2
    v[1500, 1] = 0.21
    assert frozen_speeds(v, command, 0.05, DT) == {}  # it lives
    v[:, 1] = 0.2
    assert frozen_speeds(v, command * 0, 0.05, DT) == {}  # nothing is commanded
    assert frozen_speeds(v, np.full_like(command, 0.2), 0.05, DT) == {}  # a steady command may read steady
    still = np.zeros_like(v)
    assert frozen_speeds(still, command, 0.05, DT) == {}  # the whole machine stands
    assert frozen_speeds(v[:, 1:2], command[:, 1:2], 0.05, DT) == {}  # no other wheel to compare with


def test_zero_is_sure_only_where_noise_would_show() -> None:
    v, _ = speeds()
    y = np.zeros(SIZE)
    noisy = frozen_sensor(y, 0.0, v[:, 1:], "wheel.FR.v", DT)
    coarse = frozen_sensor(y, 0.0, np.round(v[:, 1:], 1), "wheel.FR.v", DT)
    assert noisy.findings[0].mode.value == "no_signal"
    assert noisy.findings[0].probability > 0.9 > coarse.findings[0].probability
    assert set(noisy.states) == {CODE[State.NO_SIGNAL]}


@pytest.mark.parametrize("seed", campaign([30, 31]))
def test_a_sensor_that_is_dead_all_the_time_stops_the_machine(seed: int) -> None:
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 0.0, 60.0, 1.0, float("nan"), 0.0)
    options = SimulationOptions(
        scenario="healthy", duration_s=60.0, rate_hz=100.0, seed=seed, faults=(fault,), evidence="base"
    )
    mission, items = simulate_mission(options), {}
    for name, values in mission.columns.items():
        rows = mission.rows(name)
        items[name] = Signal(name, mission.stamps[rows], values[rows], SignalSource(column=name), "a.csv", False)
    report = diagnose_signals(Signals(items, {}), haulotte()).report
    assert report["verdict"]["status"] == "stop"
    (found,) = report["intervals"]
    assert (found["component"], found["side"], found["mode"]) == ("FR", "sensor", "stuck")
    assert (found["start_s"], found["stop_s"]) == (0.0, pytest.approx(60.0, abs=0.05))
