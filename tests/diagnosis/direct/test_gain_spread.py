"""What is not known of a healthy channel's gain is found from the mission, faults of some of it apart."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.gain_spread import GainSpread, gain_windows, usual_spread
from diagnosis.direct.identification import identify
from diagnosis.estimation.samples import Samples
from replay.faults import Side
from replay.machine.config import Limits
from tests.diagnosis.direct.test_assess import pair

DT = 0.01


def samples(gain: NDArray[np.float64]) -> Samples:
    x = np.repeat(0.2 + 0.1 * np.sin(np.arange(gain.size)), 100)
    n = x.size
    return Samples.even(np.repeat(gain, 100) * x, x, np.full(n, PAIR, dtype=np.int8), np.zeros(n, dtype=np.bool_))


def share_of(gain: NDArray[np.float64], fault_stop: int = 0) -> float:
    spread = gain_windows(samples(gain), DT).spread(0.36, 0, fault_stop)
    assert spread is not None
    return spread.share


def test_the_spread_of_the_gain_from_second_to_second() -> None:
    gain = 1.0 + 0.02 * np.random.default_rng(1).standard_normal(200)
    assert share_of(gain) == pytest.approx(0.02, rel=0.2)


def test_a_fault_of_a_fifth_of_the_mission_hardly_changes_it() -> None:
    gain = 1.0 + 0.02 * np.random.default_rng(1).standard_normal(200)
    gain[:40] = 0.4
    assert share_of(gain) < 0.03


def test_nothing_is_known_of_what_hardly_moves() -> None:
    assert gain_windows(samples(np.full(3, 0.9)), DT).spread(0.36) is None


def test_the_time_of_a_fault_can_be_left_out() -> None:
    gain = 1.0 + 0.02 * np.random.default_rng(1).standard_normal(200)
    gain[:150] = 0.4
    assert share_of(gain) == 0.1  # more than that no healthy channel varies by
    assert share_of(gain, 15_000) == pytest.approx(0.02, rel=0.3)


def test_instruments_agree_no_better_than_they_can() -> None:
    assert share_of(np.ones(200)) == 0.005


def test_what_one_channel_cannot_show_its_kind_does() -> None:
    steady, loose, faulty = GainSpread(0.01, 0.2), GainSpread(0.02, 0.3), GainSpread(0.1, 0.3)
    share, size = usual_spread([steady, loose, faulty, None])
    assert (share, size) == (pytest.approx(1.6 * 0.02), 0.3)
    assert usual_spread([None, None]).share == 0.005


def test_what_is_usual_of_a_kind_leaves_the_windows_of_a_pair_as_they_were() -> None:
    rng = np.random.default_rng(3)
    x = np.repeat(rng.uniform(-1.0, 1.0, 100), 100)
    found = identify(pair(Side.ACTUATOR, x + rng.normal(0.0, 0.003, x.size), x), Limits())
    own, usual = found.own_spread, GainSpread(0.05, 0.4)
    told = found.with_kind_spread(usual)
    assert told.kind_spread == usual
    assert told._gains is found._gains
    assert own is not None
    assert told.own_spread == own
