"""The steering command of machines that log only commands of the body."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from diagnosis.steering.inputs import _replayed
from replay.machine.config import Limits

SPEED = np.array([0.0, 0.02, -0.09, 0.11, -1.0])  # two a second


def _timeline(**signals: Any) -> Any:
    named = {"cmd.v": SPEED, **{f"steer.front.{leaf}": x for leaf, x in signals.items()}}
    return SimpleNamespace(dt=0.5, get=named.get, map=lambda function, *columns: function(*columns))


MACHINE: Any = SimpleNamespace(axles=("front",), max_speed=1.0, limits=Limits(driving_speed=0.05))
LOOP: Any = SimpleNamespace(steer_u=np.full((5, 1), 0.3))


def test_commands_that_hardly_move_the_body_tell_no_angle_nor_do_those_that_set_it_off() -> None:
    told = np.isfinite(_replayed(_timeline(), LOOP, MACHINE, 0))
    assert told.tolist() == [False, False, False, False, True]


def test_a_logged_angle_command_tells_itself_at_any_speed() -> None:
    assert np.isfinite(_replayed(_timeline(phi_ref=np.zeros(5)), LOOP, MACHINE, 0)).all()
