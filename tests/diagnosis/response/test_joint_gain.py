"""A speed that is a share of its own joint's position all through the mission."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from diagnosis.response.inputs import FollowerData
from diagnosis.response.joint_gain import scaled_channels
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, TRACK, followers_of, geometry, speeds


def with_positions(seed: int, gains: dict[str, float]) -> dict[str, FollowerData]:
    measured, asked, body = speeds(seed)
    rng = np.random.default_rng(seed)
    true = {w: y + rng.normal(0.0, 0.01, y.size) for w, y in measured.items()}
    drives = followers_of({w: y * gains.get(w, 1.0) for w, y in measured.items()}, asked, body)
    return {w: replace(d, rolled=true[w]) for w, d in drives.items()}


@pytest.mark.parametrize(("seed", "gain"), [(51, 0.6), (52, 0.75), (53, 1.4)])
def test_it_is_the_sensors_fault_with_its_size_and_nobody_elses(seed: int, gain: float) -> None:
    data = with_positions(seed, {"RR": gain})
    measured, _, _ = speeds(seed)
    yaw = 0.5 * (measured["FR"] + measured["RR"] - measured["FL"] - measured["RL"]) / TRACK
    judgement = assess_response(data, geometry(), yaw, Limits(), DT)
    found = [(w, f) for w, sides in judgement.parts.items() for a in sides for f in a.findings]
    ((wheel, fault),) = found
    assert (wheel, fault.side) == ("RR", Side.SENSOR)
    assert fault.mode is (FaultMode.INEFFICIENT if gain < 1.0 else FaultMode.OUTSIDE_TABLE)
    assert fault.epsilon is not None
    assert fault.epsilon.value == pytest.approx(1.0 - gain, abs=0.02)
    assert not judgement.gyro


def test_all_speeds_in_another_unit_blame_no_sensor() -> None:
    assert scaled_channels(with_positions(54, dict.fromkeys(("FR", "FL", "RR", "RL"), 0.6)), DT) == {}


def test_a_position_that_is_scaled_itself_blames_no_speed() -> None:
    data = with_positions(55, {})
    rolled = data["RR"].rolled
    assert rolled is not None
    data["RR"] = replace(data["RR"], rolled=rolled / 0.6)
    assert scaled_channels(data, DT) == {}


def test_a_speed_that_is_scaled_for_half_of_the_mission_has_no_one_gain() -> None:
    data = with_positions(56, {})
    y = data["RR"].y.copy()
    y[: y.size // 2] *= 0.6
    data["RR"] = replace(data["RR"], y=y)
    assert scaled_channels(data, DT) == {}
