"""A robot that skids: tyres slip by another share in every turn, sides drag each other along; its sensors are right, or one is scaled."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.ground import shares_of_turning
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.kernel import follow
from diagnosis.results.assessment import Finding
from replay.machine.config import Limits
from replay.machine.geometry import Geometry, WheelGeometry
from tests.campaigns import campaign

Array = NDArray[np.float64]

DT, STEP_S, STEPS, TRACK = 0.05, 6.0, 40, 1.1
PAIR = ("R", "L")
SPELL = slice(round(121.0 / DT), round(139.0 / DT))


class Skidding:
    """Numbers of one mission: each side is told another speed every six seconds, as when a motion model is calibrated."""

    def __init__(self, seed: int, drag: float = 0.35) -> None:
        """Drive; `drag` is how much of what the sides differ the ground takes from them in the hardest step [1]."""
        rng = np.random.default_rng(seed)
        length = round(STEP_S / DT)
        told = {w: np.repeat(rng.uniform(-3.0, 3.0, STEPS), length) for w in PAIR}
        held = np.repeat(rng.uniform(0.0, drag, STEPS) ** 2 / drag, length)
        slip = np.repeat(rng.choice([0.3, 0.4, 0.5, 0.6, 0.65], STEPS), length)
        apart = told["R"] - told["L"]
        pulled = {"R": told["R"] - held * apart, "L": told["L"] + 0.5 * held * apart}
        self.asked = told
        self.measured = {}
        for w in PAIR:
            late = np.r_[np.zeros(8), pulled[w][:-8]]
            self.measured[w] = follow(late, 0.0, 0.3, 0.2) + rng.normal(0.0, 0.02, late.size)
        turn = slip * (self.measured["R"] - self.measured["L"]) / TRACK
        self.yaw = follow(turn, 0.0, 0.2, 1.0) + rng.normal(0.0, 0.02, turn.size)

    def told(self, *, yaw: bool = True) -> list[tuple[str, Finding]]:
        """Findings of both sides by wheel, with or without the gyro."""
        width = cell_of(DT)
        data = {
            w: FollowerData(
                y.copy(),
                np.ones(y.size, np.bool_),
                cells(self.asked[w], width)[:, None],
                self.asked[w],
                f"wheel.{w}.v",
            )
            for w, y in self.measured.items()
        }
        places = {w: WheelGeometry(0.0, (-0.5 if w == "R" else 0.5) * TRACK, 0.0, "fixed") for w in PAIR}
        parts = assess_response(data, Geometry(places, 0.6), self.yaw if yaw else None, Limits(), DT).parts
        return [(w, f) for w, sides in parts.items() for side in sides for f in side.findings]


@pytest.mark.parametrize("yaw", [True, False])
@pytest.mark.parametrize("seed", campaign([1, 2, 3, 4]))
def test_a_healthy_robot_that_skids_is_not_blamed(seed: int, yaw: bool) -> None:
    assert Skidding(seed).told(yaw=yaw) == []


@pytest.mark.parametrize("wheel", campaign(PAIR))
@pytest.mark.parametrize("seed", campaign([1, 2, 3]))
def test_a_wheel_that_reads_half_of_its_speed_is_told_although_the_robot_skids(seed: int, wheel: str) -> None:
    robot = Skidding(seed)
    robot.measured[wheel][SPELL] *= 0.5
    found = robot.told()
    assert {w for w, _ in found} == {wheel}
    assert any(f.start < SPELL.stop and SPELL.start < f.stop for _, f in found)


def test_shares_of_turning_span_what_the_ground_makes() -> None:
    rng = np.random.default_rng(5)
    apart = np.repeat(rng.uniform(-3.0, 3.0, 60), 24)
    share = np.repeat(rng.uniform(0.3, 0.6, 60), 24)
    yaw = share * apart + rng.normal(0.0, 0.01, apart.size)
    shares = shares_of_turning(apart, yaw, np.ones(apart.size, np.bool_))
    assert shares is not None
    assert 0.15 < shares.low < 0.3
    assert 0.6 < shares.high < 0.75
    assert not shares.spins


def test_a_body_that_spins_on_leaves_a_yaw_rate_that_no_share_explains() -> None:
    rng = np.random.default_rng(6)
    apart = np.repeat(rng.uniform(-3.0, 3.0, 60), 24)
    yaw = follow(0.5 * apart, 0.0, 0.12, 1.0)
    shares = shares_of_turning(apart, yaw, np.ones(apart.size, np.bool_))
    assert shares is not None
    assert shares.spins


def test_a_machine_that_hardly_turns_tells_no_share() -> None:
    assert shares_of_turning(np.zeros(400), np.zeros(400), np.ones(400, np.bool_)) is None
