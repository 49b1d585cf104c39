"""What is off on an axle without a fault stands among what is open, and beside an all-clear, with its size."""

from __future__ import annotations

import numpy as np

from diagnosis.decision.unexplained_axles import unexplained_points, unexplained_sentences
from diagnosis.results.assessment import Assessment
from diagnosis.results.machine_words import HYDRAULIC

PART = ("rear", "sensor")


def off() -> dict[tuple[str, str], Assessment]:
    states = np.zeros(10, np.int8)
    size = "off what its model expects by up to −3.5° at 22.0–36.0 s"
    return {
        PART: Assessment(states, unexplained_s=14.0, unexplained_size=size),
        ("front", "sensor"): Assessment(states, unexplained_s=3.0),
        ("FR", "sensor"): Assessment(states, unexplained_s=3.0, unexplained_size="off"),
    }


def test_it_stands_among_what_is_open_with_what_settles_it() -> None:
    [point] = unexplained_points(off(), ("front", "rear"), (), (), HYDRAULIC)
    assert point.reason == (
        "The rear steering sensor is off what its model expects by up to −3.5° at 22.0–36.0 s: no single fault explains it, "
        "so that 14.0 s of it were not judged."
    )
    assert "steer.rear.phi_true" in point.act
    assert point.parts == (PART,)
    [twice] = unexplained_points(off(), ("front", "rear"), (), {PART}, HYDRAULIC)
    assert twice.act.startswith("compare both angles with a protractor")
    assert unexplained_points(off(), ("front", "rear"), {PART}, (), HYDRAULIC) == []


def test_an_all_clear_does_not_keep_it_to_itself() -> None:
    [said] = unexplained_sentences(off(), ("front", "rear"), HYDRAULIC)
    assert "by up to −3.5° at 22.0–36.0 s, less than what keeps a machine in: no single fault explains it" in said
