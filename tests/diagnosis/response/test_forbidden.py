"""Readings that no wheel can make are wrong whatever else is mapped: a gyro that fits on average excuses none, nor does a fault of both wheels."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.inputs import FollowerData, cell_of
from diagnosis.results.assessment import CODE
from replay.faults import FaultMode, State
from replay.machine.config import Limits
from replay.machine.geometry import Geometry, WheelGeometry

Array = NDArray[np.float64]

DT, SECONDS, TRACK = 0.01, 60.0, 1.0
T = np.arange(0.0, SECONDS, DT)
PLACES = {"R": WheelGeometry(0.0, -TRACK / 2, 0.0, "fixed"), "L": WheelGeometry(0.0, TRACK / 2, 0.0, "fixed")}


def judged(noise: dict[str, Array], *, gyro: bool, seed: int = 2, edit: dict[str, float] | None = None) -> Judgement:
    """Two motors at 3 to 5 m/s without a command; `noise` of one sample by wheel [m/s]."""
    rng = np.random.default_rng(seed)
    v, yaw = 4.0 + np.sin(0.2 * T), 0.8 * np.sin(0.3 * T)
    nothing = np.full(T.size, np.nan)
    cells = np.full((-(-T.size // cell_of(DT)), 1), np.nan)
    data = {}
    for w, place in PLACES.items():
        y = v - place.y * yaw + (0.03 + noise.get(w, np.zeros(T.size))) * rng.normal(size=T.size)
        y = (edit or {}).get(w, 1.0) * y
        data[w] = FollowerData(y, np.ones(T.size, np.bool_), cells, nothing, f"wheel.{w}.v")
    return assess_response(data, Geometry(PLACES, 0.4), yaw if gyro else None, Limits(driving_speed=0.5), DT)


def noisy(j: Judgement) -> set[str]:
    return {w for w, sides in j.parts.items() for f in sides[0].findings if f.mode is FaultMode.NOISY}


@pytest.mark.parametrize("gyro", [False, True])
def test_both_wheels_that_get_worse_are_noisy_and_never_healthy_with_more_evidence(gyro: bool) -> None:
    growing = 4.0 * np.clip(T / SECONDS - 0.4, 0.0, None)
    j = judged({"R": growing, "L": growing}, gyro=gyro)
    assert noisy(j) == {"R", "L"}
    late = slice(round(0.8 * T.size), None)
    assert not any((j.parts[w][0].states[late] == CODE[State.HEALTHY]).any() for w in PLACES)


@pytest.mark.parametrize("gyro", [False, True])
def test_one_wheel_that_is_noisy_all_through_is_named(gyro: bool) -> None:
    assert noisy(judged({"R": np.full(T.size, 1.2)}, gyro=gyro)) == {"R"}


@pytest.mark.parametrize("gyro", [False, True])
def test_what_inertia_allows_in_both_wheels_is_ground(gyro: bool) -> None:
    shaken = np.where(T > 30.0, 0.12, 0.0)
    assert noisy(judged({"R": shaken, "L": shaken}, gyro=gyro)) == set()
    assert noisy(judged({}, gyro=gyro)) == set()


def test_of_two_the_one_that_reads_nothing_is_told_and_is_no_measure_of_the_other() -> None:
    j = judged({}, gyro=False, edit={"R": 0.0})
    assert noisy(j) == set()
    (sentence,) = j.apart
    assert sentence.startswith("R")
    assert "reads 0 from start to end" in sentence
