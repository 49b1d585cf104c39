"""A drive of which only command and response are known: it is judged only where it stops and never moves again."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.tracking import assess_tracking, estimate_lag
from diagnosis.results.assessment import CODE
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits

DT, N = 0.02, 1500  # 30 s at 50 Hz
NAMES = ("wheel.M1.v", "its command")
LIMITS = Limits()
Array = np.ndarray


def command() -> Array:
    t = np.arange(N) * DT
    return np.where(t % 8 < 6, 0.3 * np.sign(np.sin(2 * np.pi * t / 16) + 1e-9), 0.0)


def response(lag: int, seed: int = 1) -> Array:
    late = np.r_[np.zeros(lag), command()[: N - lag]]
    return late + 0.003 * np.random.default_rng(seed).normal(size=N)


@pytest.mark.parametrize("lag", [0, 5, 50, 100])
def test_delay_is_found(lag: int) -> None:
    assert estimate_lag(response(lag), command(), DT) == lag


def test_unrelated_signals_have_no_delay() -> None:
    assert estimate_lag(np.random.default_rng(1).normal(size=N), command(), DT) == 0
    assert estimate_lag(np.zeros(N), command(), DT) == 0


@pytest.mark.parametrize("seed", range(4))
def test_drive_that_follows_has_no_finding(seed: int) -> None:
    for one in assess_tracking(response(25, seed), command(), DT, LIMITS, NAMES):
        assert one.findings == ()
        assert one.tier == "tracking"
        # nothing but a standstill would show, so nothing is called healthy
        assert set(np.unique(one.states)) <= {CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED], CODE[State.NO_DATA]}
        assert one.reasons[State.NOT_ASSESSED]


def test_drive_that_stops_for_good_is_found() -> None:
    v = response(25)
    v[600:] = 0.0
    sensor, actuator = assess_tracking(v, command(), DT, LIMITS, NAMES)
    found = sensor.findings[0]
    assert actuator.findings == sensor.findings
    assert (found.side, found.mode) == (Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL)
    assert found.probability >= LIMITS.min_probability
    # the command of 8 to 14 s began before; the response stops at 12 s
    assert found.start == pytest.approx(600, abs=8)
    assert found.stop == N
    assert (sensor.states[found.start :] == CODE[State.NO_SIGNAL]).all()
    assert "never moved again" in found.evidence[0]
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)


def test_pause_is_no_finding() -> None:
    v = response(25)
    v[300:600] = 0.0
    assert assess_tracking(v, command(), DT, LIMITS, NAMES)[0].findings == ()


def test_stopping_at_the_end_is_no_finding() -> None:
    v = response(25)
    v[1400:] = 0.0
    assert assess_tracking(v, command(), DT, LIMITS, NAMES)[0].findings == ()


def test_no_command_is_not_excited() -> None:
    zero = np.zeros(N)
    sensor, _ = assess_tracking(zero, zero, DT, LIMITS, NAMES)
    assert sensor.findings == ()
    assert (sensor.states == CODE[State.NOT_EXCITED]).all()


def test_lost_samples_are_no_data() -> None:
    v = response(25)
    v[200:300] = np.nan
    sensor, _ = assess_tracking(v, command(), DT, LIMITS, NAMES)
    assert (sensor.states[200:300] == CODE[State.NO_DATA]).all()
    assert (sensor.states[300:] != CODE[State.NO_DATA]).all()


def test_jitter_of_a_still_position_is_no_motion() -> None:
    v = response(25)
    counts = 0.004 * np.random.default_rng(3).integers(-2, 3, N)  # the position hops by some counts, and comes back
    v[600:] = np.diff(counts, prepend=0.0)[600:] / DT
    (found,) = assess_tracking(v, command(), DT, LIMITS, NAMES)[0].findings
    assert found.mode is FaultMode.NO_SIGNAL
    assert found.start == pytest.approx(600, abs=20)


def test_a_command_that_begins_as_the_log_ends_proves_nothing() -> None:
    asked = command()
    asked[:1400] = np.where(np.arange(1400) < 600, asked[:1400], 0.0)
    asked[-20:] = 0.3
    v = np.r_[np.zeros(25), asked[: N - 25]]
    v[-20:] = 0.0
    assert assess_tracking(v, asked, DT, LIMITS, NAMES)[0].findings == ()


def test_a_small_copy_of_the_command_is_a_wrong_unit_and_no_standstill() -> None:
    for one in assess_tracking(np.round(response(25) / 57.3, 4), command(), DT, LIMITS, NAMES):
        assert one.findings == ()
        assert "0.017 of its size: a wrong unit" in one.reasons[State.NOT_ASSESSED]


def test_a_drive_that_keeps_the_speed_it_was_told_has_no_wrong_unit() -> None:
    asked = np.full(N, 0.3)
    v = 0.297 * np.minimum(1.0, np.arange(N) * DT) + 0.001 * np.random.default_rng(1).normal(size=N)
    for one in assess_tracking(v, asked, DT, LIMITS, NAMES):
        assert one.findings == ()
        assert "wrong unit" not in one.reasons[State.NOT_ASSESSED]


@pytest.mark.parametrize("lag", [0, 10])
def test_what_is_left_of_a_motion_at_the_end_is_no_wrong_unit(lag: int) -> None:
    asked = command()
    asked[-100:], asked[-50:] = 0.0, 0.1
    v = np.r_[np.zeros(lag), asked[: N - lag]] + 0.02 * np.random.default_rng(1).normal(size=N)
    v[-50:] = 0.01
    for one in assess_tracking(v, asked, DT, LIMITS, NAMES):
        assert one.findings == ()
        assert "wrong unit" not in one.reasons[State.NOT_ASSESSED]
