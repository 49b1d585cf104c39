"""What a valve's position reads at rest is its sensor's zero, as far as a healthy sensor is off and rests agree."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.resting_position import with_zeroed_positions, zero_of
from replay.machine.config import haulotte
from replay.signals.timeline import Timeline

MS = 1_000_000
N, DT = 4000, 0.01
NEW = np.ones(N, np.bool_)


def command() -> np.ndarray:
    """Forty seconds: four of driving, ahead and back, four of rest, in turn."""
    t = np.arange(N) * DT
    return np.where((t // 4) % 2 == 0, np.where((t // 8) % 2 == 0, 0.3, -0.3), 0.0)


def timeline(position: np.ndarray) -> Timeline:
    signals = {"wheel.FR.u": command(), "wheel.FR.u_applied": position}
    fresh = dict.fromkeys(signals, NEW)
    return Timeline(0, 10 * MS, N, signals, fresh, dict.fromkeys(signals, "a.mcap"), dict.fromkeys(signals, 10 * MS))


def test_a_sensor_that_is_set_off_reads_zero_at_rest() -> None:
    noise = 0.002 * np.random.default_rng(0).normal(size=N)
    found = with_zeroed_positions(timeline(0.95 * command() + 0.02 + noise), haulotte())
    assert np.allclose(found.signals["wheel.FR.u_applied"], 0.95 * command() + noise, atol=1e-3)
    assert "taken as its sensor's zero" in found.notes[0]


def test_a_sensor_that_is_set_well_stays() -> None:
    given = timeline(command())
    assert with_zeroed_positions(given, haulotte()) is given


@pytest.mark.parametrize("position", [0.12 + command(), np.full(N, 0.06)], ids=["biased", "stuck"])
def test_what_a_fault_does_is_no_zero(position: np.ndarray) -> None:
    assert zero_of(position, command(), NEW, DT, 1.0) == 0.0


def test_rests_that_do_not_agree_are_friction() -> None:
    side = np.where((np.arange(N) * DT // 8) % 2 == 0, 0.012, -0.012)
    assert zero_of(command() + side, command(), NEW, DT, 1.0) == 0.0
    assert zero_of(command() + 0.02 + 0.1 * side, command(), NEW, DT, 1.0) == pytest.approx(0.02, abs=2e-3)


def test_friction_leaves_a_spool_where_it_comes_from() -> None:
    ahead = np.abs(command())
    assert zero_of(ahead + 0.02, ahead, NEW, DT, 1.0) == 0.0


def test_what_is_there_at_rest_alone_is_no_zero() -> None:
    rests = np.where(command() == 0.0, 0.02, 0.0)
    assert zero_of(command() + rests, command(), NEW, DT, 1.0) == 0.0


def test_a_valve_that_never_rests_shows_no_zero() -> None:
    assert zero_of(np.full(N, 0.32), np.full(N, 0.3), NEW, DT, 1.0) == 0.0
