"""A yaw rate that is wrong, beside wheels that are right, and a wheel that is wrong beside a yaw rate that is right."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.results.assessment import Finding
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, TRACK, followers_of, geometry, speeds

Array = NDArray[np.float64]
PAIR = ("R", "L")
SPELL = slice(round(60.0 / DT), round(90.0 / DT))


def told(measured: dict[str, Array], yaw: Array, seed: int) -> list[tuple[str, Finding]]:
    """Findings of both sides by wheel."""
    _, asked, body = speeds(seed, PAIR)
    data = followers_of(measured, asked, body)
    parts = assess_response(data, geometry(PAIR), yaw, Limits(), DT).parts
    return [(w, f) for w, sides in parts.items() for side in sides for f in side.findings]


def yaw_of(measured: dict[str, Array], seed: int) -> Array:
    """What a sound gyro reads [rad/s]."""
    rng = np.random.default_rng(seed + 7)
    return (measured["R"] - measured["L"]) / TRACK + rng.normal(0.0, 0.01, measured["R"].size)


@pytest.mark.parametrize("fault", ["dead", "frozen", "half", "shifted"])
@pytest.mark.parametrize("seed", [3, 8])
def test_no_wheel_is_blamed_for_a_wrong_yaw_rate(fault: str, seed: int) -> None:
    measured, _, _ = speeds(seed, PAIR)
    yaw = yaw_of(measured, seed)
    turning = SPELL.start + int(np.argmax(np.abs(yaw[SPELL])))
    yaw[SPELL] = {
        "dead": 0.0 * yaw[SPELL],
        "frozen": np.full(yaw[SPELL].size, yaw[turning]),
        "half": 0.5 * yaw[SPELL],
        "shifted": yaw[SPELL] + 0.4,
    }[fault]
    assert told(measured, yaw, seed) == []


@pytest.mark.parametrize("wheel", PAIR)
def test_a_wheel_that_reads_half_of_its_speed_is_told_beside_the_yaw_rate(wheel: str) -> None:
    measured, _, _ = speeds(3, PAIR)
    yaw = yaw_of(measured, 3)
    measured[wheel] = measured[wheel].copy()
    measured[wheel][SPELL] *= 0.5
    assert {w for w, _ in told(measured, yaw, 3)} == {wheel}
