"""Steering axles from healthy missions: found, written to the machine file, read back, and the prior of a mission."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from diagnosis.fitting.machine import Constant
from diagnosis.fitting.steering import fit_steering, with_steering
from diagnosis.steering.prior import axle_plant_of, plant_before
from replay.errors import ConfigError
from replay.log.source_options import SignalSource
from replay.machine.axle_plant import AxlePlant
from replay.machine.config import haulotte
from replay.machine.toml_file import load_machine
from replay.machine.toml_text import dump_machine
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline, align
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import StructureOptions

KNOWN = AxlePlant(4.0, 4.4, 0.02, 0.025, 0.05, 0.001, 0.25, None, 0.01, 0.3, 0.06, 0.05, 0.05, 1e-3, 1e-3, 5e-3, 1e-4)


@cache
def timeline(seed: int) -> Timeline:
    """A healthy mission of one machine with dead bands, two gains and play in its steering."""
    options = SimulationOptions(
        scenario="healthy",
        seed=seed,
        duration_s=90.0,
        rate_hz=500.0,
        structure=StructureOptions("valves", machine_seed=3),
    )
    mission = simulate_mission(options)
    items = {
        n: Signal(n, mission.stamps, x, SignalSource(column=n), "simulated", guessed=False)
        for n, x in mission.columns.items()
        if not n.endswith(("_true", ".u_applied"))
    }
    return align(Signals(items=items, missing={}))


@pytest.fixture(scope="module")
def found() -> dict[str, AxlePlant]:
    return fit_steering([timeline(k) for k in (41, 42)], haulotte(), set())


def test_both_axles_are_found_with_dead_band_and_play(found: dict[str, AxlePlant]) -> None:
    assert set(found) == {"front", "rear"}
    for plant in found.values():
        assert plant.lag == pytest.approx(0.05, abs=0.01)
        assert 0.019 < plant.dead_up < 0.041
        assert plant.dead_up == pytest.approx(plant.dead_down, abs=0.001)
        assert 4e-4 < plant.play < 2.2e-3
        assert plant.slope_up_std < 0.05 * plant.slope_up


def test_axles_with_wrong_units_are_left_out() -> None:
    assert set(fit_steering([timeline(41)], haulotte(), {"steer.front.phi"})) == {"rear"}


def test_a_machine_file_keeps_them(found: dict[str, AxlePlant], tmp_path: Path) -> None:
    constants: list[Constant] = []
    machine = with_steering(haulotte(), haulotte(), found, 2, constants)
    assert {c.key for c in constants if c.written} >= {"steering.front.dead_up", "steering.rear.play"}
    path = tmp_path / "machine.toml"
    path.write_text(dump_machine(machine), encoding="utf-8")
    assert load_machine(path).steering == machine.steering


def test_an_axle_that_is_not_logged_is_named() -> None:
    constants: list[Constant] = []
    assert with_steering(haulotte(), haulotte(), {}, 1, constants).steering == {}
    assert all(not c.written and c.why for c in constants)


def test_a_machine_file_names_axles_of_the_machine_only() -> None:
    with pytest.raises(ConfigError, match="no such axle"):
        replace(haulotte(), steering={"middle": KNOWN})
    with pytest.raises(ConfigError, match=r"steering\.lag"):
        replace(KNOWN, lag=0.0)


def test_what_is_known_before_a_mission_is_less_sure_than_what_was_found() -> None:
    plant = plant_before(KNOWN)
    assert plant.reliable
    assert plant.valve.slope_up == KNOWN.slope_up
    assert np.sqrt(plant.cov[0, 0]) > KNOWN.slope_up_std / KNOWN.slope_up
    again = axle_plant_of(plant)
    assert again.limit_up == KNOWN.limit_up
    assert again.limit_down is None
