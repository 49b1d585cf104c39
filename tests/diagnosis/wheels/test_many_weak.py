"""Weak findings on most wheels blame none; those of one or two wheels, and certain ones, stay."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.result import Hypothesis
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.many_weak import without_many_weak
from replay.faults import FaultMode, Side

PART = slice(200, 400)


def finding(healthy: float, side: Side = Side.ACTUATOR) -> Any:
    said = (Hypothesis("actuator", "stuck", 1.0 - healthy), Hypothesis("none", "healthy", healthy))
    return SimpleNamespace(start=PART.start, stop=PART.stop, hypotheses=said, side=side, mode=FaultMode.STUCK)


def wheels(*healthy: float | None) -> dict[int, WheelFindings]:
    sides = (Side.SENSOR, Side.ACTUATOR)
    return {
        i: WheelFindings(
            [] if p is None else [finding(p)],
            {side: np.zeros(1_000, dtype=np.bool_) for side in sides},
            {side: np.zeros(1_000, dtype=np.bool_) for side in sides},
        )
        for i, p in enumerate(healthy)
    }


def test_weak_findings_on_most_wheels_are_the_machines() -> None:
    got = without_many_weak(wheels(0.1, 0.2, None, 0.1))
    assert got.wheels == 3
    assert all(w.findings == [] for w in got.found.values())
    assert got.found[0].opened[Side.SENSOR][PART].all()
    assert got.found[1].unexplained[Side.ACTUATOR][PART].all()
    assert not got.found[2].opened[Side.SENSOR].any()
    assert got.sentence.startswith("3 {wheels} deviate")


def test_a_certain_finding_stays_where_the_others_may_respond_to_it() -> None:
    got = without_many_weak(wheels(0.0, 0.2, 0.1, 0.1))
    assert [len(w.findings) for w in got.found.values()] == [1, 0, 0, 0]


@pytest.mark.parametrize("healthy", [(0.1, None, None, None), (0.0, 0.1, None, None), (0.0, 0.0, 0.1, 0.1)])
def test_fewer_weak_ones_or_several_certain_ones_stay(healthy: tuple[float | None, ...]) -> None:
    before = wheels(*healthy)
    got = without_many_weak(before)
    assert got.found == before
    assert got.sentence == ""


def test_two_weak_ones_of_the_same_time_share_a_cause() -> None:
    got = without_many_weak(wheels(0.1, 0.2, None, None))
    assert got.wheels == 2
    assert [len(w.findings) for w in got.found.values()] == [0, 0, 0, 0]


def test_two_weak_ones_of_other_sides_stay() -> None:
    before = wheels(0.1, 0.2, None, None)
    before[1].findings[0] = finding(0.2, Side.SENSOR)
    assert without_many_weak(before).found == before
