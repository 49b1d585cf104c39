"""Which ends of a machine turn it: of more axles than two, the outer steered ones."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from diagnosis.clearing.yaw import turning_ends
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
