"""Speeds that were divided by uneven times are divided by the usual one; nothing else is touched."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from replay.arrays.column_store import ColumnStore
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.to_si import convert
from replay.signals.uneven_times import evened

PERIOD_S = 0.1
N = 300


def stamps_of(rng: np.random.Generator, early_or_late: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    late = rng.uniform(0.0, early_or_late, N)
    return np.rint((np.arange(N) + late) * PERIOD_S * 1e9).astype(np.int64)


def smooth(rng: np.random.Generator) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.asarray(0.2 + 0.05 * np.sin(np.arange(N) / 30.0) + rng.normal(0.0, 0.005, N))


def divided(stamps: np.ndarray, true: np.ndarray) -> np.ndarray:
    return np.r_[true[0], true[1:] * PERIOD_S / (np.diff(stamps) * 1e-9)]


def test_even_steps_over_uneven_times_become_even_speeds() -> None:
    rng = np.random.default_rng(1)
    stamps, true = stamps_of(rng, 0.8), smooth(rng)
    found = evened(stamps, divided(stamps, true))
    assert "even steps divided by uneven times (every 1" in found.note
    assert np.std(found.values[1:] / true[1:] - 1.0) < 0.1 < 0.4 < np.std(divided(stamps, true)[1:] / true[1:] - 1.0)


@pytest.mark.parametrize("jitter", [0.0, 0.8])
def test_even_readings_stay_whatever_their_stamps(jitter: float) -> None:
    rng = np.random.default_rng(2)
    stamps, true = stamps_of(rng, jitter), smooth(rng)
    assert evened(stamps, true).note == ""
    assert evened(stamps, true).values is true


def test_noise_that_the_stamps_do_not_explain_stays() -> None:
    rng = np.random.default_rng(3)
    stamps, noisy = stamps_of(rng, 0.8), smooth(rng) * rng.uniform(0.5, 1.5, N)
    assert_array_equal(evened(stamps, noisy).values, noisy)


def test_a_value_that_is_held_stays_one_value() -> None:
    rng = np.random.default_rng(4)
    stamps = stamps_of(rng, 0.8)
    values = divided(stamps, smooth(rng))
    values[200:260] = values[199]
    values[100:120] = 0.0
    got = evened(stamps, values).values
    assert np.unique(got[200:260]).size == 1
    assert_array_equal(got[100:120], 0.0)


def test_a_lost_message_halves_no_speed() -> None:
    rng = np.random.default_rng(5)
    stamps, true = stamps_of(rng, 0.5), smooth(rng)
    values = divided(stamps, true)
    kept = np.ones(N, np.bool_)
    kept[50:250:20] = False
    got = evened(stamps[kept], values[kept]).values
    assert_allclose(np.median(got), np.median(true), rtol=0.05)
    assert np.mean(np.abs(got / true[kept] - 1.0) > 0.5) < 0.03


def test_a_drive_command_is_left_as_it_is() -> None:
    rng = np.random.default_rng(6)
    stamps, true = stamps_of(rng, 0.8), smooth(rng)
    values, origin = divided(stamps, true), SignalSource(column="v", unit="m/s")
    read = {
        n: convert(n, (stamps, values), origin, haulotte(), ColumnStore()) for n in ("wheel.FR.v", "wheel.FR.v_ref")
    }
    assert len(read["wheel.FR.v"].notes) == 1
    assert_array_equal(read["wheel.FR.v_ref"].values, values)
