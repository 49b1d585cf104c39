"""What turns contradict of the places of wheels and axles: nothing on a right machine, and each exchange by its name."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.machine.config import Machine
from replay.machine.geometry import Geometry, WheelGeometry
from replay.setup.places import place_doubts
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

DT, BASE, TRACK = 0.05, 2.0, 1.2
FOUR = {
    "FR": WheelGeometry(BASE / 2, -TRACK / 2, 0.0, "front"),
    "FL": WheelGeometry(BASE / 2, TRACK / 2, 0.0, "front"),
    "RR": WheelGeometry(-BASE / 2, -TRACK / 2, 0.0, "rear"),
    "RL": WheelGeometry(-BASE / 2, TRACK / 2, 0.0, "rear"),
}


def machine(**axles: str) -> Machine:
    """Four wheels; `axles` stand for `front` and `rear`."""
    wheels = {w: WheelGeometry(g.x, g.y, 0.0, axles.get(g.axle, g.axle)) for w, g in FOUR.items()}
    return Machine("m", "", tuple(FOUR), Geometry(wheels, 0.5), max_speed=2.0)


def driven(seed: int = 5) -> dict[str, Array]:
    """A minute and a half of turns to both sides, forward and backward, the axles steered by different angles."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 90.0, DT)
    v = 1.0 * np.sin(0.15 * t) + 0.4
    front, rear = 0.3 * np.sin(0.4 * t), 0.25 * np.sin(0.4 * t + 2.0)
    yaw = v * (np.tan(front) - np.tan(rear)) / BASE
    out = {"imu.yaw_rate": yaw + 0.01, "steer.front.phi": front, "steer.rear.phi": rear, "cmd.v": v, "cmd.omega": yaw}
    for wheel, place in FOUR.items():
        out[f"wheel.{wheel}.v"] = v - place.y * yaw
    return {n: x + rng.normal(0.0, 0.005, t.size) for n, x in out.items()}


def line(signals: Mapping[str, Array]) -> Timeline:
    size = len(next(iter(signals.values())))
    every = dict.fromkeys(signals, np.ones(size, np.bool_))
    return Timeline(0, round(DT * 1e9), size, signals, every, dict.fromkeys(signals, "log"), {})


def exchanged(signals: Mapping[str, Array], one: str, other: str) -> dict[str, Array]:
    names = {one: other, other: one}
    return {".".join(names.get(p, p) for p in n.split(".")): x for n, x in signals.items()}


def test_a_right_machine_is_not_contradicted() -> None:
    assert place_doubts(line(driven()), machine()) == ()


@pytest.mark.parametrize("wheel", ["FR", "RL"])
@pytest.mark.parametrize("gain", [0.0, 0.6, 1.4])
def test_faults_are_no_contradiction(wheel: str, gain: float) -> None:
    signals = driven()
    half = len(signals["cmd.v"]) // 2
    signals[f"wheel.{wheel}.v"] = np.where(np.arange(2 * half) > half // 2, gain, 1.0) * signals[f"wheel.{wheel}.v"]
    stuck = {**driven(), f"wheel.{wheel}.v": np.full(2 * half, 0.7)}
    assert place_doubts(line(signals), machine()) == ()
    assert place_doubts(line(stuck), machine()) == ()


def test_a_wheel_that_runs_away_from_its_dead_speed_exchanges_nothing() -> None:
    signals = {n: x for n, x in driven().items() if ".F" not in n and ".front" not in n}
    signals |= {"wheel.RR.v": np.zeros_like(signals["cmd.v"]), "wheel.RL.v": 2.0 * signals["cmd.omega"]}
    assert place_doubts(line(signals), machine()) == ()


def test_two_wheels_of_one_axle() -> None:
    assert place_doubts(line(exchanged(driven(), "RR", "RL")), machine()) == (
        "RL and RR are exchanged: they turn against the other wheels, the measured yaw rate, the steering and the commanded yaw rate",
    )


def test_all_wheels() -> None:
    signals = exchanged(exchanged(driven(), "RR", "RL"), "FR", "FL")
    assert place_doubts(line(signals), machine()) == (
        "left and right are exchanged (FL with FR and RL with RR): the wheels turn against the measured yaw rate, the steering and the "
        "commanded yaw rate",
    )
    for name in ("imu.yaw_rate", "steer.front.phi"):
        del signals[name]
    (doubt,) = place_doubts(line(signals), machine())
    assert doubt.startswith(
        "left and right are exchanged (FL with FR and RL with RR), or cmd.omega has the wrong sign: "
    )


@pytest.mark.parametrize("name", ["imu.yaw_rate", "cmd.omega"])
def test_a_wrong_sign(name: str) -> None:
    signals = driven()
    signals[name] = -signals[name]
    (doubt,) = place_doubts(line(signals), machine())
    assert doubt.startswith(f"{name} has the wrong sign: ")


def test_axles() -> None:
    (doubt,) = place_doubts(line(exchanged(driven(), "front", "rear")), machine())
    assert doubt.startswith(
        "steer.front and steer.rear are exchanged, or both have the wrong sign: the measured yaw rate "
    )
    one = driven()
    one["steer.rear.phi"] = -one["steer.rear.phi"]
    (doubt,) = place_doubts(line(one), machine())
    assert doubt == "steer.rear.phi has the wrong sign: the measured yaw rate contradicts it"


def test_a_car_whose_steering_counts_to_the_right() -> None:
    signals = driven()
    del signals["steer.rear.phi"]
    signals["imu.yaw_rate"] = signals["cmd.omega"] = signals["cmd.v"] * np.tan(signals["steer.front.phi"]) / BASE
    for wheel, place in FOUR.items():
        signals[f"wheel.{wheel}.v"] = signals["cmd.v"] - place.y * signals["cmd.omega"]
    car = machine(rear="fixed")
    assert place_doubts(line(signals), car) == ()
    signals["steer.front.phi"] = -signals["steer.front.phi"]
    (doubt,) = place_doubts(line(signals), car)
    assert doubt.startswith("steer.front.phi stands at the other end of the machine or has the wrong sign: ")


def test_turns_to_one_side_say_nothing() -> None:
    signals = exchanged(driven(), "RR", "RL")
    for name in signals:
        signals[name] = np.where(driven()["imu.yaw_rate"] < 0.0, 0.0, signals[name])
    assert place_doubts(line(signals), machine()) == ()
