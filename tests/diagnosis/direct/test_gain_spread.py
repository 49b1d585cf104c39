"""What is not known of a healthy channel's gain is found from the mission, faults of some of it apart."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import gain_windows
from diagnosis.estimation.samples import Samples

DT = 0.01


def samples(gain: NDArray[np.float64]) -> Samples:
    x = np.repeat(0.2 + 0.1 * np.sin(np.arange(gain.size)), 100)
    n = x.size
    return Samples.even(np.repeat(gain, 100) * x, x, np.full(n, PAIR, dtype=np.int8), np.zeros(n, dtype=np.bool_))


def test_the_spread_of_the_gain_from_second_to_second() -> None:
    gain = 1.0 + 0.02 * np.random.default_rng(1).standard_normal(200)
    assert gain_windows(samples(gain), DT).spread(0.36) == pytest.approx(0.02, rel=0.2)


def test_a_fault_of_a_fifth_of_the_mission_hardly_changes_it() -> None:
    gain = 1.0 + 0.02 * np.random.default_rng(1).standard_normal(200)
    gain[:40] = 0.4
    assert gain_windows(samples(gain), DT).spread(0.36) < 0.03


def test_nothing_is_known_of_what_hardly_moves() -> None:
    assert gain_windows(samples(np.full(3, 0.9)), DT).spread(0.36) == 0.0


def test_the_time_of_a_fault_can_be_left_out() -> None:
    gain = 1.0 + 0.02 * np.random.default_rng(1).standard_normal(200)
    gain[:150] = 0.4
    windows = gain_windows(samples(gain), DT)
    assert windows.spread(0.36) == 0.1  # more than that no healthy channel varies by
    assert windows.spread(0.36, 0, 15_000) == pytest.approx(0.02, rel=0.3)
