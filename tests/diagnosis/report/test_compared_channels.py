from __future__ import annotations

from typing import Any

import numpy as np

from diagnosis.report.compared_channels import Pair, pair_of, rests_on, shape_sentence
from diagnosis.report.units import DEGREES
from diagnosis.results.document import IntervalRow
from diagnosis.results.machine_words import HYDRAULIC
from tests import report_samples as samples

ONE = np.zeros(1)


def fault(**changes: Any) -> IntervalRow:
    return samples.fault(**{"tier": "direct", "evidence": []} | changes)


def pair(found: IntervalRow, *names: str) -> Pair:
    result = pair_of(found, dict.fromkeys(names, ONE), HYDRAULIC)
    assert result is not None
    return result


def test_second_measurement_is_the_reference_of_direct_evidence_alone() -> None:
    names = ("wheel.FR.v", "wheel.FR.v_true", "evidence.FR.sensor.expected", "replay.FR.v_ref")
    direct, model = pair(fault(), *names), pair(fault(tier="model"), *names)
    assert (direct.reference, direct.words, direct.independent) == ("wheel.FR.v_true", "second measurement", True)
    assert (model.reference, model.words, model.independent) == ("evidence.FR.sensor.expected", "expected value", False)
    assert pair(fault(tier="tracking"), "wheel.FR.v", "replay.FR.v_ref").words == "commanded"
    assert pair(fault(), "wheel.FR.v").reference is None
    assert pair_of(fault(), {}, HYDRAULIC) is None


def test_valve_position_is_compared_with_its_command_where_it_decided() -> None:
    valve = fault(side="actuator")
    names = ("wheel.FR.v", "wheel.FR.u", "wheel.FR.u_applied")
    assert (pair(valve, *names).measured, pair(valve, *names).reference) == ("wheel.FR.u_applied", "wheel.FR.u")
    assert pair(fault(side="actuator", tier="model"), *names).measured == "wheel.FR.v"


def test_steering_angles_are_in_degrees() -> None:
    found = pair(fault(component="front", kind="steer"), "steer.front.phi", "steer.front.phi_true")
    assert (found.unit, found.scale, found.text(2.5)) == ("°", DEGREES, "2.5°")


def test_a_loss_on_either_side_takes_the_side_that_has_evidence() -> None:
    found = pair(fault(side="sensor_or_actuator"), "wheel.FR.v", "evidence.FR.actuator.residual")
    assert found.evidence == "evidence.FR.actuator."


def test_channels_that_the_sentences_name() -> None:
    found = fault(evidence=["wheel.FR.v_true moved on.", "Noise of wheel.FR.v."])
    columns = ["t", "wheel.FR.v", "wheel.FR.v_true", "wheel.FR.u", "evidence.FR.sensor.residual"]
    assert rests_on(found, columns, HYDRAULIC) == "second measurement: wheel.FR.v_true, wheel.FR.v"
    assert rests_on(fault(evidence=["wheel.FR.v2 moved."]), columns, HYDRAULIC) == "second measurement"
    assert rests_on(fault(tier="none"), columns, HYDRAULIC) == ""


def test_evidence_by_the_position_of_the_own_joint_says_so() -> None:
    by_joint = fault(
        tier="response", evidence=["wheel.FR.v is 0.53 × what the position of its joint (wheel.FR.v_position) shows."]
    )
    names = ["wheel.FR.v", "wheel.FR.v_position"]
    assert rests_on(by_joint, names, HYDRAULIC) == "position of its joint: wheel.FR.v, wheel.FR.v_position"
    beside = fault(tier="response", evidence=["wheel.FR.v is 0.53 × what wheel.FL.v shows."])
    assert rests_on(beside, names, HYDRAULIC) == "command response: wheel.FR.v"


def test_sentence_about_the_onset() -> None:
    texts = ["Residual 0.1 m/s, which jumps.", "The speed dropped by 0.2 m/s at once."]
    assert shape_sentence(fault(evidence=texts, about=["deviation", "onset"])) == texts[1]
    assert shape_sentence(fault(evidence=texts)) == ""  # a result of an earlier version does not say
