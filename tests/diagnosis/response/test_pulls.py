"""What a drive pulls while its wheel reads nothing: as usual, or as one that is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
DEAD = slice(round(25 / DT), round(140 / DT))


@pytest.mark.parametrize("held", [True, False])
def test_a_wheel_that_is_held_for_most_of_the_mission_pulls_not_as_usual(held: bool) -> None:
    """Its effort at the limit is the commonest then, and usual beside nothing but itself."""
    measured, asked, body = speeds(3)
    rng = np.random.default_rng(3)
    efforts = {w: 2.0 * y + 3.0 * np.gradient(y, DT) + rng.normal(0.0, 0.2, y.size) for w, y in measured.items()}
    measured["RR"][DEAD] = 0.0
    if held:
        efforts["RR"][DEAD] = 25.0 * np.sign(asked["RR"][DEAD]) + rng.normal(0.0, 0.2, DEAD.stop - DEAD.start)
        efforts["FR"][DEAD] *= 1.5
    data = {w: replace(f, effort=efforts[w]) for w, f in followers_of(measured, asked, body).items()}
    j = assess_response(data, geometry(), None, LIMITS, DT)
    silent = [f for side in j.parts["RR"] for f in side.findings if f.mode is FaultMode.NO_SIGNAL]
    assert silent
    assert silent[0].side is (Side.SENSOR_OR_ACTUATOR if held else Side.SENSOR)
