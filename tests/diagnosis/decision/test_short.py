"""What is said of parts that were not judged long enough."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.decision.short import short_parts
from diagnosis.results.assessment import CODE, Assessment, Lack
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import State
from replay.machine.config import Limits

OPEN = Assessment(
    np.full(100, CODE[State.NOT_ASSESSED]), {State.NOT_ASSESSED: "the model does not hold"}, tier=Tier.MODEL
)


@pytest.mark.parametrize(
    ("side", "signal"),
    [
        ("sensor", "steer.front.phi_true (a second angle)"),
        ("actuator", "steer.front.u_applied (the second measurement"),
    ],
)
def test_a_second_measurement_is_asked_for_where_the_log_has_none(side: str, signal: str) -> None:
    part = ("front", side)
    lacking = replace(OPEN, lacks={State.NOT_ASSESSED: Lack.SECOND})
    for assessment, asked in ((lacking, True), (OPEN, False)):
        (one,) = short_parts([part], {part: assessment}, {part: 5.0}, {part: 60.0}, Limits(), HYDRAULIC, Kind.STEER)
        assert (signal in one.act) is asked
        assert one.act.startswith("steer from stop to stop several times")


def test_the_missing_command_of_a_steering_valve_is_asked_for_by_its_name() -> None:
    part = ("rear", "actuator")
    lacking = {part: replace(OPEN, lacks={State.NOT_ASSESSED: Lack.COMMAND})}
    (one,) = short_parts([part], lacking, {part: 0.0}, {part: 60.0}, Limits(), HYDRAULIC, Kind.STEER)
    assert one.act.startswith("log steer.rear.u (the command of its valve)")
