"""A drive of which no answer to its command is found, judged by its channel alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.lone import by_its_channel, not_shared
from diagnosis.response.tracking import assess_tracking
from diagnosis.results.assessment import CODE
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits

Array = NDArray[np.float64]

DT, N = 0.05, 800  # 40 s at 20 Hz
PART = slice(300, 500)
LIMITS = Limits()
RESTS = np.full(N, 0.5)


def speed(seed: int, noise: float = 0.01) -> Array:
    """Of a drive that is told to keep one speed, and takes a second to reach it."""
    return 0.5 * np.minimum(1.0, np.arange(N) * DT) + noise * np.random.default_rng(seed).normal(size=N)


def drive(y: Array, asked: Array = RESTS, lost: tuple[tuple[int, int], ...] = ()) -> FollowerData:
    return FollowerData(y, np.isfinite(y), cells(asked, cell_of(DT))[:, None], asked, "wheel.D.v", lost=lost)


def stated(y: Array, asked: Array = RESTS, lost: tuple[tuple[int, int], ...] = ()) -> list[tuple[Side, FaultMode]]:
    found = by_its_channel(drive(y, asked, lost), None, LIMITS, DT)
    assert all(f.start >= PART.start - 2 and f.stop <= PART.stop + 2 for f in found)
    return [(f.side, f.mode) for f in found]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("step", [0.0, 0.02, 0.1])
def test_a_healthy_drive_shows_nothing(seed: int, step: float) -> None:
    y = speed(seed)
    assert stated(np.round(y / step) * step if step else y) == []


def test_a_value_that_is_held_is_frozen_where_the_channel_otherwise_changes() -> None:
    y = speed(1)
    y[PART] = y[PART.start]
    (found,) = by_its_channel(drive(y), None, LIMITS, DT)
    assert (found.side, found.mode, found.start, found.stop) == (Side.SENSOR, FaultMode.STUCK, PART.start, PART.stop)
    assert found.probability > 0.9
    assert "otherwise changes all the time" in found.evidence[0]
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)


def test_a_speed_without_noise_is_held_while_its_command_rests() -> None:
    assert stated(speed(1, noise=0.0)) == []


def test_a_speed_that_is_held_while_its_command_changes_is_less_sure() -> None:
    asked = 0.5 + 0.3 * np.sin(np.arange(N) * DT)
    y = np.r_[np.zeros(10), asked[:-10]]
    y[PART] = y[PART.start]
    (found,) = by_its_channel(drive(y, asked), None, LIMITS, DT)
    assert found.mode is FaultMode.STUCK
    assert 0.7 < found.probability < 0.9
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)


def test_spikes_are_the_sensors() -> None:
    y = speed(2)
    y[PART.start : PART.stop : 25] += 2.5
    assert stated(y) == [(Side.SENSOR, FaultMode.NOISY)]


@pytest.mark.parametrize("number", [1, 2])
def test_a_wrong_position_now_and_then_is_a_recorders(number: int) -> None:
    y = speed(2)
    for k in range(number):
        y[PART.start + 40 * k] += 40.0
        y[PART.start + 40 * k + 1] -= 40.0
    assert stated(y) == []


def test_wild_readings_of_a_channel_that_hardly_moves_are_a_recorders() -> None:
    y = 0.002 * np.random.default_rng(4).normal(size=N)
    y[PART.start : PART.stop : 25] += 60.0
    y[PART.start + 12 : PART.stop : 25] += 25.0
    assert stated(y, np.full(N, 0.1)) == []


def test_short_motions_that_are_read_now_and_then_are_no_spikes() -> None:
    asked = np.zeros(N)
    for k in range(310, 490, 20):
        asked[k : k + 2] = 0.8
    assert stated(asked + 0.002 * np.random.default_rng(1).normal(size=N), asked) == []


def test_silence_is_the_sensors() -> None:
    y = speed(2)
    y[PART] = np.nan
    assert stated(y, lost=((PART.start, PART.stop),)) == [(Side.SENSOR, FaultMode.NO_SIGNAL)]


@pytest.mark.parametrize("share", [0.5, 1.8])
@pytest.mark.parametrize("known", [True, False])
def test_a_share_that_comes_and_goes_at_once_is_the_sensors(share: float, *, known: bool) -> None:
    y = speed(5)
    y[PART] *= share
    asked = RESTS if known else np.full(N, np.nan)
    (found,) = by_its_channel(drive(y, asked), None, LIMITS, DT)
    assert (found.side, found.start, found.stop) == (Side.SENSOR, PART.start, PART.stop)
    assert found.mode is (FaultMode.INEFFICIENT if share < 1.0 else FaultMode.OUTSIDE_TABLE)
    assert found.epsilon is not None
    assert found.epsilon.value == pytest.approx(1.0 - share, abs=0.05)


@pytest.mark.parametrize("kind", ["asked", "slow", "once", "other", "always"])
def test_a_drive_that_slows_down_by_itself_or_as_told_is_no_sensor(kind: str) -> None:
    """It is told to; it takes half a second; it stays so; it comes back to another speed; it always jumps so."""
    y, asked = speed(5), RESTS.copy()
    y[PART] *= 0.5
    if kind == "asked":
        asked[PART] *= 0.5
    elif kind == "slow":
        for at, way in ((PART.start, (1.0, 0.5)), (PART.stop, (0.5, 1.0))):
            y[at : at + 10] = 0.5 * np.linspace(*way, 10)
    elif kind == "once":
        y[PART.stop :] *= 0.5
    elif kind == "other":
        y[PART.stop :] *= 1.6
    else:
        asked = np.full(N, np.nan)
        y = np.where(np.arange(N) % 80 < 40, 0.5, 0.25) + 0.01 * np.random.default_rng(4).normal(size=N)
    assert stated(y, asked) == []


@pytest.mark.parametrize("at_once", [True, False])
def test_a_fall_to_nothing_is_told_where_it_comes_and_goes_at_once(*, at_once: bool) -> None:
    y = speed(3)
    y[PART] = 0.0
    if not at_once:  # a machine that is held up takes a second to set off again
        y[PART.stop : PART.stop + 20] *= np.arange(20) / 20
    found = by_its_channel(drive(y), None, LIMITS, DT)
    assert [(f.side, f.mode) for f in found] == [(Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL)] * at_once
    assert all(f.probability < 0.9 for f in found)  # a machine may be stopped as a whole


def test_a_drive_that_always_stops_at_once_may_do_so_untold() -> None:
    asked = np.where(np.arange(N) % 80 < 60, 0.5, 0.0)
    y = np.where(asked > 0.0, 0.5 + 0.01 * np.random.default_rng(4).normal(size=N), 0.0)
    y[PART] = 0.0
    assert stated(y, asked) == []


def test_findings_stand_beside_what_following_shows() -> None:
    y = speed(1)
    y[PART] = y[PART.start]
    found = by_its_channel(drive(y), None, LIMITS, DT)
    sensor, actuator = assess_tracking(y, RESTS, DT, LIMITS, ("wheel.D.v", "its command"), found)
    assert sensor.findings == found
    assert actuator.findings == ()
    assert (sensor.states[PART] == CODE[State.STUCK]).all()
    assert (actuator.states[PART] == CODE[State.MASKED]).all()
    assert not (np.stack([sensor.states, actuator.states]) == CODE[State.HEALTHY]).any()


def test_what_two_drives_show_at_once_is_no_sensors() -> None:
    y = speed(2)
    y[PART.start : PART.stop : 25] += 2.5
    frozen = speed(3)
    frozen[PART] = frozen[PART.start]
    spiky, stuck = (by_its_channel(drive(x), None, LIMITS, DT) for x in (y, frozen))
    assert not_shared({"R": spiky, "L": spiky}) == {"R": (), "L": ()}
    assert not_shared({"R": spiky, "L": stuck}) == {"R": spiky, "L": stuck}
