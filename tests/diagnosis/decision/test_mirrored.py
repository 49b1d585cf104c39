"""Angles that all read −1 times what they should: the settings are wrong, and no part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.decision.mirrored import all_mirrored, axles_in_doubt, mirrored, without_mirrored
from diagnosis.results.assessment import CODE, Assessment, Epsilon, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

N = 1000
AXLES = ("front", "rear")


def finding(size: float, start: int = 50, tier: Tier = Tier.MODEL) -> Finding:
    return Finding(
        start,
        N,
        Side.SENSOR,
        FaultMode.OUTSIDE_TABLE,
        0.95,
        (),
        Epsilon(size, size - 0.03, size + 0.03),
        None,
        (),
        tier,
    )


def assessed(*findings: Finding) -> Assessment:
    states = np.full(N, CODE[State.HEALTHY], np.int8)
    for f in findings:
        states[f.start : f.stop] = CODE[State.OUTSIDE_TABLE]
    return Assessment(states, findings=tuple(findings), tier=Tier.MODEL)


@pytest.mark.parametrize(
    ("front", "rear", "told"),
    [
        (finding(2.0), finding(1.99), True),
        (finding(2.0), finding(0.6), False),
        (finding(2.0), finding(2.0, start=600), False),
    ],
)
def test_all_angles_that_are_mirrored_from_start_to_end_are_a_setting(
    front: Finding, rear: Finding, told: bool
) -> None:
    parts = {("front", "sensor"): assessed(front), ("rear", "sensor"): assessed(rear)}
    text = all_mirrored(parts, AXLES)
    assert bool(text) is told
    assert not told or "steer.front.phi and steer.rear.phi have the wrong sign" in text


def test_one_mirrored_angle_of_two_and_one_of_one_are_a_sensors() -> None:
    parts = {("front", "sensor"): assessed(finding(2.0)), ("rear", "sensor"): assessed()}
    assert not all_mirrored(parts, AXLES)
    assert not all_mirrored(parts, ("front",))


def test_axles_are_in_doubt_where_all_are_named() -> None:
    both = (
        "steer.front.phi and steer.rear.phi are exchanged or have the wrong sign: the steering turns against the wheels"
    )
    assert axles_in_doubt([both], AXLES) == {"front", "rear"}
    assert axles_in_doubt(["steer.rear.phi has the wrong sign: the wheels contradict it"], AXLES) == set()
    assert axles_in_doubt([], AXLES) == set()


def test_what_models_claim_is_dropped_and_what_second_measurements_show_stays() -> None:
    stuck = replace(finding(2.0, 700, Tier.DIRECT), mode=FaultMode.STUCK, epsilon=None)
    parts = {
        ("front", "sensor"): assessed(finding(2.0), stuck),
        ("rear", "sensor"): assessed(finding(2.0, tier=Tier.DIRECT)),
        ("FL", "sensor"): assessed(finding(0.4)),
    }
    told = without_mirrored(parts, {"front", "rear"}, 0.01)
    assert told["front", "sensor"].findings == (stuck,)
    assert told["rear", "sensor"].findings == ()
    assert told["rear", "sensor"].states[500] == CODE[State.NOT_ASSESSED]
    assert told["FL", "sensor"] is parts["FL", "sensor"]
    assert mirrored(finding(1.9))
    assert not mirrored(finding(1.2))
