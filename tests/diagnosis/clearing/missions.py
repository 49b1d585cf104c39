"""Simulated missions in cells, with and without second measurements."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.checks import cells_of, checks_of
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import HYDRAULIC
from replay.arrays.envelope import bucket_of
from replay.control.loop import replay_loop
from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

LENGTH = 60.0
_BASE = ("_true", ".u_applied", "imu.yaw_rate", "gnss.lat", "gnss.lon")


@cache
def simulated(*faults: FaultSpec, seed: int = 5) -> SimulatedMission:
    """A mission of `LENGTH` with these faults, driven once: whoever changes a column copies it."""
    return simulate_mission(
        SimulationOptions(scenario="random", seed=seed, duration_s=LENGTH, rate_hz=100.0, faults=faults)
    )


def signals_of(mission: SimulatedMission, *, base: bool) -> Signals:
    """A mission as it was logged, or with commands and single measurements alone."""
    items = {
        name: Signal(name, mission.stamps, values, SignalSource(column=name), "simulated", guessed=False)
        for name, values in mission.columns.items()
        if not (base and name.endswith(_BASE))
    }
    return Signals(items=items, missing={})


def in_cells(mission: SimulatedMission, *, base: bool, clear_at: float = 0.25) -> Cells:
    """The same in cells."""
    timeline, machine = align(signals_of(mission, base=base)), haulotte()
    machine = replace(machine, limits=replace(machine.limits, clear_at=clear_at))
    return cells_of(timeline, replay_loop(timeline, machine, bucket_of(timeline.size)), machine)


def checks(mission: SimulatedMission, *, base: bool, clear_at: float = 0.25) -> dict[tuple[str, str, Check], Checked]:
    """Its checks by component, side and what is asked."""
    found = checks_of(in_cells(mission, base=base, clear_at=clear_at), HYDRAULIC)
    return {(c.component, c.side.value, c.check): c for c in found}
