"""Three wheels that agree name the fourth without a command; slip that comes and goes, and sides that turn the machine, name none."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.body import BodySpeed
from diagnosis.response.inputs import FollowerData, cell_of
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from replay.machine.geometry import Geometry, WheelGeometry

Array = NDArray[np.float64]

DT, SECONDS = 0.01, 60.0
T = np.arange(0.0, SECONDS, DT)
CAR = {
    w: WheelGeometry(
        2.7 if w[0] == "F" else 0.0, -0.8 if w[1] == "R" else 0.8, 0.0, "front" if w[0] == "F" else "fixed"
    )
    for w in ("FR", "FL", "RR", "RL")
}
PART = (T > 20.0) & (T < 30.0)


def car(
    edit: Array | float = 1.0, offset: Array | float = 0.0, bodies: tuple[BodySpeed, ...] = (), only: str = "RL"
) -> Judgement:
    """A car at 10 to 18 m/s without commands; the speed of `only` is edited."""
    rng, data = np.random.default_rng(4), {}
    v, yaw = 14.0 + 4.0 * np.sin(0.1 * T), 0.05 * np.sin(0.25 * T)
    nothing = np.full(T.size, np.nan)
    cells = np.full((-(-T.size // cell_of(DT)), 1), np.nan)
    for w, place in CAR.items():
        y = v - place.y * yaw + rng.normal(0.0, 0.02, T.size)
        y = edit * y + offset if w in only.split() else y
        data[w] = FollowerData(y, np.ones(T.size, np.bool_), cells, nothing, f"wheel.{w}.v")
    return assess_response(data, Geometry(CAR, 0.63), yaw, Limits(driving_speed=1.0), DT, bodies)


def found(j: Judgement) -> list[tuple[str, FaultMode]]:
    return [(w, f.mode) for w, sides in j.parts.items() for f in sides[0].findings]


@pytest.mark.parametrize(
    ("edit", "offset", "mode"),
    [
        (0.5, 0.0, FaultMode.INEFFICIENT),
        (1.0, 5.0, FaultMode.OUTSIDE_TABLE),
        (0.0, 0.0, FaultMode.NO_SIGNAL),
    ],
)
def test_a_wheel_that_leaves_the_three_others_is_named_and_comes_back(
    edit: float, offset: float, mode: FaultMode
) -> None:
    j = car(np.where(PART, edit, 1.0), np.where(PART, offset, 0.0))
    assert found(j) == [("RL", mode)]
    (finding,) = j.parts["RL"][0].findings
    assert abs(finding.start * DT - 20.0) < 0.5
    assert abs(finding.stop * DT - 30.0) < 0.5
    assert finding.side is not Side.ACTUATOR
    if mode is FaultMode.INEFFICIENT:
        assert finding.epsilon is not None
        assert abs(finding.epsilon.value - 0.5) < 0.02


def test_a_sound_car_and_one_whose_wheel_spins_now_and_then_name_none() -> None:
    assert found(car()) == []
    assert car().apart == ()
    slip = np.interp(T, [0, 19, 20.5, 22, 60], [1.0, 1.0, 1.4, 1.0, 1.0])
    assert found(car(slip)) == []


@pytest.mark.parametrize("share", [0.5, 0.8, 1.3])
def test_what_lasts_all_through_is_told_by_its_share(share: float) -> None:
    j = car(share)
    assert found(j) == []
    (sentence,) = j.apart
    assert sentence.startswith("RL")
    assert f"{share:.2f} × what all others make" in sentence


def test_a_side_is_told_by_the_speed_of_the_body() -> None:
    width = round(0.25 / DT)
    speed = (14.0 + 4.0 * np.sin(0.1 * T)).reshape(-1, width).mean(axis=1)
    body = BodySpeed("speed over ground", speed, signed=False, reach=1)
    told = car(0.5, bodies=(body,), only="FL RL").apart
    assert [s[:2] for s in told] == ["FL", "RL"]
    assert all("speed over ground" in s for s in told)
    assert car(bodies=(body,)).apart == ()
    assert car(bodies=(body._replace(speed=2.0 * speed),)).apart == ()  # all wheels alike are none of theirs


def test_what_lasts_from_start_to_end_shows_by_the_speed_of_the_body() -> None:
    body = BodySpeed("speed over ground", 14.0 + 4.0 * np.sin(0.1 * T[:: round(0.25 / DT)]), signed=False, reach=1)
    assert "by the measured speed of the machine alone" in car(bodies=(body,)).parts["RR"][0].hidden
    assert "would not show" in car().parts["RR"][0].hidden
