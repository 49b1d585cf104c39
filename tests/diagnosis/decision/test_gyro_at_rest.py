"""The gyro of a machine that stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.decision.gyro_at_rest import offset_at_rest
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline, align

Array = NDArray[np.float64]

RATE, SECONDS = 50, 60


def logged(gyro: Array, speed: Array) -> Timeline:
    stamps = (np.arange(speed.size) * (1_000_000_000 // RATE)).astype(np.int64)
    columns = {f"wheel.{w}.v": speed for w in haulotte().wheels} | {"imu.yaw_rate": gyro, "cmd.v": speed}
    items = {n: Signal(n, stamps, x, SignalSource(column=n), "test", guessed=False) for n, x in columns.items()}
    return align(Signals(items=items, missing={}))


def course() -> Array:
    """10 s at rest, 20 s of motion, and so on [m/s]."""
    t = np.arange(RATE * SECONDS) / RATE
    return np.where(t % 30.0 < 10.0, 0.0, 0.5)


def gyro(offset: float | Array, turn: float = 0.2) -> Array:
    noise = np.random.default_rng(1).normal(0.0, 0.01, RATE * SECONDS)
    return turn * (course() > 0.0) + offset + noise


@pytest.mark.parametrize("offset", [0.0, 0.01, -0.015])
def test_a_small_offset_is_none(offset: float) -> None:
    assert offset_at_rest(logged(gyro(offset), course()), haulotte()) == ""


@pytest.mark.parametrize("offset", [0.05, -0.05])
def test_an_offset_is_told_with_its_size_and_sign(offset: float) -> None:
    text = offset_at_rest(logged(gyro(offset), course()), haulotte())
    sign = "+" if offset > 0.0 else "−"
    assert f"reads up to {sign}2.9°/s whenever the machine stands" in text


def test_one_that_comes_later_is_told_for_the_stops_that_have_it() -> None:
    late = np.where(np.arange(RATE * SECONDS) > 25 * RATE, 0.1, 0.0)
    assert "in 1 of 2 stops" in offset_at_rest(logged(gyro(late), course()), haulotte())


def test_a_machine_that_never_stands_or_is_swung_tells_nothing() -> None:
    machine = haulotte()
    assert offset_at_rest(logged(gyro(0.05), np.full(RATE * SECONDS, 0.5)), machine) == ""
    swung = gyro(0.05) + np.where(course() > 0.0, 0.0, 0.3 * np.sin(np.arange(RATE * SECONDS) / RATE))
    assert offset_at_rest(logged(swung, course()), machine) == ""


def test_a_log_without_a_gyro_has_none() -> None:
    timeline = logged(gyro(0.05), course())
    signals = {n: x for n, x in timeline.signals.items() if n != "imu.yaw_rate"}
    assert offset_at_rest(replace(timeline, signals=signals), haulotte()) == ""
