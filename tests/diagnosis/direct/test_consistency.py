"""Stretches that are consistent with healthy: noise alone is, whatever a fault could have left is not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from diagnosis.channels.sample_status import CLEAR, PAIR, SILENT, SKIP
from diagnosis.direct.consistency import with_consistent
from diagnosis.estimation.fault_models import ModeModel
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.viterbi import most_probable

MODEL = ModeModel(noise=0.004, constant_noise=0.0005, tolerance=0.005, span=0.8, switch_cost=13.0, dt=0.001)
N, START, STOP = 20_000, 8000, 12_000
Array = np.ndarray


def channel(seed: int = 1) -> tuple[Array, Array, Array]:
    """A healthy speed beside its reference; y, x, status."""
    x = 0.1 + 0.2 * np.sin(np.arange(N) / 900)
    y = x + MODEL.noise * np.random.default_rng(seed).normal(size=N)
    return y, x, np.full(N, PAIR, dtype=np.int8)


def consistent(y: Array, x: Array, status: Array) -> Array:
    """Status of every sample after the test."""
    return with_consistent(Samples.even(y, x, status, np.zeros(N, dtype=np.bool_)), MODEL.noise).status


def test_most_of_a_healthy_channel_is_cleared() -> None:
    y, x, status = channel()
    got = consistent(y, x, status)
    assert np.mean(got == CLEAR) > 0.7
    assert set(np.unique(got)) <= {PAIR, CLEAR}
    assert (status == PAIR).all()  # its input stays


@pytest.mark.parametrize(
    "fault",
    [
        lambda x, r: np.full(x.size, x[START]),
        lambda x, r: 0.85 * x + 0.004 * r.normal(size=x.size),
        lambda x, r: x + 0.012 * r.normal(size=x.size),
        lambda x, r: x + 0.01,
    ],
    ids=["stuck at what it read", "gain 0.85", "more noise", "bias"],
)
def test_a_fault_and_what_lies_around_it_are_not(fault: object) -> None:
    y, x, status = channel()
    y[START:STOP] = fault(x, np.random.default_rng(3))[START:STOP]  # type: ignore[operator]
    got = consistent(y, x, status)
    moves = np.abs(x[START:STOP]) > 0.05
    assert np.mean(got[START:STOP][moves] == CLEAR) < 0.02
    assert (got[START - 32 : START] != CLEAR).all()


def test_silence_and_missing_samples_keep_their_status() -> None:
    y, x, status = channel()
    y[5000:5100], status[5000:5100] = np.nan, SILENT
    status[::3] = SKIP
    got = consistent(y, x, status)
    kept = status != PAIR
    assert_array_equal(got[kept], status[kept])
    assert (got[4990:5110] != CLEAR).all()


@pytest.mark.parametrize("seed", range(3))
def test_the_path_is_the_same_with_and_without(seed: int) -> None:
    y, x, status = channel(seed)
    y[START:STOP] *= 0.5
    y[15_000:15_400] = 0.0
    quiet = np.zeros(N, dtype=np.bool_)
    whole = most_probable(Samples.even(y, x, status, quiet), MODEL)
    quick = most_probable(Samples.even(y, x, consistent(y, x, status), quiet), MODEL)
    assert_array_equal(quick.row, whole.row)
