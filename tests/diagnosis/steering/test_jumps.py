"""A valve's fault that begins or ends with a jump of the angle is its sensor's."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.jumps import as_sensors, of_sensor
from replay.faults import FaultMode, Side
from tests.diagnosis.estimation.test_angle_jumps import DT, FRESH, turned


def loss(start: int, stop: int, mode: FaultMode = FaultMode.INEFFICIENT) -> Finding:
    rows = (Hypothesis("actuator", mode, 0.92), Hypothesis("none", "healthy", 0.08))
    return Finding(start, stop, Side.ACTUATOR, mode, 0.92, rows, Epsilon(0.4, 0.3, 0.5), None, ("why",), Tier.MODEL)


def test_a_loss_with_a_jump_is_the_sensors() -> None:
    angle = turned()
    angle[3500:3900] *= 0.6
    mine = loss(3498, 3905)
    assert of_sensor([mine, loss(1000, 1400)], angle, FRESH, DT) == [mine]
    told = as_sensors(mine)
    assert (told.side, told.mode) == (Side.SENSOR, FaultMode.INEFFICIENT)
    assert told.probability == 0.9
    assert sum(h.p for h in told.hypotheses) == pytest.approx(1.0)
    assert told.evidence[-1] == "why"


def test_one_without_stays_the_valves() -> None:
    assert of_sensor([loss(3500, 3900)], turned(), FRESH, DT) == []


@pytest.mark.parametrize("mode", [FaultMode.STUCK, FaultMode.NO_SIGNAL])
def test_an_angle_that_comes_back_with_a_jump_was_not_read(mode: FaultMode) -> None:
    angle = turned()
    angle[:3900] = 0.0
    dead = loss(0, 3900, mode)
    assert of_sensor([dead], angle, FRESH, DT) == [dead]
    told = as_sensors(dead)
    assert (told.side, told.mode, told.probability) == (Side.SENSOR, mode, 0.9)


@pytest.mark.parametrize("mode", [FaultMode.STUCK, FaultMode.NO_SIGNAL])
def test_an_axle_that_turns_on_from_where_it_stood_was_read(mode: FaultMode) -> None:
    angle = np.concatenate([turned()[:3000], np.full(900, turned()[3000]), turned()[3000:5100]])
    assert of_sensor([loss(3000, 3900, mode)], angle, FRESH[: angle.size], DT) == []


@pytest.mark.parametrize("mode", [FaultMode.NOISY, FaultMode.OUTSIDE_TABLE])
def test_other_rows_keep_their_side(mode: FaultMode) -> None:
    angle = turned()
    angle[3500:3900] *= 0.6
    assert of_sensor([loss(3500, 3900, mode)], angle, FRESH, DT) == []


def test_no_readings_tell_nothing() -> None:
    assert of_sensor([loss(3500, 3900)], np.full(6_000, np.nan), FRESH, DT) == []
