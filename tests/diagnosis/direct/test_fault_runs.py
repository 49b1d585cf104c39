"""Runs of one fault, without the ends in which nothing moves."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.fault_runs import _lost_in_one, _moving
from diagnosis.estimation.fault_models import INEFFICIENT, STUCK
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.segments import Run

N = 1000
MODEL: Any = SimpleNamespace(noise=0.01, constant_noise=0.01)


def samples(reading: float) -> Samples:
    """A machine that stands from 300 to 800, whose sensor then reads a constant."""
    x = np.ones(N)
    x[300:800] = 0.0
    y = x.copy()
    y[300:900] = reading
    quiet = x == 0.0
    return Samples.even(y, x, np.full(N, PAIR, dtype=np.int8), quiet)


def test_what_reads_nothing_while_nothing_moves_is_not_stuck_meanwhile() -> None:
    assert _moving(Run(300, 900, STUCK), samples(0.0), MODEL) == Run(800, 900, STUCK)
    assert _moving(Run(350, 700, STUCK), samples(0.0), MODEL) is None


def test_a_value_that_stays_beside_a_standstill_is() -> None:
    assert _moving(Run(300, 900, STUCK), samples(0.4), MODEL) == Run(300, 900, STUCK)


def test_a_sound_gain_and_a_lost_one_are_no_one_run() -> None:
    x = 0.5 + 0.1 * np.sin(np.linspace(0.0, 20.0, N))
    y = x * np.where(np.arange(N) < 400, 1.006, 0.7)
    both = Samples.even(y, x, np.full(N, PAIR, dtype=np.int8), np.zeros(N, bool))
    model: Any = SimpleNamespace(noise=0.01, constant_noise=0.01, dt=0.01)
    first, second = Run(0, 400, INEFFICIENT), Run(400, N, INEFFICIENT)
    assert _lost_in_one(first, second, both, model)
    assert not _lost_in_one(second, second, both, model)
    assert not _lost_in_one(Run(0, 400, STUCK), Run(400, N, STUCK), both, model)
