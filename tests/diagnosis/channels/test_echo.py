"""A speed that is its command to the last digit measures nothing; whatever has ramps, steps or noise of its own does."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.echo import not_measured, repeats_its_command
from diagnosis.results.assessment import CODE, Lack
from replay.faults import State
from replay.machine.config import Limits
from tests.campaigns import campaign

Array = NDArray[np.float64]

DT, N = 0.1, 900
LIMITS = Limits()


def asked(seed: int, values: int = 6) -> Array:
    """A command in steps, with stops in between."""
    rng = np.random.default_rng(seed)
    levels = np.round(rng.uniform(0.1, 0.8, values), 2)
    steps = np.where(rng.random(N // 20) < 0.3, 0.0, rng.choice(levels, N // 20))
    return np.repeat(steps, 20)


def followed(command: Array, lag: float = 0.4) -> Array:
    """What a drive makes of it."""
    out = np.zeros(N)
    for k in range(1, N):
        out[k] = out[k - 1] + DT / lag * (command[k] - out[k - 1])
    return out


def late(command: Array, steps: int) -> Array:
    return np.r_[np.zeros(steps), command[: N - steps]]


def echoes(y: Array, command: Array) -> bool:
    return repeats_its_command(y, np.isfinite(y), command, LIMITS, DT)


@pytest.mark.parametrize("seed", campaign(range(6)))
def test_a_copy_of_the_command_is_none(seed: int) -> None:
    command = asked(seed)
    assert echoes(command, command)
    assert echoes(late(command, 5), command)
    assert echoes(np.asarray(command, np.float32).astype(np.float64), command)


@pytest.mark.parametrize(("off", "echo"), [(38, True), (45, False)])
def test_one_reading_in_fifty_may_meet_no_value_wherever_it_is(off: int, echo: bool) -> None:
    command = np.repeat(np.round(np.random.default_rng(1).uniform(0.1, 0.8, 100), 2), 20)
    for at in (slice(0, off), slice(command.size - off, None)):
        y = command.copy()
        y[at] += 1e-3
        assert echoes(y, command) is echo


@pytest.mark.parametrize("seed", campaign(range(6)))
@pytest.mark.parametrize("step", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_what_is_measured_is_one(seed: int, step: float, noise: float) -> None:
    command = asked(seed)
    y = followed(command) + noise * np.random.default_rng(seed).normal(size=N)
    assert not echoes(np.round(y / step) * step if step else y, command)


def test_one_speed_that_is_told_now_and_then_is_copied_also_where_another_command_was_followed() -> None:
    command = np.where(np.arange(N) // 150 % 2 == 0, 0.2, 0.0)
    assert echoes(np.where(np.arange(N) // 130 % 2 == 0, 0.2, 0.0), command)
    assert not echoes(np.full(N, 0.2), command)  # which never ends may be stuck


def test_a_command_that_comes_once_holds() -> None:
    command = np.full(N, np.nan)
    command[::100] = np.tile([0.2, 0.5, 0.0], 3)
    held = np.repeat(command[::100], 100)
    assert echoes(held, command)


def test_a_sensor_that_is_frozen_is_no_copy() -> None:
    command = asked(3)
    y = followed(command)
    y[200:] = y[200]
    assert not echoes(y, command)


def test_a_planner_that_changes_its_command_all_the_time_is_copied_as_well() -> None:
    command = 0.5 + 0.3 * np.sin(np.arange(N) * 0.07)
    assert echoes(late(command, 3), command)
    assert not echoes(followed(command), command)


@pytest.mark.parametrize("lag", [0.15, 0.4])
def test_a_coarse_reading_of_a_coarse_ramp_is_no_copy(lag: float) -> None:
    command = np.round(0.5 + 0.3 * np.sin(np.arange(N) * 0.07), 2)
    assert not echoes(np.round(followed(command, lag), 2), command)


def test_a_command_that_asks_for_next_to_nothing_is_not_met() -> None:
    assert not echoes(np.full(N, 3.0), 0.5 * LIMITS.driving_speed * (np.arange(N) % 2))
    assert not echoes(np.full(N, np.nan), asked(1))


def test_nothing_is_judged_of_a_copy() -> None:
    command = asked(1)
    sensor, drive = not_measured(command, command, LIMITS, "wheel.D.v")
    for part in (sensor, drive):
        assert set(part.states.tolist()) == {CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED]}
        assert part.lacks[State.NOT_ASSESSED] is Lack.ECHO
        assert "measures nothing" in part.reasons[State.NOT_ASSESSED]
