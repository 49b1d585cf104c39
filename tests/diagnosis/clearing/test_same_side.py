"""The two wheels of a side beside each other: one that departs, all that depart alike, and machines without two sides of two."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.clearing.responses import Responses
from diagnosis.clearing.same_side import beside_its_side

N = 60
LEFT_RIGHT = {"FR": -1.0, "FL": 1.0, "RR": -1.0, "RL": 1.0}


def cells_of(places: dict[str, float]) -> Any:
    geometry = SimpleNamespace(wheels={wheel: SimpleNamespace(y=y, offset=0.0) for wheel, y in places.items()})
    return SimpleNamespace(machine=SimpleNamespace(geometry=geometry, wheels=tuple(places)))


def responses(own: np.ndarray) -> Responses:
    """Wheels with these speeds per opening [ln], the first half driven forward."""
    ahead = np.repeat((np.arange(N) < N // 2)[:, np.newaxis], own.shape[1], axis=1)
    return Responses(own, own, [], own, ahead, [], [], own, own)


def alike(seed: int = 1) -> np.ndarray:
    """Sides that differ in turns by a fifth, and always by a bit from axle to axle."""
    turns = 0.2 * np.sin(np.arange(N) / 5.0)[:, np.newaxis] * np.array([-1.0, 1.0, -1.0, 1.0])
    return turns + np.array([0.0, 0.01, 0.03, 0.04]) + 0.01 * np.random.default_rng(seed).standard_normal((N, 4))


@pytest.mark.parametrize("lost", [0.2, -0.2])
def test_a_wheel_that_departs_from_its_side_casts_doubt_on_both_of_it(lost: float) -> None:
    own = alike()
    own[10:20, 0] -= lost
    found = beside_its_side(cells_of(LEFT_RIGHT), responses(own))
    over = {i: bool(np.nanmax(off) > limit) for i, (off, limit) in found.items()}
    assert over == {0: True, 1: False, 2: True, 3: False}
    assert int(np.nanargmax(found[0][0])) in range(10, 20)


def test_where_both_sides_vary_as_much_nothing_stands_out() -> None:
    own = alike()
    own[10:20, 0] -= 0.2
    own[15:25, 1] += 0.1
    assert all(np.nanmax(off) < limit for off, limit in beside_its_side(cells_of(LEFT_RIGHT), responses(own)).values())


def test_without_two_sides_of_two_wheels_there_is_nothing_to_compare() -> None:
    assert beside_its_side(cells_of({"FR": -1.0, "FL": 1.0, "RR": -1.0}), responses(alike()[:, :3])) == {}
    none: Any = SimpleNamespace(machine=SimpleNamespace(geometry=None, wheels=("FR",)))
    assert beside_its_side(none, responses(alike()[:, :1])) == {}
    unknown = alike()
    unknown[:, 1] = np.nan  # the other side says nothing
    assert set(beside_its_side(cells_of(LEFT_RIGHT), responses(unknown))) == {1, 3}
