"""Which runs are stated: a sensor that lives, at a speed that stays, repeats what it had, which is true."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.isolation import Isolated
from diagnosis.direct.stated_mode import mode_of, slowly_off
from diagnosis.estimation.fault_models import NOISY, STUCK
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]
DT, SIZE = 0.005, 1200
RNG = np.random.default_rng(2)
SPEED = np.full(SIZE, 0.33)


def stated(y: Array, x: Array, *, restless: bool) -> FaultMode | None:
    """The mode of a run of a sensor that is tighter than its second measurement."""
    use = np.ones(SIZE, np.bool_)
    seen = SimpleNamespace(y=y, x=x, use=use, noise=0.004, deviation=float(np.sqrt(np.mean((y - x) ** 2))))
    run = SimpleNamespace(row=STUCK, size=SIZE)
    found = SimpleNamespace(pair=SimpleNamespace(side=Side.SENSOR, dt=DT), model=SimpleNamespace(dt=DT))
    isolated = cast(Isolated, SimpleNamespace(run=run, seen=seen, restless=restless))
    return mode_of(isolated, cast(IdentifiedPair, found), Limits())


@pytest.mark.parametrize(
    ("restless", "moves", "expected"), [(True, 0.0, None), (False, 0.0, FaultMode.STUCK), (True, 0.1, FaultMode.STUCK)]
)
def test_a_living_sensor_beside_a_restless_second_one_is_not_stuck(
    restless: bool, moves: float, expected: FaultMode | None
) -> None:
    y = SPEED + 0.002 * RNG.integers(-1, 2, SIZE) * restless
    x = SPEED + 0.025 * RNG.standard_normal(SIZE) - moves * (np.arange(SIZE) > SIZE // 2)
    assert stated(y, x, restless=restless) is expected


def test_what_a_second_evens_out_is_no_slow_deviation() -> None:
    quick = 0.02 * np.sin(2 * np.pi * 10.0 * np.arange(SIZE) * DT)
    assert slowly_off(SPEED, SPEED + quick, DT) < 0.001
    assert slowly_off(SPEED, SPEED + quick + 0.05, DT) == pytest.approx(0.05, rel=0.02)


@pytest.mark.parametrize(("top", "expected"), [(0.5, FaultMode.NOISY), (3.0, None)])
def test_noise_of_a_hundredth_of_the_speed_that_a_machine_reaches_moves_nothing(
    top: float, expected: FaultMode | None
) -> None:
    seen = SimpleNamespace(noise=0.002, deviation=0.02)
    pair = SimpleNamespace(side=Side.SENSOR, span=top, dt=DT)
    found = SimpleNamespace(pair=pair, model=SimpleNamespace(noise=0.002, dt=DT))
    isolated = SimpleNamespace(run=SimpleNamespace(row=NOISY), seen=seen, estimate=(None, None, 1.0))
    assert mode_of(cast(Isolated, isolated), cast(IdentifiedPair, found), Limits()) is expected
