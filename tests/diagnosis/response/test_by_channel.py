"""What a speed shows by itself: readings that no wheel can make, and a fall to 0 beside wheels that go on."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.by_channel import once_a_turn, spikes_of
from diagnosis.response.channel import samples_of
from diagnosis.response.jumps import Jumps, jumps_of
from diagnosis.response.models import Blocks
from diagnosis.response.wheel import Wheel
from replay.faults import FaultMode
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds

Array = NDArray[np.float64]


@pytest.mark.parametrize(("size", "number", "p"), [(33.0, 2, 0.99), (33.0, 1, 0.97), (1.8, 2, 0.0)])
def test_few_readings_are_enough_where_no_wheel_can_make_them(size: float, number: int, p: float) -> None:
    measured, asked, body = speeds(3)
    measured["RR"][1200 : 1200 + 10 * number : 10] += size
    judged = assess_response(followers_of(measured, asked, body), geometry(), None, Limits(), DT)
    found = {
        w: [f.probability for f in parts[0].findings if f.mode is FaultMode.NOISY] for w, parts in judged.parts.items()
    }
    assert found == {"FR": [], "FL": [], "RL": [], "RR": [p] if p else []}


@pytest.mark.parametrize(("steps", "jumps"), [(1, 1), (4, 0)])
def test_steps_of_a_ramp_that_is_read_now_and_then_are_no_jump(steps: int, jumps: int) -> None:
    n, width = 400, 5
    y = np.full(n, -2.7) + np.random.default_rng(1).normal(0.0, 0.005, n)
    for k in range(steps):
        y[100 + 5 * k :] += 4.7 / steps
    b = np.full(n // width, 2.0)
    blocks = Blocks(np.arange(n // width) * width, b, b, b, b, b, b, b, b, b)
    found: Jumps = jumps_of(samples_of(y, np.ones(n, np.bool_)), blocks, width, DT)[0]
    assert found.place.size == jumps


@pytest.mark.parametrize("goes_on", [True, False])
def test_a_robot_that_ignores_its_commands_is_judged_by_its_channels(*, goes_on: bool) -> None:
    rng = np.random.default_rng(5)
    n = 1040
    t = np.arange(n) * DT
    turning = (t > 20.0) & (t < 40.0)
    measured = {
        "R": np.where(turning, np.round(-1.5 + 0.02 * rng.normal(size=n), 3), 0.0),
        "L": np.where(turning, np.round(-0.9 + 0.02 * rng.normal(size=n), 3), 0.0),
    }
    measured["R"][(t >= 25.0) & (t < 33.0)] = 0.0
    if not goes_on:
        measured["L"][(t >= 25.0) & (t < 33.0)] = 0.0
    body = np.column_stack([np.where(t > 26.0, 0.4, -0.3), np.where(t > 32.0, 0.3, -0.4)])
    asked = {"R": body[:, 0] + 0.3 * body[:, 1], "L": body[:, 0] - 0.3 * body[:, 1]}
    judged = assess_response(followers_of(measured, asked, body), geometry(("R", "L")), None, Limits(), DT)
    found = [(w, f.start * DT, f.stop * DT) for w, parts in judged.parts.items() for f in parts[0].findings]
    assert found == ([("R", pytest.approx(25.0, abs=0.1), pytest.approx(33.0, abs=0.1))] if goes_on else [])


@pytest.mark.parametrize(("apart", "sign", "turns"), [(1.0, 1, True), (1.0, -1, False), (0.3, 1, False)])
def test_one_wild_reading_a_turn_is_an_angle_that_starts_anew(apart: float, sign: int, *, turns: bool) -> None:
    n = 3000
    v = -0.8 - 0.4 * np.sin(np.arange(n) * DT / 5.0)
    way = np.abs(np.cumsum(v)) * DT
    rng = np.random.default_rng(2)
    at = [int(np.searchsorted(way, 1.3 * (k + (0.0 if apart == 1.0 else rng.uniform(0.0, 0.9))))) for k in range(1, 12)]
    y = v + rng.normal(0.0, 0.002, n)
    y[at] = v[at] + sign * 62.8
    samples = samples_of(y, np.ones(n, np.bool_))
    assert np.count_nonzero(samples.wild) == len(at)
    assert once_a_turn(samples, y, DT) is turns


def test_spikes_of_both_signs_are_spikes() -> None:
    rng = np.random.default_rng(3)
    y = -1.0 + rng.normal(0.0, 0.002, 3000)
    at = np.arange(100, 2900, 130)
    y[at] += 30.0 * rng.choice([-1, 1], at.size)
    assert not once_a_turn(samples_of(y, np.ones(3000, np.bool_)), y, DT)
    assert not once_a_turn(samples_of(y[:90], np.ones(90, np.bool_)), y[:90], DT)


def test_readings_far_beyond_all_others_count_although_every_wheel_has_wild_ones_unless_another_reads_as_much() -> None:
    rng = np.random.default_rng(4)
    y = 0.5 + rng.normal(0.0, 0.002, 3000)
    at = np.array([500, 700, 900, 1100])
    y[at] += 3.0 * np.array([1, -1, 1, 1])
    samples = samples_of(y, np.ones(3000, np.bool_))
    none = Blocks(np.zeros(0, np.intp), *(np.zeros(0) for _ in range(9)))
    jumps = Jumps(np.zeros(0, np.intp), np.zeros(0))
    wheel = Wheel("wheel.R.v", samples, none, jumps, DT, "", spiky=False)
    other = np.full(3000, 0.5)
    (found,) = spikes_of(wheel, y, 0.05, (other,))
    assert (found.start, found.stop) == (500, 1101)
    other[::100] = 4.0
    assert spikes_of(wheel, y, 0.05, (other,)) == []
    near = np.where(np.abs(y) > 1.0, np.sign(y) * 1.2, y)
    assert spikes_of(wheel._replace(samples=samples_of(near, np.ones(3000, np.bool_))), near, 0.05) == []
