"""A sensor that is rough as no other wheel's is not called healthy, however well its mean fits; ground and coarse encoders make all of them rough."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.unquiet import left_open
from diagnosis.results.assessment import CODE, Assessment
from diagnosis.results.vocabulary import Tier
from replay.faults import State

Array = NDArray[np.float64]

DT = 0.02
T = np.arange(0.0, 60.0, DT)


def healthy(noise: dict[str, float], tier: Tier = Tier.MODEL, step: float = 0.0) -> dict[str, float]:
    """Share of the time in which each wheel stays healthy that was so throughout."""
    rng = np.random.default_rng(1)
    speeds = {w: 1.0 + 0.2 * np.sin(0.5 * T) + level * rng.normal(size=T.size) for w, level in noise.items()}
    if step:
        speeds = {w: np.round(y / step) * step for w, y in speeds.items()}
    every = np.ones(T.size, np.bool_)
    found = {w: Assessment(np.full(T.size, CODE[State.HEALTHY], np.int8), tier=tier) for w in noise}
    out = left_open(found, {w: (y, every) for w, y in speeds.items()}, DT)
    return {w: float(np.mean(a.states == CODE[State.HEALTHY])) for w, a in out.items()}


def test_one_of_two_that_is_noisy_all_through_is_open() -> None:
    shares = healthy({"R": 0.3, "L": 0.01})
    assert shares["R"] < 0.05
    assert shares["L"] == 1.0


def test_all_of_them_alike_little_noise_or_a_second_measurement_leave_it() -> None:
    assert healthy({"R": 0.3, "L": 0.25}) == {"R": 1.0, "L": 1.0}
    assert healthy({"R": 0.06, "L": 0.01}) == {"R": 1.0, "L": 1.0}
    assert healthy({"R": 0.3, "L": 0.01}, tier=Tier.DIRECT)["R"] == 1.0
    assert healthy({"R": 0.3}) == {"R": 1.0}
