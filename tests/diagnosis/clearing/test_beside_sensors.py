"""Partial faults of wheels are less sure while another wheel's speed sensor gives nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing.beside import less_sure_beside_dead_sensors
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode
from tests.diagnosis.clearing.test_beside_angles import SURE, fault

STATES = np.zeros(3000, dtype=np.int8)


@pytest.mark.parametrize(
    ("own", "other", "most"),
    [
        (fault(1000, 1500), fault(0, 3000, mode=FaultMode.NO_SIGNAL), 0.55),
        (fault(1000, 1500), replace(fault(0, 3000, mode=FaultMode.NO_SIGNAL), probability=0.8), 0.65),
        (fault(1000, 1500, mode=FaultMode.NOISY), fault(900, 1400, mode=FaultMode.STUCK), 0.55),
        (fault(1000, 1500, mode=FaultMode.NO_SIGNAL), fault(0, 3000, mode=FaultMode.NO_SIGNAL), SURE),
        (fault(1000, 1500, tier=Tier.DIRECT), fault(0, 3000, mode=FaultMode.NO_SIGNAL), SURE),
        (fault(1000, 1500), fault(1400, 3000, mode=FaultMode.NO_SIGNAL), SURE),
        (fault(1000, 1500), fault(0, 3000), SURE),
    ],
    ids=[
        "loses",
        "beside one that is less sure",
        "shakes",
        "is dead itself",
        "measured twice",
        "at another time",
        "beside a loss",
    ],
)
def test_what_a_runaway_wheel_may_do_to_the_others_is_no_claim(own: Finding, other: Finding, most: float) -> None:
    before = {
        ("FR", "sensor"): Assessment(STATES, findings=(own,)),
        ("RR", "sensor"): Assessment(STATES, findings=(other,)),
    }
    after = less_sure_beside_dead_sensors(before, ("FR", "RR"), HYDRAULIC)
    (found,) = after["FR", "sensor"].findings
    assert found.probability == pytest.approx(most)
    assert len([text for text in found.evidence if text.startswith("Meanwhile")]) == (most != SURE)
    assert after["RR", "sensor"] is before["RR", "sensor"]
