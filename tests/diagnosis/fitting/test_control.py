"""The control law of healthy missions: doubt counts, and a controller of another kind is named."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.fitting.control import ControlFit, lambda_doubt
from diagnosis.fitting.document import fit_toml
from diagnosis.fitting.machine import Constant, with_control
from diagnosis.fitting.missions import fit_missions
from diagnosis.fitting.robust import Estimate
from diagnosis.fitting.units import speed_mistakes
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, haulotte
from replay.mission import Mission
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import StructureOptions

GIVEN = replace(haulotte(), control=replace(haulotte().control, law="opposed"))
NONE = Estimate(float("nan"), float("nan"))


def fitted(value: float, std: float) -> ControlFit:
    return ControlFit("opposed", "forced", Estimate(value, std), NONE, NONE, 0.95, NONE, (0, 1, 2), ())


def doubt(value: float, std: float, machine: Machine = GIVEN) -> str:
    return lambda_doubt(fitted(value, std), machine, speed_mistakes(machine))[0]


@pytest.mark.parametrize(("value", "std"), [(7.8, 9.1), (1.4, 0.3), (0.1, 0.6), (1.1, 0.001)])
def test_a_lambda_that_could_be_right_is_no_wrong_unit(value: float, std: float) -> None:
    assert not doubt(value, std)


def test_a_lambda_that_is_surely_far_is_doubted() -> None:
    assert "7.8 ± 0.2 s/m is 7.8 times" in doubt(7.8, 0.2)
    assert "percent" in doubt(100.0, 1.0)


def test_an_uncertain_lambda_is_not_written() -> None:
    constants: list[Constant] = []
    out = with_control(GIVEN, GIVEN, fitted(7.8, 9.1), False, constants)
    assert out.control == GIVEN.control
    assert not constants[0].written
    assert constants[0].why == "too uncertain"


@pytest.fixture(scope="module")
def pi_missions() -> list[Mission]:
    out = []
    for seed in (1, 2):
        made = simulate_mission(
            SimulationOptions(
                scenario="healthy",
                seed=seed,
                duration_s=40.0,
                rate_hz=200.0,
                evidence="base",
                structure=StructureOptions("torque", machine_seed=3),
            )
        )
        items = {n: Signal(n, made.stamps, x, SignalSource(column=n), "sim", False) for n, x in made.columns.items()}
        signals = Signals(items, {})
        out.append(Mission((), signals, align(signals)))
    return out


def test_a_controller_of_another_kind_is_named(pi_missions: list[Mission]) -> None:
    result = fit_missions(pi_missions, haulotte())
    assert result.machine.control.law == "none"
    assert not result.unit_errors
    assert "none of MFHCA's" in result.notes[0]
    assert "explains at least 99.9 %" in result.notes[0] or "explains at least 100.0 %" in result.notes[0]
    assert 'law = "none"' in fit_toml(result)
    assert not any(c.written for c in result.constants if c.key.startswith("control."))
