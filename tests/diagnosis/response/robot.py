"""A skid-steered robot with four wheels in numbers: commands of its body, drives with delay, lag and slip, 20 Hz."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.kernel import follow
from replay.machine.geometry import Geometry, WheelGeometry

Array = NDArray[np.float64]

DT, SECONDS, TRACK = 0.05, 150.0, 0.6
WHEELS = ("FR", "FL", "RR", "RL")


def commands(seed: int) -> tuple[Array, Array]:
    """Speed [m/s] and yaw rate [rad/s] that are asked for, piecewise constant."""
    rng = np.random.default_rng(seed)
    n, v, turn = round(SECONDS / DT), [], []
    while len(v) < n:
        length = int(rng.uniform(3.0, 8.0) / DT)
        v += [rng.choice([0.0, 0.4, 0.7, 1.0, -0.5], p=[0.1, 0.25, 0.3, 0.25, 0.1])] * length
        turn += [rng.choice([0.0, 0.0, 0.5, -0.5])] * length
    return np.array(v[:n]), np.array(turn[:n])


def speeds(seed: int, wheels: tuple[str, ...] = WHEELS) -> tuple[dict[str, Array], dict[str, Array], Array]:
    """Speeds that the wheels of a healthy robot report, what each is asked for [m/s], and the commands of the body, (n, 2)."""
    return robot_of(*commands(seed), seed, wheels)


def robot_of(
    v: Array, turn: Array, seed: int, wheels: tuple[str, ...] = WHEELS
) -> tuple[dict[str, Array], dict[str, Array], Array]:
    """What `speeds` returns, of a speed [m/s] and a yaw rate [rad/s] that are asked for, shape (n,)."""
    rng = np.random.default_rng(seed + 1000)
    measured, asked = {}, {}
    for w in wheels:
        asked[w] = v + (0.5 if w.endswith("R") else -0.5) * TRACK * turn
        late = np.r_[np.zeros(6), asked[w][:-6]]
        side = follow(late, 0.0, 0.15, 0.08)
        measured[w] = np.round(side * (1.0 + rng.normal(0.0, 0.01)) + rng.normal(0.0, 0.01, v.size), 3)
    return measured, asked, np.column_stack([v, turn])


def followers_of(measured: dict[str, Array], asked: dict[str, Array], body: Array) -> dict[str, FollowerData]:
    """What the family is given."""
    width = cell_of(DT)
    columns = np.column_stack([cells(body[:, k], width) for k in range(body.shape[1])])
    return {
        w: FollowerData(y.copy(), np.ones(y.size, np.bool_), columns, asked[w], f"wheel.{w}.v")
        for w, y in measured.items()
    }


def geometry(wheels: tuple[str, ...] = WHEELS) -> Geometry:
    """Where its wheels are."""
    places = {
        w: WheelGeometry(0.3 if w.startswith("F") else -0.3, -0.3 if w.endswith("R") else 0.3, 0.0, "fixed")
        for w in wheels
    }
    return Geometry(places, 0.33)
