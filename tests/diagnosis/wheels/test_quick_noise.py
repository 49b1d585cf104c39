"""Noise of a sensor is quick and its own: slow deviations leave the side open, and what shakes other wheels is less sure."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.own_swings import opened
from diagnosis.wheels.quick_noise import _of_one_cause, quick_share, with_shaken
from replay.faults import FaultMode, Side
from tests.diagnosis.wheels.test_own_swings import DT, WIDTH, N, T, noise

EXPECTED = 1.0 + 0.5 * np.sin(2 * np.pi * T / 20.0)


def path(off: np.ndarray) -> Any:
    return SimpleNamespace(y=EXPECTED + off, expected=EXPECTED[::WIDTH], width=WIDTH, dt=DT)


def judged(own: np.ndarray, other: np.ndarray) -> Finding:
    rows = (Hypothesis("sensor", FaultMode.NOISY, 0.95), Hypothesis("none", "healthy", 0.05))
    mine = Finding(1000, 3000, Side.SENSOR, FaultMode.NOISY, 0.95, rows, None, None, (), Tier.MODEL)
    found = {0: WheelFindings(findings=[mine]), 1: WheelFindings()}
    (out,) = with_shaken({0: path(own), 1: path(other)}, found)[0].findings
    return out


INSIDE = (T >= 10.0) & (T < 30.0)
QUIET = 0.002 * noise(0.0, 9)


@pytest.mark.parametrize("tau", [0.0, 0.05])
def test_quick_noise_of_one_wheel_stays(tau: float) -> None:
    out = judged(QUIET + 0.1 * INSIDE * noise(tau, 1), QUIET)
    assert (out.side, out.probability) == (Side.SENSOR, 0.95)


def test_a_slow_deviation_leaves_the_side_open() -> None:
    slow = np.convolve(noise(0.0, 1), np.hanning(80) / 5.0, "same")
    out = judged(QUIET + 0.1 * INSIDE * slow, QUIET)
    assert (out.side, out.mode) == (Side.SENSOR_OR_ACTUATOR, FaultMode.OUTSIDE_TABLE)
    assert "slowly" in out.evidence[0]


def test_noise_beside_noise_is_less_sure() -> None:
    out = judged(QUIET + 0.1 * INSIDE * noise(0.0, 1), QUIET + 0.05 * INSIDE * noise(0.0, 2))
    assert (out.side, out.probability) == (Side.SENSOR, 0.6)


def test_a_rough_sensor_beside_one_that_is_always_rough_stays() -> None:
    out = judged(QUIET + 0.1 * INSIDE * noise(0.0, 1), 0.03 * noise(0.0, 2))
    assert out.probability == 0.95


def test_the_share_of_white_noise_is_all_and_of_a_loss_alone_nothing_is_known() -> None:
    assert quick_share(EXPECTED + noise(0.0, 1), EXPECTED, DT) == pytest.approx(1.0, abs=0.1)
    assert quick_share(EXPECTED[:10], EXPECTED[:10], DT) is None
    assert quick_share(np.full(N, np.nan), EXPECTED, DT) is None


def test_noise_beside_a_large_slow_rest_is_the_sensors_where_readings_become_rough() -> None:
    slow = 0.2 * INSIDE * np.sin(2 * np.pi * T / 7.0)
    out = judged(QUIET + slow + 0.03 * INSIDE * noise(0.0, 1), QUIET)
    assert (out.side, out.probability) == (Side.SENSOR, 0.95)


def test_noise_beside_a_swing_of_the_same_wheel_is_no_surer_than_that() -> None:
    rows = (Hypothesis("sensor", FaultMode.NOISY, 0.97), Hypothesis("none", "healthy", 0.03))
    own = Finding(1000, 2000, Side.SENSOR, FaultMode.NOISY, 0.97, rows, None, None, ("It shakes.",), Tier.MODEL)
    swing = opened(replace(own, start=3000, stop=4000), "It swings.")
    first, second = _of_one_cause([own, swing])
    assert (first.side, first.mode) == (Side.SENSOR_OR_ACTUATOR, FaultMode.OUTSIDE_TABLE)
    assert second is swing
    assert _of_one_cause([own]) == [own]
