"""What a gyro and the wheels contradict each other in is no gyro's fault alone where slip may make it."""

from __future__ import annotations

import pytest

from diagnosis.results.machine_event import GYRO_CONSTANT, GYRO_SLIP, gyro_or_slip
from diagnosis.results.machine_words import HYDRAULIC


@pytest.mark.parametrize(
    "what", [f"reads -5.4°/s {GYRO_CONSTANT}", f"reads 0.30 × what the {{wheels}} make, {GYRO_SLIP}"]
)
def test_slip_is_named_and_looked_for_first(what: str) -> None:
    event = gyro_or_slip(f"From 1.0 to 5.0 s the gyro (imu.yaw_rate) {what}.")
    assert event.title == "Gyro and {wheels} contradict each other"
    assert event.act.startswith("look whether the {wheels} slipped there")
    assert "slip" in event.text.lower()


def test_a_gyro_that_stays_is_the_gyros() -> None:
    event = gyro_or_slip(
        "From 1.0 to 5.0 s the gyro (imu.yaw_rate) stays at 11°/s while the {wheels} turn the machine."
    )
    assert event.title == "The gyro contradicts the {wheels}"
    assert "lip" not in event.text


def test_what_happens_to_the_machine_is_told_with_minus_signs() -> None:
    assert "−0.10 × what" in gyro_or_slip("the gyro reads -0.10 × what the {wheel}s make").worded(HYDRAULIC).text
