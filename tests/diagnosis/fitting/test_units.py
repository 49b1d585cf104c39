"""Wrong units and signs are named with what to change, and nothing that rests on them is written."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.fitting.document import fit_toml
from diagnosis.fitting.missions import fit_missions
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.mission import Mission
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign_of_rows

WHEELS = ("FR", "FL", "RR", "RL")
R = 0.427


@pytest.fixture(scope="module")
def drive() -> SimulatedMission:
    return simulate_mission(
        SimulationOptions(scenario="healthy", seed=3, duration_s=40.0, rate_hz=100.0, evidence="base")
    )


def read(drive: SimulatedMission, factors: dict[str, float], without: str = "-") -> Mission:
    """The mission as a wrong line in [signals] reads it."""
    items = {
        name: Signal(name, drive.stamps, x * factors.get(name, 1.0), SignalSource(column=name), "sim", False)
        for name, x in drive.columns.items()
        if not name.startswith(without)
    }
    signals = Signals(items, {})
    return Mission((), signals, align(signals))


def each(leaf: str, factor: float) -> dict[str, float]:
    return {f"wheel.{w}.{leaf}": factor for w in WHEELS}


SPEED = {f"plant.{w}" for w in WHEELS} | {"control", "geometry"}
CASES: list[tuple[str, dict[str, float], tuple[str, ...], set[str]]] = [
    ("motor speed", each("v", 17.7), ("gear ratio 17.7", 'at = "motor"'), SPEED),
    ("rad/s as m/s", each("v", 1 / R), ("wheel radius 0.427 m", 'unit = "rad/s"'), SPEED),
    ("one wheel", {"wheel.FR.v": 17.7}, ("wheel.FR.v,", "gear ratio"), {"plant.FR", "control", "geometry"}),
    ("flipped valve", {"wheel.RL.u": -1.0}, ("wheel.RL.u,", "gain = -1"), {"plant.RL", "control"}),
    ("percent", each("u", 100.0), ('unit = "%"',), {"plant.FR", "control"}),
    ("degrees", {"steer.front.phi": 180 / np.pi}, ("steer.front.phi,", 'unit = "deg"'), {"geometry"}),
    ("flipped angle", {"steer.rear.phi": -1.0}, ("steer.rear.phi,", "gain = -1"), {"geometry"}),
    ("motor read at wheel", each("v", 1 / 17.7), ("gear ratio 17.7", 'at = "wheel"'), SPEED),
    ("m/s as rad/s", each("v", R), ("wheel radius 0.427 m", 'unit = "m/s"'), SPEED),
    ("rpm as rad/s", each("v", 60 / 2 / np.pi), ("rpm read as rad/s", 'unit = "rpm"'), SPEED),
    ("command rpm", each("v_ref", 60 / 2 / np.pi), ("v_ref", "rpm read as rad/s"), {"plant.FR", "control"}),
    ("both rad/s", each("v", 1 / R) | each("v_ref", 1 / R), ("wheel radius 0.427 m",), SPEED),
    ("flipped", {"wheel.FR.v": -1.0}, ("wheel.FR.v,", "gain = -1"), {"plant.FR", "control", "geometry"}),
    ("no percent", each("u", 0.01), ('unit = "fraction"',), {"plant.FR", "control"}),
    ("no degrees", {"steer.rear.phi": np.pi / 180}, ("steer.rear.phi,", 'unit = "rad"'), {"geometry"}),
]


@pytest.mark.parametrize(
    ("factors", "words", "kept"), campaign_of_rows([c[1:] for c in CASES], 7), ids=[c[0] for c in CASES]
)
def test_a_wrong_unit_is_named(
    drive: SimulatedMission, factors: dict[str, float], words: tuple[str, ...], kept: set[str]
) -> None:
    result = fit_missions([read(drive, factors)], haulotte())
    text = " / ".join(e.text for e in result.unit_errors)
    assert all(word in text for word in words), text
    assert "[signals]" in text
    assert {s for e in result.unit_errors for s in e.signals} == set(factors)
    assert not {c.key for c in result.constants if c.written and c.key.startswith(tuple(kept))}
    assert not {c.key for c in result.constants if c.written and any(f"{n}." in c.key for n in factors)}
    assert result.unit_errors[0].text in fit_toml(result)


@pytest.mark.parametrize(
    ("factor", "word"), campaign_of_rows([(1 / R, "wheel radius"), (17.7, "gear ratio"), (1 / 17.7, "gear ratio")], 2)
)
def test_speed_and_command_wrong_alike_without_the_bodys_command(
    drive: SimulatedMission, factor: float, word: str
) -> None:
    result = fit_missions([read(drive, each("v", factor) | each("v_ref", factor), without="cmd.")], haulotte())
    assert any(word in e.text for e in result.unit_errors), [e.text for e in result.unit_errors]
    assert not result.machine.plant.wheels
    assert result.machine.control == haulotte().control


def test_a_healthy_log_has_none(drive: SimulatedMission) -> None:
    for without in ("-", "cmd.", "steer."):
        assert fit_missions([read(drive, {}, without)], haulotte()).unit_errors == ()
