"""Every signal that a machine can have has a cost when it is missing."""

from __future__ import annotations

from diagnosis.decision.missing import cost_of_missing
from replay.machine.config import haulotte


def test_every_canonical_signal_has_a_cost() -> None:
    assert [name for name in haulotte().canonical_signals() if not cost_of_missing(name)] == []


def test_an_unknown_name_has_none() -> None:
    assert cost_of_missing("wheel.FR.colour") == cost_of_missing("moon.phase") == ""


def test_sensor_and_actuator_differ() -> None:
    assert "actuator is not assessed" in cost_of_missing("wheel.RL.u")
    assert "rests on the wheel model" in cost_of_missing("wheel.RL.v_true")
    assert cost_of_missing("steer.front.u") != cost_of_missing("wheel.FR.u")
