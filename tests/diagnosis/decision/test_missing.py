"""Every signal that a machine can have has a cost when it is missing."""

from __future__ import annotations

import pytest

from diagnosis.decision.missing import _COSTS, cost_of_missing
from diagnosis.results.machine_words import HYDRAULIC
from replay.errors import ConfigError
from replay.machine.config import haulotte
from replay.machine.signal_table import CANONICAL


def test_every_canonical_signal_has_a_cost() -> None:
    assert [name for name in haulotte().canonical_signals() if not cost_of_missing(name, HYDRAULIC)] == []
    assert set(_COSTS) == {entry.kind for entry in CANONICAL}


@pytest.mark.parametrize("name", ["wheel.FR.colour", "moon.phase"])
def test_an_unknown_name_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="not a known signal"):
        cost_of_missing(name, HYDRAULIC)


def test_sensor_and_actuator_differ() -> None:
    assert "drive valve is judged by its effort alone" in cost_of_missing("wheel.RL.u", HYDRAULIC)
    assert "rests on a model" in cost_of_missing("wheel.RL.v_true", HYDRAULIC)
    assert cost_of_missing("steer.front.u", HYDRAULIC) != cost_of_missing("wheel.FR.u", HYDRAULIC)


def test_a_command_of_the_body_costs_little_where_every_wheel_has_its_own() -> None:
    wheels = ("FR", "FL")
    assert "little" in cost_of_missing("cmd.v", HYDRAULIC, {"wheel.FR.v_ref", "wheel.FL.v_ref"}, wheels)
    assert "no wheel has a command" in cost_of_missing("cmd.v", HYDRAULIC, {"wheel.FR.v_ref"}, wheels)


def test_of_a_steering_without_commands_is_said_what_it_was_judged_by() -> None:
    command, position = "steer.front.u", "steer.front.u_applied"
    assert "replayed control law" in cost_of_missing(command, HYDRAULIC, {"steer.front.phi"})
    assert "is not judged: its position" in cost_of_missing(command, HYDRAULIC, {position})
    assert "neither" in cost_of_missing(position, HYDRAULIC, {"steer.front.phi"})
    assert "how the angle follows its command" in cost_of_missing(position, HYDRAULIC, {command})
