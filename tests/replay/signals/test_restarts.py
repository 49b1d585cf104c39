"""Speeds of positions that start anew."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from replay.arrays.column_store import ColumnStore
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.restarts import continued
from replay.signals.to_si import convert

T = np.arange(4000) * 0.02
ANGLE = 8.0 * T + 3.0 * np.sin(0.4 * T)  # rad, forwards
RAD = SignalSource(column="pos", unit="rad", derivative=True)


def counts(bits: int, *, signed: bool) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    whole = np.rint(700.0 * ANGLE).astype(np.int64) % (1 << bits)
    return np.where(whole >= 1 << (bits - 1), whole - (1 << bits), whole) if signed else whole


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("low", [-np.pi, 0.0])
def test_an_angle_goes_on_over_its_turns(way: float, low: float) -> None:
    wrapped = (way * ANGLE - low) % (2.0 * np.pi) + low
    wrapped[100] = np.nan
    found = continued(wrapped, RAD)
    rest = np.arange(T.size) != 100
    assert_allclose((found.values - found.values[0])[rest], way * (ANGLE - ANGLE[0])[rest], atol=1e-9)
    assert "starts anew after 6.28319" in found.note


def test_the_speed_of_a_wheel_is_that_of_its_unbroken_position() -> None:
    machine, stamps = haulotte(), (T * 1e9).astype(np.int64)
    whole, broken = (
        convert("wheel.FR.v", (stamps, angle), RAD, machine, ColumnStore())
        for angle in (ANGLE, (ANGLE + np.pi) % (2.0 * np.pi) - np.pi)
    )
    assert_allclose(broken.values, whole.values, atol=1e-6)
    assert whole.notes == ()
    assert len(broken.notes) == 1


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize("bits", [16, 32])
def test_a_counter_goes_on_over_its_end(bits: int, signed: bool) -> None:
    recorded = counts(bits, signed=signed)
    offset = (1 << bits) - 2000  # near its end
    recorded = (recorded + offset) % (1 << bits) - ((1 << (bits - 1)) if signed else 0)
    found = continued(recorded.astype(np.float64), SignalSource(column="ticks", unit="m", derivative=True, gain=1e-4))
    assert_array_equal(np.diff(found.values), np.diff(np.rint(700.0 * ANGLE)))
    assert f"after {2.0**bits:.6g}" in found.note


def test_a_counter_of_one_turn_goes_on_by_its_gain() -> None:
    steps = 1440.0
    recorded = np.floor(ANGLE / (2.0 * np.pi) * steps) % steps
    found = continued(recorded, SignalSource(column="ticks", unit="rad", derivative=True, gain=2.0 * np.pi / steps))
    assert_allclose(np.diff(found.values), np.diff(np.floor(ANGLE / (2.0 * np.pi) * steps)), atol=1e-6)


def test_what_turns_too_far_between_two_readings_is_not_used_and_said() -> None:
    fast = (6.0 * ANGLE[::5]) % (2.0 * np.pi)
    found = continued(fast, RAD)
    assert np.isnan(found.values).all()
    assert "not used" in found.note


def test_an_unbroken_position_stays_as_it_is_and_so_do_its_jumps() -> None:
    jumped = np.where(T > 40.0, ANGLE - 200.0, ANGLE)
    for position in (ANGLE, jumped, np.zeros(50), np.sin(T)):
        assert continued(position, RAD) == (position, "")
