"""Encoders of few counts: speeds in large steps, with single counts too many or too few in every wheel."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.channel import samples_of
from replay.faults import FaultMode
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, TRACK, WHEELS, followers_of, geometry, speeds

Array = NDArray[np.float64]

COUNT = 0.35  # m/s, of a count in a sample


def judged(measured: dict[str, Array], asked: dict[str, Array], body: Array) -> Judgement:
    return assess_response(followers_of(measured, asked, body), geometry(), None, Limits(driving_speed=0.05), DT)


def coarse(y: Array, rng: np.random.Generator, wild: float) -> Array:
    """Speed by counts in a sample, some of which hold two counts that belong to their neighbours."""
    counts = np.diff(np.floor(np.cumsum(y) / COUNT + rng.uniform()), prepend=0.0)
    counts[0] = 0.0
    counts[rng.random(y.size) < wild] += 3.0
    return np.asarray(counts * COUNT * rng.normal(1.0, 0.01, y.size))


@pytest.mark.parametrize("wild", campaign([0.15, 0.02, 0.0]))
def test_single_readings_that_are_off_in_every_wheel_are_a_habit_and_blame_none(wild: float) -> None:
    measured, asked, body = speeds(3)
    rng = np.random.default_rng(4)
    j = judged({w: coarse(y, rng, wild) for w, y in measured.items()}, asked, body)
    assert [f.mode for sensor, _ in j.parts.values() for f in sensor.findings] == []


def test_a_wheel_with_far_more_of_them_than_the_others_is_noisy() -> None:
    measured, asked, body = speeds(3)
    rng = np.random.default_rng(4)
    j = judged({w: coarse(y, rng, 0.03 if w == "RL" else 0.002) for w, y in measured.items()}, asked, body)
    found = {w: {f.mode for f in sensor.findings} for w, (sensor, _) in j.parts.items()}
    assert found == {w: ({FaultMode.NOISY} if w == "RL" else set()) for w in WHEELS}


def test_readings_of_which_a_fifth_is_off_are_steps_of_the_encoder() -> None:
    y = np.tile([0.0, 0.0, 0.0, 0.0, 3.0], 200)
    assert not samples_of(y, np.ones(y.size, np.bool_)).wild.any()
    y = np.r_[np.ones(400), 5.0, np.ones(400)]
    assert np.flatnonzero(samples_of(y, np.ones(y.size, np.bool_)).wild).tolist() == [400]


def test_one_commanded_speed_at_the_limit_leaves_the_weight_at_what_the_wheel_makes_of_it() -> None:
    """A keyboard commands one speed: a larger weight would be cut at the limit, and explains as much."""
    n = round(60 / DT)
    rng = np.random.default_rng(2)
    press = np.repeat(rng.integers(0, 4, 60), round(1.0 / DT))[:n]
    v, turn = np.where(press == 1, 0.5, 0.0), np.select([press == 2, press == 3], [0.5, -0.5])
    asked = {w: v + (0.5 if w == "R" else -0.5) * TRACK * turn for w in ("R", "L")}
    measured = {w: np.r_[np.zeros(3), a[:-3]] for w, a in asked.items()}
    data = followers_of(measured, asked, np.column_stack([v, turn]))
    j = assess_response(data, geometry(("R", "L")), None, Limits(driving_speed=0.05), DT)
    for sensor, _ in j.parts.values():
        assert not any("reads" in text for text in sensor.reasons.values())


def test_a_short_stop_that_few_readings_show_is_motion_and_not_spikes() -> None:
    """Odometry of 5 Hz: a start and a stop of half a second have a reading on their way, a spike has none."""
    drive = np.tile(np.r_[np.full(12, 0.2), 0.12, 0.0, 0.0, 0.05], 12) + np.random.default_rng(1).normal(0, 0.002, 192)
    every = np.ones(drive.size, np.bool_)
    assert not samples_of(drive, every).wild.any()
    drive[40] = 1.2
    assert np.flatnonzero(samples_of(drive, every).wild).tolist() == [40]


def test_what_the_command_explains_is_not_wild() -> None:
    y = np.full(200, 0.3)
    y[50], y[120] = 0.45, 2.0
    every, wide = np.ones(y.size, np.bool_), np.full(y.size, 0.3)
    wide[48:53] = 0.44
    assert np.flatnonzero(samples_of(y, every).wild).tolist() == [50, 120]
    assert np.flatnonzero(samples_of(y, every, (np.full(y.size, 0.3), wide)).wild).tolist() == [120]


def test_a_gain_between_two_of_the_models_is_found_however_quiet_the_channel_is() -> None:
    """A wheel that follows its command to a thousandth leaves no noise for the distance between two gains."""
    n = round(90 / DT)
    rng = np.random.default_rng(3)
    v = np.repeat(rng.choice([0.1, 0.2, 0.3], n // 100 + 1), 100)[:n]
    asked = {w: v.copy() for w in ("R", "L")}
    measured = {w: np.r_[np.zeros(3), a[:-3]] + rng.normal(0, 2e-4, n) for w, a in asked.items()}
    fault = slice(round(40 / DT), round(50 / DT))
    measured["R"][fault] *= 0.53
    j = judged(measured, asked, np.column_stack([v, np.zeros(n)]))
    assert {(w, f.mode) for w, (s, _) in j.parts.items() for f in s.findings} == {("R", FaultMode.INEFFICIENT)}
