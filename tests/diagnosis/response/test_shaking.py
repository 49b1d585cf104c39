"""Noise that effort or yaw rate show as well may be a wheel that shakes; noise that they do not is the sensor's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, TRACK, followers_of, geometry, speeds

FAULT = slice(round(60 / DT), round(75 / DT))


@pytest.mark.parametrize(
    ("shakes", "side"),
    [("", Side.SENSOR), ("effort", Side.SENSOR_OR_ACTUATOR), ("yaw", Side.SENSOR_OR_ACTUATOR)],
)
def test_noise_is_the_sensors_unless_effort_or_yaw_rate_shake_too(shakes: str, side: Side) -> None:
    measured, asked, body = speeds(7, ("R", "L"))
    rng = np.random.default_rng(7)
    size = measured["R"].size
    shake = np.zeros(size)
    shake[FAULT] = rng.uniform(-0.25, 0.25, FAULT.stop - FAULT.start)
    effort = {w: 2.0 * y + rng.normal(0.0, 0.05, size) for w, y in measured.items()}
    yaw = (measured["R"] - measured["L"]) / TRACK + rng.normal(0.0, 0.01, size)
    measured["R"] = measured["R"] + shake
    effort["R"] = effort["R"] + (8.0 * shake if shakes == "effort" else 0.0)
    yaw = yaw + (shake / TRACK if shakes == "yaw" else 0.0)
    data = {w: replace(d, effort=effort[w]) for w, d in followers_of(measured, asked, body).items()}
    j = assess_response(data, geometry(("R", "L")), yaw, Limits(driving_speed=0.05), DT)
    found = [(w, f) for w, sides in j.parts.items() for a in sides for f in a.findings]
    assert {(w, f.mode, f.side) for w, f in found} == {("R", FaultMode.NOISY, side)}
    assert all(("cannot be distinguished" in f.evidence[-1]) is (side is not Side.SENSOR) for _, f in found)
