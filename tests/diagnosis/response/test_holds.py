"""What a channel holds again and again beside others that do not is no habit."""

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from diagnosis.response.holds import usual_hold
from replay.faults import FaultMode
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds


def test_holds_above_a_gap_are_none_of_a_habit_however_many_they_are() -> None:
    own, other = np.r_[[4.0] * 12, 0.1, 0.05], np.array([0.2, 0.1, 0.1])
    assert usual_hold("FR", {"FR": own, "FL": other}) == 0.1


def test_holds_without_a_gap_are_a_habit() -> None:
    coarse = np.array([2.0, 1.6, 1.3, 1.0, 0.8, 0.6, 0.4, 0.2])
    assert usual_hold("FR", {"FR": coarse, "FL": np.array([0.2, 0.1, 0.1])}) == 0.8


def test_what_other_wheels_hold_as_long_is_a_habit() -> None:
    assert usual_hold("FR", {"FR": np.array([4.0] * 6), "FL": np.array([3.0, 2.5, 2.5])}) == 4.0


def test_a_lone_channel_has_the_habit_that_it_shows() -> None:
    assert usual_hold("FR", {"FR": np.array([4.0] * 6)}) == 4.0


@pytest.mark.parametrize(("seed", "length"), [(41, 4.0), (42, 2.0)])
def test_a_sensor_that_freezes_again_and_again_is_told_each_time(seed: int, length: float) -> None:
    measured, asked, body = speeds(seed)
    y, width = measured["FL"], round(length / DT)
    change = [np.abs(y[a : a + width] - y[a]).max() for a in range(y.size - width)]
    moving = np.flatnonzero((np.array(change) > 0.3) & (np.abs(y[: len(change)]) > 0.3))
    starts = [int(moving[0])]
    for a in moving:
        starts += [int(a)] if a > starts[-1] + 2 * width else []
    for a in starts:
        y[a : a + width] = y[a]
    parts = assess_response(followers_of(measured, asked, body), geometry(), None, Limits(), DT).parts
    stuck = [f for f in parts["FL"][0].findings if f.mode is FaultMode.STUCK]
    assert len(starts) > 5
    assert len(stuck) > 0.6 * len(starts)
    assert not any(f for w in ("FR", "RR", "RL") for f in parts[w][0].findings if f.mode is FaultMode.STUCK)
