"""Speeds that are published more often than the encoder is read."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from diagnosis.response.pulses import share_of
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, speeds


@pytest.mark.parametrize(("every", "pulses"), [(1, False), (2, True), (4, True)])
def test_zeros_between_readings_of_the_fastest_motion_are_pulses(every: int, *, pulses: bool) -> None:
    speed = np.abs(speeds(3, ("R", "L"))[0]["R"])
    counted = np.where(np.arange(speed.size) % every == 0, every * speed, 0.0)
    assert (share_of(counted) >= 0.35) is pulses


def test_a_coarse_encoder_has_none_where_it_is_fast() -> None:
    speed = np.linspace(0.0, 1.0, 2000)
    step = 0.3
    counted = step * np.diff(np.floor(np.cumsum(speed) / step))
    assert np.mean(counted[200:600] == 0.0) > 0.3
    assert share_of(counted) < 0.35


def test_a_machine_whose_speed_comes_in_pulses_is_not_told_as_one_that_did_not_follow() -> None:
    rng = np.random.default_rng(3)
    n = round(120 / DT)
    asked = np.where(np.arange(n) % 400 < 300, 1.0, 0.0)
    went = np.where(asked > 0.0, 0.3, 0.0)
    y = np.zeros(n)
    at = np.flatnonzero(rng.random(n) < 0.3)
    y[at] = went[at] / 0.3
    body = np.column_stack([asked, np.zeros(n)])
    found = assess_response(followers_of({"D": y}, {"D": asked}, body), None, None, Limits(driving_speed=0.05), DT)
    assert not any("did not follow" in x.text or "were commanded" in x.text for x in found.events)
    assert any("comes in pulses" in x.text for x in found.unshown) or not found.events
