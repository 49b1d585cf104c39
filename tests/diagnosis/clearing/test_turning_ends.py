"""Which ends of a machine turn it: of more axles than two, the outer steered ones."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.clearing.yaw import _of_the_middle, turning_ends
from replay.machine.config import Machine


@pytest.mark.parametrize(
    ("axles", "ends"),
    [
        ({"front": 2.0, "rear": -2.0}, {2.0: ["front"], -2.0: ["rear"]}),
        ({"front": 2.0, "fixed": -1.0}, {2.0: ["front"], -1.0: ["fixed"]}),
        ({"front": 2.2, "fixed": 0.0, "rear": -2.2}, {2.2: ["front"], -2.2: ["rear"]}),
        ({"one": 3.0, "two": 1.0, "three": -1.0, "four": -3.0}, {3.0: ["one"], -3.0: ["four"]}),
    ],
)
def test_the_outer_steered_ends_turn_a_machine(axles: dict[str, float], ends: dict[float, list[str]]) -> None:
    wheels = {
        f"{axle}{side}": SimpleNamespace(x=x, y=y, axle=axle)
        for axle, x in axles.items()
        for side, y in (("L", 1.0), ("R", -1.0))
    }
    machine = SimpleNamespace(axles=tuple(a for a in axles if a != "fixed"), geometry=SimpleNamespace(wheels=wheels))
    assert turning_ends(cast(Machine, machine)) == ends


def test_the_middle_of_a_machine_is_between_its_sides_where_a_wheels_speed_is_not_logged() -> None:
    """In a turn the median of three wheels is one side's."""
    wheels = ("FR", "FL", "RR", "RL")
    geometry: Any = SimpleNamespace(
        wheels={w: SimpleNamespace(y=0.0, offset=1.0 if w[1] == "L" else -1.0) for w in wheels}
    )
    turning = np.tile([1.2, 0.8, 1.2, 0.8], (5, 1))
    for missing in ([], [0], [1, 3]):
        speeds = turning.copy()
        speeds[:, missing] = np.nan
        expected = 0.0 if len(missing) == 2 else 1.0  # of one side alone nothing is said
        assert _of_the_middle(geometry, wheels, speeds) == pytest.approx(np.full(5, expected))


def test_the_middle_of_a_tricycle_is_its_drive() -> None:
    places = {"drive": 0.0, "L": 0.5, "R": -0.5}
    geometry: Any = SimpleNamespace(wheels={w: SimpleNamespace(y=y, offset=0.0) for w, y in places.items()})
    speeds = np.column_stack([np.full(5, 0.7), np.full((5, 2), np.nan)])
    assert _of_the_middle(geometry, tuple(places), speeds) == pytest.approx(np.full(5, 0.7))
