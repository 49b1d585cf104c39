"""Ends of drifting and noisy faults once their gain is known."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.onset import refine
from diagnosis.estimation.fault_models import NOISY, ModeModel
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.segments import Run

MODEL = ModeModel(noise=0.003, constant_noise=0.003, tolerance=0.005, span=1.0, switch_cost=13.0, dt=0.001)
N, START, STOP = 12_000, 4000, 8000
Array = np.ndarray


def disturbed(seed: int) -> Samples:
    """A valve with a disturbance that drifts (0.8 s) from `START` to `STOP`: u_v = 0.6·u + 0.4·(0.08 + 0.08·OU)."""
    rng = np.random.default_rng(seed)
    u = 0.25 * np.sin(np.arange(N) / 700) + 0.01 * rng.normal(size=N)
    drift = np.zeros(N)
    for k in range(1, N):
        drift[k] = drift[k - 1] * np.exp(-0.001 / 0.8) + np.sqrt(2 * 0.001 / 0.8) * rng.normal()
    valve = u.copy()
    valve[START:STOP] = (0.6 * u + 0.4 * (0.08 + 0.08 * drift))[START:STOP]
    y = valve + MODEL.noise * rng.normal(size=N)
    return Samples.even(y, u, np.full(N, PAIR, dtype=np.int8), np.zeros(N, dtype=np.bool_))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("early", "late"), [(0, 0), (-400, 700), (500, -300)])
def test_both_ends_are_found_from_nearby(seed: int, early: int, late: int) -> None:
    got = refine(Run(START + early, STOP + late, NOISY), disturbed(seed), 0.6, MODEL, 0, N)
    assert abs(got.start - START) <= 15
    assert abs(got.stop - STOP) <= 15
    assert got.row == NOISY


def test_neighbours_are_left_alone() -> None:
    got = refine(Run(START + 500, STOP - 500, NOISY), disturbed(1), 0.6, MODEL, START + 300, STOP - 200)
    assert got.start >= START + 300
    assert got.stop <= STOP - 200


def test_a_run_of_a_few_samples_stays() -> None:
    run = Run(START, START + 30, NOISY)
    assert refine(run, disturbed(1), 0.6, MODEL, 0, N) == run
