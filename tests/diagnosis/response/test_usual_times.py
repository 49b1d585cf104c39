"""A fault that lasts for more than half of the mission is not its norm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.inputs import FollowerData
from diagnosis.response.usual_times import _shares, as_usual, shares_by_positions
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)


def robot(seed: int, scaled: dict[str, tuple[float, float]], *, positions: bool) -> dict[str, FollowerData]:
    """A robot on which some speeds read a share of what they should from a part of the mission on; positions read as the wheels turn."""
    measured, asked, body = speeds(seed)
    rng = np.random.default_rng(seed)
    rolled = {w: y + rng.normal(0.0, 0.002, y.size) for w, y in measured.items()}
    for w, (share, start) in scaled.items():
        measured[w][round(start * measured[w].size) :] *= share
    data = followers_of(measured, asked, body)
    return {w: replace(d, rolled=rolled[w]) for w, d in data.items()} if positions else data


@pytest.mark.parametrize("share", [0.7, 0.8, 1.25])
@pytest.mark.parametrize("positions", [True, False])
def test_what_has_changed_is_told_and_not_what_was_before(share: float, positions: bool) -> None:
    data = robot(2, {"FR": (share, 0.4)}, positions=positions)
    parts = assess_response(data, geometry(), None, LIMITS, DT).parts
    found = [f for side in parts["FR"] for f in side.findings if f.probability > 0.5]
    start = 0.4 * data["FR"].y.size
    assert found
    assert all(f.start > start - 5 / DT for f in found)
    assert found[0].mode is (FaultMode.INEFFICIENT if share < 1.0 else FaultMode.OUTSIDE_TABLE)
    assert not any(f.probability > 0.5 for w in parts if w != "FR" for side in parts[w] for f in side.findings)


def test_all_speeds_that_are_no_longer_their_positions_are_told() -> None:
    data = robot(3, dict.fromkeys(("FR", "FL", "RR", "RL"), (0.8, 0.45)), positions=True)
    parts = assess_response(data, geometry(), None, LIMITS, DT).parts
    for sensor, drive in parts.values():
        assert any(f.side is Side.SENSOR and f.mode is FaultMode.INEFFICIENT for f in sensor.findings)
        assert not drive.findings
        assert all(f.start > 0.4 * sensor.states.size for f in sensor.findings)


def test_a_healthy_robot_has_no_such_shares() -> None:
    for seed in range(4):
        data = robot(seed, {}, positions=True)
        assert not shares_by_positions(data, DT)
        parts = assess_response(data, geometry(), None, LIMITS, DT).parts
        assert not any(side.findings for sides in parts.values() for side in sides)


def test_shares_need_driving_of_both_kinds_and_one_number() -> None:
    data = robot(1, {"RL": (0.8, 0.45)}, positions=True)
    found = shares_by_positions(data, DT)
    assert list(found) == ["RL"]
    assert np.mean(found["RL"] == 1.0) == pytest.approx(0.45, abs=0.05)
    assert np.median(found["RL"]) == pytest.approx(0.8, abs=0.01)
    assert not shares_by_positions(robot(1, {"RL": (0.8, 0.0)}, positions=True), DT)
    assert not shares_by_positions(robot(1, {"RL": (0.8, 0.95)}, positions=True), DT)
    assert not shares_by_positions({"RL": replace(data["RL"], rolled=np.full(data["RL"].y.size, np.nan))}, DT)


def test_readings_are_brought_back() -> None:
    mean = np.array([1.0, 0.8, np.nan])
    assert as_usual(mean, None, 2) is mean
    np.testing.assert_allclose(as_usual(mean, np.array([1.0, 1.0, 0.8, 0.8, 0.8]), 2), [1.0, 1.0, np.nan])


def test_a_mission_of_a_day_takes_no_more_than_its_blocks() -> None:
    speed = np.ones(350_000)
    reading = np.where(np.arange(speed.size) < 200_000, 1.0, 0.7) * speed
    share = _shares(reading, speed)
    assert share is not None
    assert np.count_nonzero(share == 1.0) == pytest.approx(200_000, abs=20)
