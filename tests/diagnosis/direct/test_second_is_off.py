"""Which of two speeds deviates by itself: the sensor, or the second one beside it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.second_is_off import without_second_speeds_own
from diagnosis.estimation.lag import low_passed
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
DT, SIZE = 0.01, 6000
WHEELS = ("FR", "FL", "RR", "RL")
T = np.arange(SIZE) * DT
OPENING = 0.6 + 0.2 * np.sin(2 * np.pi * T / 17.0)
START, STOP = 2000, 3500
INSIDE = (np.arange(SIZE) >= START) & (np.arange(SIZE) < STOP)
RNG = np.random.default_rng(3)
SLOW = low_passed(RNG.standard_normal(SIZE), 0.5, DT)
SLOW *= 0.06 / SLOW.std()


def speeds(opening: Array) -> Array:
    return 0.8 * low_passed(opening, 0.15, DT)


def sensor(reading: Array, second: Array) -> IdentifiedPair:
    noise = 0.004 * np.random.default_rng(4).standard_normal((2, SIZE))
    return cast(
        IdentifiedPair,
        SimpleNamespace(pair=SimpleNamespace(y=reading + noise[0], x=second + noise[1], dt=DT, span=2.0)),
    )


def told(
    reading: Array,
    second: Array,
    opening: Array = OPENING,
    mode: FaultMode = FaultMode.NOISY,
    span: tuple[int, int] = (START, STOP),
) -> Assessment:
    """What is left of a finding about one of four sensors."""
    states = np.full(SIZE, CODE[State.HEALTHY])
    states[slice(*span)] = CODE[State(mode.value)]
    finding = Finding(*span, Side.SENSOR, mode, 0.96, (), None, None, (), Tier.DIRECT)
    sound, healthy = speeds(OPENING), Assessment(np.full(SIZE, CODE[State.HEALTHY]), tier=Tier.DIRECT)
    pairs = {w: sensor(reading, second) if w == "FR" else sensor(sound, sound) for w in WHEELS}
    assessments = dict.fromkeys(WHEELS, healthy) | {"FR": Assessment(states, findings=(finding,), tier=Tier.DIRECT)}
    return without_second_speeds_own(pairs, assessments, {w: opening if w == "FR" else OPENING for w in WHEELS})["FR"]


def test_a_second_speed_that_wanders_by_itself_is_no_fault_of_the_sensor() -> None:
    sound = speeds(OPENING)
    left = told(sound, sound + SLOW * INSIDE)
    assert left.findings == ()
    assert (left.states[START:STOP] == CODE[State.NOT_ASSESSED]).all()


def test_one_that_wanders_for_the_whole_mission_is_judged_by_what_the_others_do() -> None:
    sound = speeds(OPENING)
    assert told(sound, sound + SLOW, span=(0, SIZE)).findings == ()


def test_a_sensor_that_wanders_stays() -> None:
    sound = speeds(OPENING)
    assert told(sound + SLOW * INSIDE, sound).findings


def test_a_sensor_whose_reading_its_loop_holds_stays() -> None:
    """The wheel does what the sensor's noise makes of its opening, which explains the second speed."""
    opening = OPENING + 0.8 * SLOW * INSIDE
    held = speeds(OPENING)
    assert told(held, speeds(opening), opening).findings


@pytest.mark.parametrize("mode", [FaultMode.INEFFICIENT, FaultMode.STUCK])
def test_a_share_and_one_value_stay(mode: FaultMode) -> None:
    sound = speeds(OPENING)
    reading = np.where(INSIDE, 0.7 * sound if mode is FaultMode.INEFFICIENT else 0.4, sound)
    assert told(reading, sound, mode=mode).findings


def test_a_moment_tells_nothing() -> None:
    sound = speeds(OPENING)
    assert told(sound, sound + SLOW * INSIDE, span=(START, START + 100)).findings


def test_a_wheel_that_its_opening_does_not_move_tells_nothing() -> None:
    """Where the sensor is as little explained as the second speed, neither is in the right."""
    pushed = speeds(OPENING) + 0.1 * SLOW
    other = low_passed(np.random.default_rng(9).standard_normal(SIZE), 0.5, DT)
    assert told(pushed + 0.3 * other / other.std() * 0.06, pushed + SLOW * INSIDE).findings


@pytest.mark.parametrize(("opens", "stays"), [(0.0, False), (0.3, True)])
def test_a_sensor_that_reads_nothing_while_nothing_drives_its_wheel_is_sound(opens: float, *, stays: bool) -> None:
    rests = np.zeros(SIZE)
    pairs = {w: sensor(rests, rests + 0.4 * INSIDE if w == "FR" else rests) for w in WHEELS}
    states = np.full(SIZE, CODE[State.HEALTHY])
    finding = Finding(START, STOP, Side.SENSOR, FaultMode.NO_SIGNAL, 0.96, (), None, None, (), Tier.DIRECT)
    healthy = Assessment(states, tier=Tier.DIRECT)
    assessments = dict.fromkeys(WHEELS, healthy) | {"FR": Assessment(states, findings=(finding,), tier=Tier.DIRECT)}
    after = without_second_speeds_own(pairs, assessments, dict.fromkeys(WHEELS, rests + opens))["FR"]
    assert bool(after.findings) is stays
