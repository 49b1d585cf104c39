"""Axles that stand still while all wheels make less of their commands: what supplies the machine is as likely as their valves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing.one_supply import agree_twice, less_sure_beside_supply
from diagnosis.clearing.untold_faults import finding_of
from diagnosis.results.assessment import CODE, Assessment
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_event import MachineEvent, less_than_told, other_yaw_rate
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Epsilon
from diagnosis.results.vocabulary import Kind
from replay.faults import FaultMode, Side, State

DT = 0.1
SLOWER = less_than_told("All wheels together make 0.6 times what they are told at 20-40 s, and 1.00 times else")


def standing(*spans: tuple[int, int]) -> dict[tuple[str, str], Assessment]:
    """Axles that stand still, each for a time, by their names."""
    states = np.full(1000, CODE[State.HEALTHY])
    return {
        (axle, "actuator"): Assessment(
            states, findings=(finding_of(span, FaultMode.NO_SIGNAL, Epsilon(1.0, 0.8, 1.0), ("It stands.",)),)
        )
        for axle, span in zip(("front", "rear"), spans, strict=False)
    }


def most(found: dict[tuple[str, str], Assessment], *events: MachineEvent) -> list[float]:
    told = less_sure_beside_supply(found, events, ("front", "rear"), HYDRAULIC, DT)
    return [f.probability for a in told.values() for f in a.findings]


@pytest.mark.parametrize(
    ("spans", "at", "less"),
    [
        (((200, 400),), (20.0, 40.0), True),
        (((600, 800),), (20.0, 40.0), False),
        (((600, 800), (620, 810)), (20.0, 40.0), True),
        (((600, 700), (800, 900)), (20.0, 40.0), False),
    ],
)
def test_an_axle_is_less_sure_at_that_time_or_where_several_stand(
    spans: tuple[tuple[int, int], ...], at: tuple[float, float], less: bool
) -> None:
    found = standing(*spans)
    before = most(found)
    after = most(found, SLOWER.at([at]))
    assert all((b < a) is less for a, b in zip(before, after, strict=True))
    assert most(found, other_yaw_rate("The machine turns.")) == before


def test_what_is_said_speaks_of_the_machine() -> None:
    told = less_sure_beside_supply(standing((200, 400)), [SLOWER], ("front", "rear"), HYDRAULIC, DT)
    (f,) = told["front", "actuator"].findings
    assert f.evidence[-1].startswith("All wheels together made less")


def test_an_axle_agrees_twice_where_both_sides_pass() -> None:
    check = Checked(Kind.STEER, "front", Side.SENSOR, Check.SECOND_MEASUREMENT, 0.1, 0.25)
    other = replace(check, side=Side.ACTUATOR)
    assert agree_twice([check, other], "front")
    assert not agree_twice([check, other], "rear")
    assert not agree_twice([check, replace(other, worst=0.4)], "front")
