"""Readings that change within one sample."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.channel import samples_of
from diagnosis.response.jumps import falls_dead


@pytest.mark.parametrize(("falls_s", "dead"), [(0.0, True), (0.3, False)])
def test_a_reading_that_falls_to_0_at_once_and_stays_there_is_dead(falls_s: float, dead: bool) -> None:
    rate, n = 30.0, 600
    t = np.arange(n) / rate
    y = 0.6 + 0.1 * np.sin(t) + np.random.default_rng(3).normal(0.0, 0.004, n)
    y *= np.clip((10.0 + falls_s - t) / falls_s, 0.0, 1.0) if falls_s else t < 10.0
    assert falls_dead(samples_of(y, np.ones(n, np.bool_)), round(10.0 * rate), 1.0 / rate) is dead
