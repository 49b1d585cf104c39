"""A machine that only turns on the spot says nothing of what its wheels make of a commanded speed."""

from __future__ import annotations

import numpy as np

from diagnosis.response.assess import assess_response
from diagnosis.results.assessment import CODE
from replay.faults import State
from replay.machine.config import Limits
from tests.diagnosis.response.robot import commands, followers_of, geometry, robot_of


def test_slow_turns_on_the_spot_are_no_wrong_unit() -> None:
    _, turn = commands(4)
    measured, asked, body = robot_of(0.0 * turn, 0.6 * turn, 4)
    judged = assess_response(followers_of(measured, asked, body), geometry(), None, Limits(driving_speed=0.05), 0.05)
    for sensor, _ in judged.parts.values():
        assert not any("× its command" in why for why in sensor.reasons.values())
        assert not sensor.findings
        assert np.count_nonzero(sensor.states == CODE[State.HEALTHY]) > 200


def test_turns_in_a_wrong_unit_are_no_healthy_ones() -> None:
    _, turn = commands(4)
    measured, asked, body = robot_of(0.0 * turn, turn, 4)
    scaled = {w: 0.3 * y for w, y in measured.items()}
    judged = assess_response(followers_of(scaled, asked, body), geometry(), None, Limits(driving_speed=0.01), 0.05)
    for sensor, _ in judged.parts.values():
        assert any("× its command" in why for why in sensor.reasons.values())
        assert not np.any(sensor.states == CODE[State.HEALTHY])
